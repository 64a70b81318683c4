// SPDX-License-Identifier: Apache-2.0
// vggt-cd evaluate: cameras against known poses, results of detect against the truth.
#include <fmt/format.h>

#include <set>

#include "vggtcd/cli/command.h"
#include "vggtcd/cli/standard_streams.h"
#include "vggtcd/evaluation/pose_pairs.h"
#include "vggtcd/evaluation/results_scores.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/io/output_conflict.h"
#include "vggtcd/io/sim3_file.h"
#include "vggtcd/io/trajectory.h"

namespace vggtcd::cli {
namespace {

struct Arguments {
  std::string before, after, change, truth, truth_before, truth_after, sim3, out;
  std::string poses = "camera_from_world";
};

PoseConvention convention_of(const std::string& name) {
  return name == "camera_from_world" ? PoseConvention::kCameraFromWorld
                                     : PoseConvention::kWorldFromCamera;
}

TrajectoryFile read_poses(const std::string& path, const std::string& convention) {
  return read_trajectory_file(path, convention_of(convention));
}

// The true cameras of both epochs, and the files they are from.
struct Truth {
  TrajectoryFile t1, t2;
  std::string t1_file, t2_file;
};

// A COLMAP model of both epochs: images named SEQUENCE/FILE; the first folder is T1 (or the one
// named "before").
Truth split_by_folder(const TrajectoryFile& all, const std::string& path) {
  const auto folder_of = [](const NamedPose& pose) {
    return pose.name.substr(0, pose.name.find_last_of('/') + 1);
  };
  std::set<std::string> names;
  for (const NamedPose& pose : all.poses) names.insert(folder_of(pose));
  if (names.size() != 2) {
    throw_error(
        ErrorCode::kInput,
        "{}: expected images in two folders, one per epoch, found {}; use --truth-before and "
        "--truth-after",
        path, names.size());
  }
  std::vector<std::string> folders(names.begin(), names.end());
  if (folders[1] == "before/") std::swap(folders[0], folders[1]);
  Truth result{{{}, all.names}, {{}, all.names}, path, path};
  for (const NamedPose& pose : all.poses) {
    (folder_of(pose) == folders[0] ? result.t1 : result.t2).poses.push_back(pose);
  }
  return result;
}

TrajectoryFile numbered(const std::vector<Rigid3>& poses) {
  TrajectoryFile file;
  for (const Rigid3& pose : poses) file.poses.push_back({std::to_string(file.poses.size()), pose});
  return file;
}

Truth read_truth(const Arguments& arguments) {
  const std::string& path = arguments.truth;
  if (path.ends_with(".npz")) {
    const BitemporalTrajectory cameras = read_true_cameras(path);
    return {numbered(cameras.t1), numbered(cameras.t2), path, path};
  }
  if (!path.empty()) return split_by_folder(read_poses(path, arguments.poses), path);
  if (arguments.truth_before.empty() || arguments.truth_after.empty()) {
    throw_error(ErrorCode::kUsage,
                "truth: expected --truth, or --truth-before and --truth-after, found neither");
  }
  return {read_poses(arguments.truth_before, arguments.poses),
          read_poses(arguments.truth_after, arguments.poses), arguments.truth_before,
          arguments.truth_after};
}

PosePairs pair_and_tell(const std::string& path, const std::string& convention,
                        const TrajectoryFile& truth, const std::string& truth_file,
                        ProgressSink& progress) {
  const PosePairs pairs = pair_poses(read_poses(path, convention), path, truth, truth_file);
  const auto tell = [&](size_t alone, const std::string& file, const std::string& other) {
    if (alone == 0) return;
    progress.notice(fmt::format("{}: {} of {} poses have no partner in {} and are left out", file,
                                alone, alone + pairs.truth.size(), other));
  };
  tell(pairs.predicted_alone, path, truth_file);
  tell(pairs.truth_alone, truth_file, path);
  return pairs;
}

Json change_json(const ChangeScores& scores) {
  return {{"pixels", scores.pixels},
          {"changed_pixels", scores.changed_pixels},
          {"precision", scores.precision},
          {"recall", scores.recall},
          {"f1", scores.f1},
          {"auprc", scores.auprc}};
}

// Results of detect on a generated scene.
void run_change(const Arguments& arguments) {
  if (!arguments.before.empty() || !arguments.truth.ends_with(".npz")) {
    throw_error(ErrorCode::kUsage,
                "--change: expected a directory of results and --truth truth.npz of a generated "
                "scene, and nothing else");
  }
  const ResultsScores s = score_results(arguments.change, arguments.truth);
  print_answer(
      "photos placed             {:>5} of {} before, {} of {} after\n"
      "ATE mean                  {:>12.6g} m\n"
      "pixels with evidence      {:>11.1f} %\n"
      "                          {:>12} {:>12}\n"
      "precision                 {:>12.3f} {:>12.3f}\n"
      "recall                    {:>12.3f} {:>12.3f}\n"
      "F1                        {:>12.3f} {:>12.3f}\n"
      "AUPRC                     {:>12.3f} {:>12.3f}\n"
      "never-seen called changed {:>11.1f} %\n"
      "most change found in      {}, {}\n",
      s.frames_t1, s.true_frames_t1, s.frames_t2, s.true_frames_t2, s.cameras.ate_mean,
      100 * s.evidence_share, "evidence", "every pixel", s.evidence.precision,
      s.every_pixel.precision, s.evidence.recall, s.every_pixel.recall, s.evidence.f1,
      s.every_pixel.f1, s.evidence.auprc, s.every_pixel.auprc, 100 * s.unseen_called_changed,
      s.most_changed_t1, s.most_changed_t2);
  if (arguments.out.empty()) return;
  write_json_file(arguments.out, Json{{"frames_t1", s.frames_t1},
                                      {"frames_t2", s.frames_t2},
                                      {"true_frames_t1", s.true_frames_t1},
                                      {"true_frames_t2", s.true_frames_t2},
                                      {"ate_mean", s.cameras.ate_mean},
                                      {"ate_relative", s.cameras.ate_relative},
                                      {"rre_mean_deg", s.cameras.rre_mean_deg},
                                      {"evidence_share", s.evidence_share},
                                      {"unseen_called_changed", s.unseen_called_changed},
                                      {"most_changed_t1", s.most_changed_t1},
                                      {"most_changed_t2", s.most_changed_t2},
                                      {"evidence", change_json(s.evidence)},
                                      {"every_pixel", change_json(s.every_pixel)}});
}

void run(const Arguments& arguments, ProgressSink& progress) {
  require_file_apart(arguments.out,
                     {arguments.before, arguments.after, arguments.truth, arguments.truth_before,
                      arguments.truth_after, arguments.sim3});
  if (!arguments.change.empty()) require_no_result(arguments.out, arguments.change);
  if (!arguments.change.empty()) return run_change(arguments);
  if (arguments.before.empty() || arguments.after.empty()) {
    throw_error(ErrorCode::kUsage,
                "expected the cameras BEFORE and AFTER, or --change with results of detect");
  }
  const Sim3 t2_from_t1 = arguments.sim3.empty() ? Sim3{} : read_sim3(arguments.sim3);
  const Truth truth = read_truth(arguments);
  const PosePairs t1 =
      pair_and_tell(arguments.before, arguments.poses, truth.t1, truth.t1_file, progress);
  const PosePairs t2 =
      pair_and_tell(arguments.after, arguments.poses, truth.t2, truth.t2_file, progress);
  const TrajectoryErrors e = evaluate_trajectory(
      register_trajectory(t1.predicted, t2.predicted, t2_from_t1), {t1.truth, t2.truth});
  print_answer(
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
  CLI::App* command =
      add_command(program, program.app, "evaluate",
                  "Compare cameras of both epochs with known poses (ATE, RTE, RRE), or "
                  "all of detect's results with "
                  "the truth of a generated scene.",
                  [arguments](ProgressSink& progress) { run(*arguments, progress); });
  command->add_option("BEFORE", arguments->before, "predicted cameras of the before epoch");
  command->add_option("AFTER", arguments->after, "predicted cameras of the after epoch");
  command->add_option("--change", arguments->change,
                      "results of detect on a generated scene, from its photos or its predictions");
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
  command->add_option("-o,--out,--output", arguments->out, "also write the numbers as JSON");
  command->footer(
      "Cameras are read from .npy ((N,4,4) or (N,3,4)), COLMAP models (folder) and TUM files.\n"
      "Frames are matched by the photos' names (two COLMAP models), by time stamps (two TUM files, "
      "to\n"
      "0.01 s), otherwise in order: photo_2 before photo_10. T1 is mapped into T2, one Umeyama\n"
      "Sim(3) over all camera centres maps both to the truth; ATE in the truth's unit. RTE and "
      "RRE\n"
      "compare neighbouring frames of an epoch, with that scale. Definitions: "
      "docs/benchmark.md.\n\n"
      "  vggt-cd evaluate OUT/cameras_before.tum OUT/cameras_after.tum --truth truth.npz\n"
      "  vggt-cd evaluate --change OUT --truth truth.npz");
}

}  // namespace vggtcd::cli
