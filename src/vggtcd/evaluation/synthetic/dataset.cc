// SPDX-License-Identifier: Apache-2.0
// Writing generated scenes. Every file's bytes depend on the options alone.
#include "vggtcd/evaluation/synthetic/dataset.h"

#include <Eigen/Geometry>

#include "vggtcd/core/error.h"
#include "vggtcd/evaluation/synthetic/truth_file.h"
#include "vggtcd/geometry/umeyama.h"
#include "vggtcd/io/colmap.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/image_write.h"
#include "vggtcd/io/output_directory.h"
#include "vggtcd/io/predictions.h"
#include "vggtcd/scene/confidence.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEpochFolder[] = {"before", "after"};

// The pass's own fit to the world: every 7th confident pixel of unchanged surface.
Sim3 world_from_pass(const EpochTruth& truth, const Reconstruction& pass) {
  const float threshold = confidence_threshold(pass);
  std::vector<Eigen::Vector3d> predicted, true_points;
  const size_t width = static_cast<size_t>(truth.width);
  for (size_t pixel = 0; pixel < pass.num_pixels(); pixel += 7) {
    if (pass.confidence[pixel] <= threshold || truth.label[pixel] != kLabelUnchanged) continue;
    const View& view = truth.views[pixel / truth.pixels_per_frame()];
    const size_t in_frame = pixel % truth.pixels_per_frame();
    predicted.push_back(unproject_pixel(pass, static_cast<uint32_t>(pixel)).cast<double>());
    true_points.push_back(view.camera_from_world.inverse() *
                          view.pinhole.unproject(static_cast<double>(in_frame % width),
                                                 static_cast<double>(in_frame / width),
                                                 truth.depth_m[pixel]));
  }
  const UmeyamaResult fit = umeyama(predicted, true_points);
  check(fit.determined(), "best_t2_from_t1: a pass that does not determine a similarity");
  return fit.y_from_x;
}

// wat/SCENE/images/{before,after}/*.jpg and sparse/0, as COLMAP left it.
void write_wat(const fs::path& root, const fs::path& photos, const SyntheticScene& scene,
               const SceneTruth& truth, int photo_scale) {
  const fs::path base = root / scene.name;
  std::vector<View> views;
  std::vector<ColoredPoint> points;
  for (const Epoch which : kEpochs) {
    const char* folder = kEpochFolder[static_cast<int>(which)];
    make_folder(base / "images" / folder);
    const EpochTruth& epoch = truth.of(which);
    for (const View& view : epoch.views) {
      copy_unless_there(photos / folder / view.name, base / "images" / folder / view.name);
      views.push_back({view.camera_from_world, scaled_pinhole(view.pinhole, photo_scale),
                       std::string(folder) + "/" + view.name});
    }
    // Sparse points of the static background.
    for (size_t pixel = 0; pixel < epoch.label.size(); pixel += 997) {
      if (epoch.label[pixel] != kLabelUnchanged) continue;
      const View& view = epoch.views[pixel / epoch.pixels_per_frame()];
      const size_t in_frame = pixel % epoch.pixels_per_frame();
      const size_t width = static_cast<size_t>(epoch.width);
      points.push_back(
          {view.camera_from_world.inverse() *
               view.pinhole.unproject(static_cast<double>(in_frame % width),
                                      static_cast<double>(in_frame / width), epoch.depth_m[pixel]),
           {epoch.color[3 * pixel], epoch.color[3 * pixel + 1], epoch.color[3 * pixel + 2]}});
    }
  }
  make_folder(base / "sparse" / "0");
  write_colmap_binary(base / "sparse" / "0", views, points);
}

OutputContents contents_of(const SynthesizeOptions& options) {
  OutputContents contents{"scene", {"truth.json", "truth.npz", "t1.npz", "t2.npz", "joint.npz"}};
  if (options.photos) contents.names.insert(contents.names.end(), {"before/", "after/"});
  if (options.wat) contents.names.push_back("wat/");
  return contents;
}

}  // namespace

void SynthesizeOptions::validate() const {
  check_field(keyframes >= 2, "keyframes", keyframes, "at least 2");
  check_field(jpeg_quality >= 1 && jpeg_quality <= 100, "jpeg_quality", jpeg_quality, "1 to 100");
  check_field(photos || !wat, "wat", wat, "no-wat when photos are not written");
  render.validate();
  errors.validate();
}

Sim3 best_t2_from_t1(const SceneTruth& truth, const Reconstruction& t1, const Reconstruction& t2) {
  return world_from_pass(truth.of(Epoch::kT2), t2).inverse() *
         world_from_pass(truth.of(Epoch::kT1), t1);
}

void synthesize(const fs::path& directory, const SynthesizeOptions& options,
                ProgressSink& progress) {
  options.validate();
  const SyntheticScene scene =
      make_scene(options.scene, options.seed, options.change, options.texture);
  OutputDirectory out(directory, contents_of(options));
  if (options.photos) {
    for (const char* folder : kEpochFolder) out.subdirectory(folder);
  }
  const SceneTruth truth =
      render(scene, options.render, progress, [&](Epoch which, int frame, const Image& photo) {
        if (!options.photos) return;
        write_jpeg(out / kEpochFolder[static_cast<int>(which)] / fmt::format("{:04d}.jpg", frame),
                   photo, options.jpeg_quality);
      });
  const SimulatedPredictions predictions =
      simulate_predictions(scene, truth, options.keyframes, options.errors);
  write_reconstruction(out / "t1.npz", predictions.t1.reconstruction);
  write_reconstruction(out / "t2.npz", predictions.t2.reconstruction);
  write_joint(out / "joint.npz", predictions.joint);
  write_truth(out.path(), scene, truth, options, predictions);
  if (options.wat) {
    write_wat(out / "wat", out.path(), scene, truth, options.render.photo_scale);
  }
  out.commit();
}

}  // namespace vggtcd
