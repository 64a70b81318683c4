// SPDX-License-Identifier: Apache-2.0
// Writing what is true.
#include "vggtcd/evaluation/synthetic/truth_file.h"

#include <Eigen/Geometry>

#include "vggtcd/io/npz.h"
#include "vggtcd/io/sim3_file.h"

namespace vggtcd {
namespace {

// Arrays in the shapes that NumPy users expect. They must live until the writer is finished.
struct EpochArrays {
  std::vector<double> extrinsic, intrinsic;
  std::vector<int32_t> instance;
  std::vector<uint8_t> change_class, unseen;
};

EpochArrays make_arrays(const SyntheticScene& scene, const EpochTruth& truth) {
  EpochArrays arrays;
  for (const View& view : truth.views) {
    const Eigen::Matrix3d intrinsic = view.pinhole.matrix();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        arrays.extrinsic.push_back(view.camera_from_world.rotation(row, column));
        arrays.intrinsic.push_back(intrinsic(row, column));
      }
      arrays.extrinsic.push_back(view.camera_from_world.translation[row]);
    }
  }
  for (size_t pixel = 0; pixel < truth.object.size(); ++pixel) {
    const int object = truth.object[pixel];
    arrays.instance.push_back(object);
    arrays.change_class.push_back(
        object == 0
            ? kLabelVoid
            : static_cast<uint8_t>(scene.objects[static_cast<size_t>(object - 1)].change()));
    arrays.unseen.push_back(object == 0 || truth.other_looked[pixel] ? 0 : 1);
  }
  return arrays;
}

void add_arrays(NpzWriter& writer, const std::string& epoch, const EpochTruth& truth,
                const EpochArrays& arrays) {
  const int64_t s = truth.num_frames(), h = truth.height, w = truth.width;
  writer.add<double>("extrinsic_" + epoch, {s, 3, 4}, arrays.extrinsic);
  writer.add<double>("intrinsic_" + epoch, {s, 3, 3}, arrays.intrinsic);
  writer.add<float>("depth_" + epoch, {s, h, w}, truth.depth_m);
  writer.add<uint8_t>("changed_" + epoch, {s, h, w}, truth.label);
  writer.add<uint8_t>("change_class_" + epoch, {s, h, w}, arrays.change_class);
  writer.add<int32_t>("instance_" + epoch, {s, h, w}, arrays.instance);
  writer.add_mask("unseen_by_other_" + epoch, {s, h, w}, arrays.unseen);
}

Json json_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Json json_of(const Eigen::Matrix3d& m) {
  Json rows;
  for (int row = 0; row < 3; ++row) rows.push_back(json_of(Eigen::Vector3d(m.row(row))));
  return rows;
}
// The box of an object in world axes: centre, rotation (columns are its axes) and size.
Json box_of(const SceneObject& object, const Rigid3& world_from_object) {
  const Eigen::AlignedBox3d box = object.box_m();
  return {{"center_m", json_of(Eigen::Vector3d(world_from_object * box.center()))},
          {"rotation", json_of(world_from_object.rotation)},
          {"size_m", json_of(Eigen::Vector3d(box.sizes()))}};
}

// How often an object appears: pixels that are evaluated as changed, per epoch.
std::vector<int64_t> changed_pixels(const SyntheticScene& scene, const EpochTruth& truth) {
  std::vector<int64_t> count(scene.objects.size() + 1);
  for (size_t pixel = 0; pixel < truth.object.size(); ++pixel) {
    if (truth.label[pixel] == kLabelChanged) ++count[truth.object[pixel]];
  }
  return count;
}

Json objects_json(const SyntheticScene& scene, const SceneTruth& truth) {
  const std::vector<int64_t> pixels[] = {changed_pixels(scene, truth.of(Epoch::kT1)),
                                         changed_pixels(scene, truth.of(Epoch::kT2))};
  Json list = Json::array();
  for (size_t k = 0; k < scene.objects.size(); ++k) {
    const SceneObject& object = scene.objects[k];
    if (object.change() == ObjectChange::kUnchanged) continue;
    Json entry{
        {"instance", k + 1}, {"name", object.name}, {"class", enum_to_string(object.change())}};
    for (const Epoch which : kEpochs) {
      const int e = static_cast<int>(which);
      const auto& pose = object.world_from_object[e];
      const std::string suffix = e == 0 ? "_t1" : "_t2";
      entry["box" + suffix] = pose ? box_of(object, *pose) : Json();
      entry["changed_pixels" + suffix] = pixels[e][k + 1];
    }
    list.push_back(std::move(entry));
  }
  return list;
}

}  // namespace

void write_truth(const std::filesystem::path& directory, const SyntheticScene& scene,
                 const SceneTruth& truth, const SynthesizeOptions& options,
                 const SimulatedPredictions& predictions) {
  const Sim3 nominal = predictions.t2_from_t1();
  const Sim3 best =
      best_t2_from_t1(truth, predictions.t1.reconstruction, predictions.t2.reconstruction);
  const EpochArrays t1 = make_arrays(scene, truth.of(Epoch::kT1));
  const EpochArrays t2 = make_arrays(scene, truth.of(Epoch::kT2));
  NpzWriter writer(directory / "truth.npz", NpzCompression::kDeflate);
  add_arrays(writer, "t1", truth.of(Epoch::kT1), t1);
  add_arrays(writer, "t2", truth.of(Epoch::kT2), t2);
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rotation = nominal.rotation;
  writer.add<double>("scale", {}, std::span(&nominal.scale, 1));
  writer.add<double>("rotation", {3, 3}, std::span(rotation.data(), 9));
  writer.add<double>("translation", {3}, std::span(nominal.translation.data(), 3));
  writer.finish();

  const Json json{
      {"scene", scene.name},
      {"outdoor", scene.outdoor},
      {"options", options_to_json(options)},
      {"extent_m", truth.extent_m},
      {"changed_share", changed_share(truth)},
      {"t2_from_t1", sim3_to_json(nominal)},
      {"t2_from_t1_best_fit", sim3_to_json(best)},
      {"t1_from_world", sim3_to_json(predictions.t1.pass_from_world)},
      {"t2_from_world", sim3_to_json(predictions.t2.pass_from_world)},
      {"joint_from_world", sim3_to_json(predictions.joint_from_world)},
      {"objects", objects_json(scene, truth)},
  };
  write_json_file(directory / "truth.json", json);
}

}  // namespace vggtcd
