// SPDX-License-Identifier: Apache-2.0
// Running methods on scenes.
#include "vggtcd/evaluation/benchmark.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "vggtcd/change/nearest_distance.h"
#include "vggtcd/core/error.h"
#include "vggtcd/evaluation/baselines/rivals.h"
#include "vggtcd/evaluation/registration_methods.h"
#include "vggtcd/evaluation/synthetic/dataset.h"
#include "vggtcd/evaluation/wat.h"
#include "vggtcd/io/predictions.h"
#include "vggtcd/registration/coarse.h"
#include "vggtcd/registration/fine.h"
#include "vggtcd/scene/keyframes.h"

namespace vggtcd {
namespace {

std::vector<Rigid3> poses_of(const std::vector<View>& views) {
  std::vector<Rigid3> poses;
  for (const View& view : views) poses.push_back(view.camera_from_world);
  return poses;
}

std::vector<Eigen::Vector3d> centers_of(const std::vector<Rigid3>& poses, const Sim3& map = {}) {
  std::vector<Eigen::Vector3d> centers;
  for (const Rigid3& pose : poses) centers.push_back(map * camera_center(pose));
  return centers;
}

TrajectoryErrors errors_of(const RegistrationProblem& problem, const Sim3& t2_from_t1,
                           const BitemporalTrajectory& truth) {
  return evaluate_trajectory(register_trajectory(poses_of(problem.before.views),
                                                 poses_of(problem.after.views), t2_from_t1),
                             truth);
}

MethodOutcome run_method(const RegistrationMethod& method, const RegistrationProblem& problem,
                         const BitemporalTrajectory& truth) {
  MethodOutcome outcome;
  outcome.method = method.name;
  if (!method.run) {
    outcome.failure = method.absent_because;
    return outcome;
  }
  try {
    const auto start = std::chrono::steady_clock::now();
    outcome.t2_from_t1 = method.run(problem);
    outcome.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const BitemporalTrajectory mapped = register_trajectory(
        poses_of(problem.before.views), poses_of(problem.after.views), outcome.t2_from_t1);
    outcome.errors = evaluate_trajectory(mapped, truth);
    outcome.centers_t1 = centers_of(mapped.t1, outcome.errors.truth_from_predicted);
    outcome.centers_t2 = centers_of(mapped.t2, outcome.errors.truth_from_predicted);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kDegenerate) throw;
    outcome.failure = error.what();
  }
  return outcome;
}

std::vector<MethodOutcome> run_methods(const RegistrationProblem& problem,
                                       const BitemporalTrajectory& truth, bool rivals,
                                       ProgressSink& progress) {
  if (rivals && rivals_available()) load_rivals();
  std::vector<MethodOutcome> outcomes;
  for (const RegistrationMethod& method : registration_methods()) {
    if (method.rival && !rivals) continue;
    ProgressStage stage(progress, method.title);
    outcomes.push_back(run_method(method, problem, truth));
  }
  return outcomes;
}

const MethodOutcome* find_method(const std::vector<MethodOutcome>& outcomes,
                                 std::string_view name) {
  for (const MethodOutcome& outcome : outcomes) {
    if (outcome.method == name && outcome.failure.empty()) return &outcome;
  }
  return nullptr;
}

// The budgets of the paper's table of the fine stage; 0 stands for all frames.
std::vector<AblationOutcome> run_ablation(const SyntheticScene& scene, const SceneTruth& truth,
                                          const SimulatedPredictions& predictions,
                                          const BitemporalTrajectory& true_poses) {
  const int frames_t1 = truth.of(Epoch::kT1).num_frames();
  const int frames_t2 = truth.of(Epoch::kT2).num_frames();
  std::vector<AblationOutcome> outcomes;
  for (const int keyframes : {2, 3, 5, 7, 9, 15, 20, 50, 0}) {
    const int count = keyframes == 0 ? std::max(frames_t1, frames_t2) : keyframes;
    if (keyframes >= std::min(frames_t1, frames_t2)) continue;  // the same as all
    JointReconstruction joint;
    joint.keyframes_t1 = select_keyframes(frames_t1, count);
    joint.keyframes_t2 = select_keyframes(frames_t2, count);
    joint.reconstruction =
        simulate_joint(scene, truth, joint.keyframes_t1, joint.keyframes_t2, ErrorModel{})
            .reconstruction;
    const RegistrationProblem problem{predictions.t1.reconstruction, predictions.t2.reconstruction,
                                      joint};
    const Sim3 coarse = align_coarse(problem.before, problem.after, joint, {}).t2_from_t1;
    const FineResult fine = align_fine(problem.before, problem.after, coarse, {});
    outcomes.push_back({keyframes, errors_of(problem, coarse, true_poses).ate_mean,
                        errors_of(problem, fine.t2_from_t1, true_poses).ate_mean,
                        std::string(enum_to_string(fine.verdict))});
  }
  return outcomes;
}

struct EpochPixels {
  const EpochTruth& truth;
  const EpochChange& change;
};

ChangeOutcome score_changes(const EpochPixels (&epochs)[2], const ChangeSet& changes,
                            bool unseen_counted, bool every_pixel) {
  ChangeOutcome outcome;
  outcome.method = "nearest_distance";
  outcome.unseen_counted = unseen_counted;
  outcome.every_pixel = every_pixel;
  ScoredPixels pixels;
  int64_t unseen = 0, unseen_called = 0;
  for (const auto& [truth, change] : epochs) {
    for (size_t pixel = 0; pixel < truth.label.size(); ++pixel) {
      const uint8_t label = truth.label[pixel];
      if (label == kLabelVoid) continue;
      float score = change.score[pixel];
      if (std::isnan(score)) {
        if (!every_pixel) continue;
        score = -1;  // below every distance
      }
      if (!truth.other_looked[pixel]) {
        if (label == kLabelUnchanged) {
          ++unseen;
          unseen_called += changes.changed(score) ? 1 : 0;
        }
        if (!unseen_counted) continue;
      }
      pixels.add(score, label == kLabelChanged);
    }
  }
  outcome.scores = evaluate_changes(pixels, static_cast<float>(changes.threshold_u));
  outcome.unseen_called_changed =
      unseen > 0 ? static_cast<double>(unseen_called) / static_cast<double>(unseen) : 0;
  return outcome;
}

std::vector<ChangeOutcome> run_changes(const RegistrationProblem& problem, const SceneTruth& truth,
                                       const Sim3& t2_from_t1) {
  const ChangeSet changes = detect_changes(problem.before, problem.after, t2_from_t1, {});
  const EpochPixels epochs[] = {{truth.of(Epoch::kT1), changes.t1},
                                {truth.of(Epoch::kT2), changes.t2}};
  std::vector<ChangeOutcome> outcomes;
  for (const bool every_pixel : {false, true}) {
    for (const bool unseen_counted : {false, true}) {
      outcomes.push_back(score_changes(epochs, changes, unseen_counted, every_pixel));
    }
  }
  return outcomes;
}

double changed_share_of(const SceneTruth& truth) {
  int64_t changed = 0, surface = 0;
  for (const EpochTruth& epoch : truth.epoch) {
    for (size_t pixel = 0; pixel < epoch.label.size(); ++pixel) {
      surface += epoch.object[pixel] != 0 ? 1 : 0;
      changed += epoch.label[pixel] == kLabelChanged ? 1 : 0;
    }
  }
  return static_cast<double>(changed) / static_cast<double>(std::max<int64_t>(1, surface));
}

}  // namespace

