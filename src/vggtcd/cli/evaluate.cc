// SPDX-License-Identifier: Apache-2.0
// vggt-cd evaluate: trajectory errors of a registration against known poses.
#include <fmt/format.h>

#include <algorithm>

#include "vggtcd/cli/command.h"
#include "vggtcd/evaluation/trajectory_metrics.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/io/sim3_file.h"
#include "vggtcd/io/trajectory.h"

namespace vggtcd::cli {
namespace {

struct Arguments {
  std::string before, after, truth, truth_before, truth_after, sim3, out;
  std::string poses = "camera_from_world";
};

PoseConvention convention_of(const std::string& name) {
  return name == "camera_from_world" ? PoseConvention::kCameraFromWorld
                                     : PoseConvention::kWorldFromCamera;
}

std::vector<Rigid3> poses_of(const Trajectory& trajectory) {
  std::vector<Rigid3> poses;
  for (const NamedPose& pose : trajectory) poses.push_back(pose.camera_from_world);
  return poses;
}

std::vector<Rigid3> read_poses(const std::string& path, const std::string& convention) {
  return poses_of(read_trajectory(path, convention_of(convention)));
}

// extrinsic_t1 or extrinsic_t2 of truth.npz.
std::vector<Rigid3> read_truth_npz(const NpzReader& reader, const std::string& key) {
  const int64_t shape[] = {-1, 3, 4};
  reader.expect_shape(key, shape);
  const std::vector<double> values = reader.read<double>(key);
  std::vector<Rigid3> poses(values.size() / 12);
  for (size_t k = 0; k < poses.size(); ++k) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> matrix(&values[12 * k]);
    poses[k] = {matrix.leftCols<3>(), matrix.col(3)};
  }
  return poses;
}

// A COLMAP model of both epochs: images named SEQUENCE/FILE; the first folder is T1 (or the one
// named "before").
BitemporalTrajectory split_by_folder(const Trajectory& all, const std::string& path) {
  std::vector<std::string> folders;
  const auto folder_of = [](const NamedPose& pose) {
    return pose.name.substr(0, pose.name.find_last_of('/') + 1);
  };
  for (const NamedPose& pose : all) {
    if (std::find(folders.begin(), folders.end(), folder_of(pose)) == folders.end())
      folders.push_back(folder_of(pose));
  }
  std::sort(folders.begin(), folders.end());
  if (folders.size() != 2) {
    throw_error(
        ErrorCode::kInput,
        "{}: expected images in two folders, one per epoch, found {}; use --truth-before and "
        "--truth-after",
        path, folders.size());
  }
  if (folders[1] == "before/") std::swap(folders[0], folders[1]);
  BitemporalTrajectory result;
  for (const NamedPose& pose : all) {
    (folder_of(pose) == folders[0] ? result.t1 : result.t2).push_back(pose.camera_from_world);
  }
  return result;
}

BitemporalTrajectory read_truth(const Arguments& arguments) {
  if (!arguments.truth.empty()) {
    if (arguments.truth.ends_with(".npz")) {
      const NpzReader reader(arguments.truth);
      return {read_truth_npz(reader, "extrinsic_t1"), read_truth_npz(reader, "extrinsic_t2")};
    }
    return split_by_folder(read_trajectory(arguments.truth, convention_of(arguments.poses)),
                           arguments.truth);
  }
  if (arguments.truth_before.empty() || arguments.truth_after.empty()) {
    throw_error(ErrorCode::kUsage,
                "truth: expected --truth, or --truth-before and --truth-after, found neither");
  }
  return {read_poses(arguments.truth_before, arguments.poses),
          read_poses(arguments.truth_after, arguments.poses)};
}

void run(const Arguments& arguments) {
  const Sim3 t2_from_t1 = arguments.sim3.empty() ? Sim3{} : read_sim3(arguments.sim3);
  const std::vector<Rigid3> before = read_poses(arguments.before, arguments.poses);
  const std::vector<Rigid3> after = read_poses(arguments.after, arguments.poses);
  const TrajectoryErrors e =
      evaluate_trajectory(register_trajectory(before, after, t2_from_t1), read_truth(arguments));
  fmt::print(
      "frames                    {:>12}\n"
      "ATE mean                  {:>12.6g}\n"
      "ATE RMSE                  {:>12.6g}\n"
      "ATE median                {:>12.6g}\n"
      "ATE mean / path length    {:>12.6g}\n"
      "RTE mean                  {:>12.6g}\n"
      "RRE mean, degrees         {:>12.6g}\n"
      "true path length          {:>12.6g}\n",
      e.frames, e.ate_mean, e.ate_rmse, e.ate_median, e.ate_relative, e.rte_mean, e.rre_mean_deg,
      e.trajectory_length);
  if (arguments.out.empty()) return;
  write_json_file(arguments.out,
                  Json{{"frames", e.frames},
                       {"ate_mean", e.ate_mean},
                       {"ate_rmse", e.ate_rmse},
                       {"ate_median", e.ate_median},
                       {"ate_relative", e.ate_relative},
                       {"rte_mean", e.rte_mean},
                       {"rre_mean_deg", e.rre_mean_deg},
                       {"trajectory_length", e.trajectory_length},
                       {"scale_truth_from_predicted", e.truth_from_predicted.scale}});
}

}  // namespace

void add_evaluate(Program& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = add_command(
      program, program.app, "evaluate",
      "Trajectory errors of a registration: ATE, RTE and RRE of the cameras of both epochs against "
      "known poses.",
      [arguments](ProgressSink&) { run(*arguments); });
  command->add_option("BEFORE", arguments->before, "predicted cameras of the before epoch")
      ->required();
  command->add_option("AFTER", arguments->after, "predicted cameras of the after epoch")
      ->required();
  command->add_option("--sim3", arguments->sim3,
                      "sim3.json that maps BEFORE into AFTER's frame; without it they share one");
  command->add_option(
      "--truth", arguments->truth,
      "true cameras of both epochs: truth.npz of a generated scene, or a COLMAP model "
      "with a folder of images per epoch");
  command->add_option("--truth-before", arguments->truth_before,
                      "true cameras of the before epoch");
  command->add_option("--truth-after", arguments->truth_after, "true cameras of the after epoch");
  command->add_option("--poses", arguments->poses, "what the matrices of .npy files map")
      ->check(CLI::IsMember({"camera_from_world", "world_from_camera"}))
      ->capture_default_str();
  command->add_option("-o,--out", arguments->out, "also write the numbers as JSON");
  command->footer(
      "Cameras are read from .npy ((N,4,4) or (N,3,4)), COLMAP models (folder) and TUM files.\n"
      "Frames are matched in order. T1 is mapped into T2, one Umeyama Sim(3) over all camera "
      "centres\n"
      "maps both to the truth; ATE in the truth's unit. RTE and RRE compare neighbouring frames of "
      "an\n"
      "epoch, with that scale. Definitions: docs/benchmark.md.\n\n"
      "  vggt-cd evaluate OUT/cameras_before.tum OUT/cameras_after.tum --truth truth.npz");
}

}  // namespace vggtcd::cli
