// SPDX-License-Identifier: Apache-2.0
// Running methods on scenes.
#include "vggtcd/evaluation/benchmark.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "vggtcd/core/error.h"
#include "vggtcd/core/number_text.h"
#include "vggtcd/evaluation/baselines/rivals.h"
#include "vggtcd/evaluation/benchmark_summary.h"
#include "vggtcd/evaluation/kept_rivals.h"
#include "vggtcd/evaluation/registration_methods.h"
#include "vggtcd/evaluation/synthetic/dataset.h"
#include "vggtcd/evaluation/wat.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/predictions.h"
#include "vggtcd/registration/coarse.h"
#include "vggtcd/registration/fine.h"
#include "vggtcd/scene/keyframes.h"
#include "vggtcd/scene/sky.h"

namespace vggtcd {
namespace {

constexpr uint8_t kGrey = 128;

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

MethodOutcome outcome_of(const std::string& method, const MethodAnswer& answer,
                         const RegistrationProblem& problem, const BitemporalTrajectory& truth) {
  MethodOutcome outcome;
  outcome.method = method;
  outcome.failure = answer.failure;
  if (!answer.failure.empty()) return outcome;
  outcome.seconds = answer.seconds;
  outcome.found = answer.found;
  outcome.plausibility = plausibility_of(answer.found, problem);
  try {
    const BitemporalTrajectory mapped = register_trajectory(
        poses_of(problem.before.views), poses_of(problem.after.views), outcome.found.t2_from_t1);
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
                                       const std::filesystem::path& kept, ProgressSink& progress) {
  if (rivals && rivals_available()) load_rivals();
  const uint64_t hash = hash_of_epochs(problem);
  std::vector<MethodOutcome> outcomes;
  for (const RegistrationMethod& method : registration_methods()) {
    if (method.rival && !rivals) continue;
    ProgressStage stage(progress, method.title);
    MethodAnswer answer;
    if (method.run) {
      answer = run_or_recall(method, problem, hash, method.rival ? kept : std::filesystem::path());
    } else {
      answer.failure = method.absent_because;
    }
    outcomes.push_back(outcome_of(method.name, answer, problem, truth));
  }
  return outcomes;
}

AblationOutcome run_budget(int keyframes, const RegistrationProblem& problem,
                           const BitemporalTrajectory& truth) {
  const Sim3 coarse = align_coarse(problem.before, problem.after, problem.joint, {}).t2_from_t1;
  const FineResult fine = align_fine(problem.before, problem.after, coarse, {});
  return {keyframes, errors_of(problem, coarse, truth).ate_mean,
          errors_of(problem, fine.t2_from_t1, truth).ate_mean,
          std::string(enum_to_string(fine.verdict))};
}

std::vector<AblationOutcome> run_synthetic_ablation(const SyntheticScene& scene,
                                                    const SceneTruth& truth,
                                                    const ErrorModel& errors,
                                                    const BenchmarkOptions& options,
                                                    const RegistrationProblem& problem,
                                                    const BitemporalTrajectory& true_poses) {
  const int frames_t1 = truth.of(Epoch::kT1).num_frames();
  const int frames_t2 = truth.of(Epoch::kT2).num_frames();
  std::vector<AblationOutcome> outcomes;
  for (const int keyframes : kAblationKeyframes) {
    const int count = keyframes == 0 ? std::max(frames_t1, frames_t2) : keyframes;
    if (keyframes >= std::min(frames_t1, frames_t2)) continue;  // the same as all
    JointReconstruction joint;
    joint.keyframes_t1 = select_keyframes(frames_t1, count);
    joint.keyframes_t2 = select_keyframes(frames_t2, count);
    joint.reconstruction =
        simulate_joint(scene, truth, joint.keyframes_t1, joint.keyframes_t2, errors).reconstruction;
    if (options.find_sky) remove_sky(joint.reconstruction);
    outcomes.push_back(run_budget(keyframes, {problem.before, problem.after, joint}, true_poses));
  }
  return outcomes;
}

// With the joint passes that are there: that of the tables, and files for other numbers of
// keyframes.
std::vector<AblationOutcome> run_wat_ablation(const std::filesystem::path& files,
                                              const BenchmarkOptions& options,
                                              const RegistrationProblem& problem,
                                              const BitemporalTrajectory& truth,
                                              ProgressSink& progress) {
  std::vector<AblationOutcome> outcomes;
  for (const int keyframes : kAblationKeyframes) {
    const std::filesystem::path file = files / wat_joint_name(keyframes);
    if (exists_at(file)) {
      JointReconstruction joint = read_joint(file, problem.before, problem.after, progress);
      if (options.find_sky) remove_sky(joint.reconstruction);
      outcomes.push_back(run_budget(keyframes, {problem.before, problem.after, joint}, truth));
    } else if (problem.joint.keyframes_t1.size() == static_cast<size_t>(keyframes)) {
      outcomes.push_back(run_budget(keyframes, problem, truth));
    }
  }
  return outcomes;
}

}  // namespace

std::vector<uint64_t> parse_seeds(const std::string& list) {
  const auto number = [&](const std::string& text) {
    const auto value = number_in<uint64_t>(text);
    if (!value) {
      throw_error(ErrorCode::kUsage, "seeds: expected numbers such as 1,2,7 or 201-203, found '{}'",
                  list);
    }
    return *value;
  };
  std::vector<uint64_t> seeds;
  for (size_t start = 0; start <= list.size();) {
    const size_t comma = std::min(list.find(',', start), list.size());
    const std::string part = list.substr(start, comma - start);
    const size_t dash = std::min(part.find('-'), part.size());
    const uint64_t first = number(part.substr(0, dash));
    const uint64_t last = dash < part.size() ? number(part.substr(dash + 1)) : first;
    check_field(first <= last && last - first < 1000, "seeds", list,
                "ranges from a smaller to a larger number, of at most 1000");
    for (uint64_t seed = first; seed <= last; ++seed) seeds.push_back(seed);
    start = comma + 1;
  }
  return seeds;
}

void BenchmarkOptions::validate() const {
  parse_seeds(seeds);
  check_field(frames == 0 || frames >= 4, "frames", frames, "0 or at least 4");
  check_field(width >= 32 && width % 2 == 0, "width", width, "even, at least 32");
  check_field(keyframes >= 2, "keyframes", keyframes, "at least 2");
  check_field(error_size >= 0, "error_size", error_size, "at least 0");
  check_field(outlier_keyframes >= 0 && outlier_keyframes < keyframes, "outlier_keyframes",
              outlier_keyframes, "at least 0, and fewer than keyframes");
}

SceneOutcome run_synthetic_scene(const std::string& name, uint64_t seed,
                                 const BenchmarkOptions& options, const std::filesystem::path& kept,
                                 ProgressSink& progress) {
  options.validate();
  const SyntheticScene scene = make_scene(name, seed, options.change, options.texture);
  RenderOptions render_options;
  render_options.frames = options.frames;
  render_options.width = options.width;
  render_options.photo_scale = 1;  // colours only
  render_options.samples = 2;
  const SceneTruth truth = render(scene, render_options, progress);
  ErrorModel errors;
  errors.error_size = options.error_size;
  errors.outlier_keyframes = options.outlier_keyframes;
  SimulatedPredictions predictions = simulate_predictions(scene, truth, options.keyframes, errors);
  for (Reconstruction* pass : {&predictions.t1.reconstruction, &predictions.t2.reconstruction,
                               &predictions.joint.reconstruction}) {
    if (!options.photos) std::ranges::fill(pass->color, kGrey);
    if (options.find_sky) remove_sky(*pass);
  }
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
  outcome.changed_share = changed_share(truth);
  outcome.true_centers_t1 = centers_of(true_poses.t1);
  outcome.true_centers_t2 = centers_of(true_poses.t2);
  outcome.best_fit_ate =
      errors_of(problem, best_t2_from_t1(truth, problem.before, problem.after), true_poses)
          .ate_mean;
  outcome.methods = run_methods(problem, true_poses, options.rivals, kept, progress);
  if (options.ablation) {
    ProgressStage stage(progress, "keyframe ablation");
    outcome.ablation = run_synthetic_ablation(scene, truth, errors, options, problem, true_poses);
  }
  for (const char* alignment : {"paper", "robust"}) {
    const MethodOutcome* method = find_outcome(outcome, alignment);
    if (method == nullptr) continue;
    ProgressStage stage(progress, fmt::format("change, alignment {}", alignment));
    ChangeBenchmark change =
        benchmark_changes({scene, truth, problem.before, problem.after},
                          method->found.surface_t2_from_t1, alignment, progress);
    std::move(change.changes.begin(), change.changes.end(), std::back_inserter(outcome.changes));
    std::move(change.instances.begin(), change.instances.end(),
              std::back_inserter(outcome.instances));
  }
  return outcome;
}

SceneOutcome run_wat_scene(const std::string& name, const std::filesystem::path& data,
                           const std::filesystem::path& predictions,
                           const BenchmarkOptions& options, const std::filesystem::path& kept,
                           ProgressSink& progress) {
  const std::filesystem::path files = predictions / name;
  Reconstruction before = read_reconstruction(files / "t1.npz", progress);
  Reconstruction after = read_reconstruction(files / "t2.npz", progress);
  JointReconstruction joint = read_joint(files / "joint.npz", before, after, progress);
  for (Reconstruction* pass : {&before, &after, &joint.reconstruction}) {
    if (options.find_sky) remove_sky(*pass);
  }
  const RegistrationProblem problem{before, after, joint};
  const BitemporalTrajectory truth = read_wat_truth(data / name, before, after);
  SceneOutcome outcome;
  outcome.scene = name;
  outcome.true_centers_t1 = centers_of(truth.t1);
  outcome.true_centers_t2 = centers_of(truth.t2);
  outcome.scale = 0;  // not known
  outcome.methods = run_methods(problem, truth, options.rivals, kept, progress);
  if (options.ablation)
    outcome.ablation = run_wat_ablation(files, options, problem, truth, progress);
  return outcome;
}

}  // namespace vggtcd