void BenchmarkOptions::validate() const {
  check_field(seeds >= 1, "seeds", seeds, "at least 1");
  check_field(frames == 0 || frames >= 4, "frames", frames, "0 or at least 4");
  check_field(width >= 32 && width % 2 == 0, "width", width, "even, at least 32");
  check_field(keyframes >= 2, "keyframes", keyframes, "at least 2");
}

SceneOutcome run_synthetic_scene(const std::string& name, uint64_t seed,
                                 const BenchmarkOptions& options, ProgressSink& progress) {
  options.validate();
  const SyntheticScene scene = make_scene(name, seed);
  RenderOptions render_options;
  render_options.frames = options.frames;
  render_options.width = options.width;
  render_options.photo_scale = 1;  // colours only
  render_options.samples = 2;
  const SceneTruth truth = render(scene, render_options, progress);
  const SimulatedPredictions predictions =
      simulate_predictions(scene, truth, options.keyframes, ErrorModel{});
  const RegistrationProblem problem{predictions.t1.reconstruction, predictions.t2.reconstruction,
                                    predictions.joint};
  const BitemporalTrajectory true_poses{poses_of(truth.of(Epoch::kT1).views),
                                        poses_of(truth.of(Epoch::kT2).views)};
  SceneOutcome outcome;
  outcome.scene = name;
  outcome.seed = seed;
  outcome.outdoor = scene.outdoor;
  outcome.scale = scene.scale_t2_from_t1;
  outcome.extent = truth.extent_m;
  outcome.changed_share = changed_share_of(truth);
  outcome.true_centers_t1 = centers_of(true_poses.t1);
  outcome.true_centers_t2 = centers_of(true_poses.t2);
  outcome.best_fit_ate =
      errors_of(problem, best_t2_from_t1(truth, problem.before, problem.after), true_poses)
          .ate_mean;
  outcome.methods = run_methods(problem, true_poses, options.rivals, progress);
  if (options.ablation) {
    ProgressStage stage(progress, "keyframe ablation");
    outcome.ablation = run_ablation(scene, truth, predictions, true_poses);
  }
  if (const MethodOutcome* paper = find_method(outcome.methods, "paper")) {
    ProgressStage stage(progress, "change");
    outcome.changes = run_changes(problem, truth, paper->t2_from_t1);
  }
  return outcome;
}

SceneOutcome run_wat_scene(const std::string& name, const std::filesystem::path& data,
                           const std::filesystem::path& predictions,
                           const BenchmarkOptions& options, ProgressSink& progress) {
  const std::filesystem::path files = predictions / name;
  const Reconstruction before = read_reconstruction(files / "t1.npz", progress);
  const Reconstruction after = read_reconstruction(files / "t2.npz", progress);
  const JointReconstruction joint = read_joint(files / "joint.npz", before, after, progress);
  const BitemporalTrajectory truth = read_wat_truth(data / name, before, after);
  SceneOutcome outcome;
  outcome.scene = name;
  outcome.true_centers_t1 = centers_of(truth.t1);
  outcome.true_centers_t2 = centers_of(truth.t2);
  outcome.scale = 0;  // not known
  outcome.methods = run_methods({before, after, joint}, truth, options.rivals, progress);
  return outcome;
}

}  // namespace vggtcd
