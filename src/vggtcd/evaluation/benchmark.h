// SPDX-License-Identifier: Apache-2.0
// The benchmark: methods against scenes with known truth, every scene resumable.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "vggtcd/core/options.h"
#include "vggtcd/core/progress.h"
#include "vggtcd/evaluation/change_benchmark.h"
#include "vggtcd/evaluation/registration_methods.h"
#include "vggtcd/evaluation/synthetic/scene.h"
#include "vggtcd/evaluation/trajectory_metrics.h"
#include "vggtcd/geometry/sim3.h"

namespace vggtcd {

struct BenchmarkOptions {
  std::string scenes = "all";
  std::string seeds = "1";
  SceneChange change = SceneChange::kScene;
  int frames = 24;
  int width = 160;
  int keyframes = 5;
  SceneTexture texture = SceneTexture::kScene;
  bool photos = true;
  double error_size = 1;
  int outlier_keyframes = 0;
  bool find_sky = true;
  bool rivals = true;
  bool ablation = true;

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("scenes", self.scenes,
          "comma-separated names, or all: of the synthetic suite the eleven scenes");
    field("seeds", self.seeds, "synthetic: variants of each scene, e.g. 1,2,7 or 201-203");
    field("change", self.change,
          "synthetic: scene: what changes is the scene's own list; none: nothing changes but light "
          "and walk");
    field("frames", self.frames, "synthetic: frames per epoch; 0: each scene's own number");
    field("width", self.width, "synthetic: width of the depth maps in px");
    field("keyframes", self.keyframes, "keyframes per epoch in the joint pass");
    field(
        "texture", self.texture,
        "synthetic: scene: each surface its own; one: all surfaces the same; none: plain surfaces");
    field("photos", self.photos,
          "synthetic: the predictions hold photos; without them all is grey");
    field("error_size", self.error_size,
          "synthetic: the errors of the predictions are this many times as large");
    field("outlier_keyframes", self.outlier_keyframes,
          "synthetic: photos of the joint pass that go wrong for certain");
    field("find_sky", self.find_sky, "leave the sky out, as detect does (all methods)");
    field("rivals", self.rivals, "also run FGR, RANSAC+ICP and Scale+ICP");
    field("ablation", self.ablation, "also vary the number of keyframes");
  };
  void validate() const;
};

// The seeds that a list names: "1,2,7", "201-203". Throws Error{kUsage}.
std::vector<uint64_t> parse_seeds(const std::string& list);

// The budgets of the paper's table of the fine stage; 0 stands for all frames.
inline constexpr int kAblationKeyframes[] = {2, 3, 5, 7, 9, 15, 20, 50, 0};

struct MethodOutcome {
  std::string method;   // registration_methods() name
  std::string failure;  // why there are no numbers; empty: there are
  TrajectoryErrors errors;
  double seconds = 0;
  RegistrationAnswer found;
  std::string plausibility;  // plausibility_of
  // Camera centres in the truth's frame after the one alignment of the protocol, for plots.
  std::vector<Eigen::Vector3d> centers_t1, centers_t2;
};

struct AblationOutcome {
  int keyframes = 0;  // 0: all frames
  double coarse_ate = 0, full_ate = 0;
  std::string verdict;  // of the fine stage
};

struct SceneOutcome {
  std::string scene;
  uint64_t seed = 0;
  bool outdoor = false;
  double scale = 1;   // true T2 from T1; 0: not known
  double extent = 0;  // in units of the truth; 0: not known
  double changed_share = 0;
  double best_fit_ate = 0;  // with the best Sim(3) that the passes allow; 0: not known
  std::vector<MethodOutcome> methods;
  std::vector<AblationOutcome> ablation;
  std::vector<ChangeOutcome> changes;
  std::vector<InstanceOutcome> instances;
  std::vector<Eigen::Vector3d> true_centers_t1, true_centers_t2;
};

// One scene: renders, predicts, registers, measures. Deterministic but for the seconds (and for
// rivals, see docs/benchmark.md). Rivals' answers about the same points are taken from `kept`
// (kept_rivals.h) where they are there, and kept there; empty: computed always.
SceneOutcome run_synthetic_scene(const std::string& scene, uint64_t seed,
                                 const BenchmarkOptions& options, const std::filesystem::path& kept,
                                 ProgressSink& progress);

// One scene from files (protocol of the paper's WAT benchmark, docs/benchmark.md): the true poses
// from data/SCENE/sparse/0, predictions from predictions/SCENE/{t1,t2,joint}.npz; for the ablation
// joint_K.npz and joint_all.npz where they exist.
SceneOutcome run_wat_scene(const std::string& scene, const std::filesystem::path& data,
                           const std::filesystem::path& predictions,
                           const BenchmarkOptions& options, const std::filesystem::path& kept,
                           ProgressSink& progress);

// All scenes; finished ones are kept in out/scenes/*.json and not computed again when the options
// are the same. Writes the report (benchmark_report.h), anew after every scene.
std::vector<SceneOutcome> run_synthetic_suite(const std::filesystem::path& out,
                                              const BenchmarkOptions& options,
                                              ProgressSink& progress);

// Where a WAT suite finds predictions. `predict`, if any, is called for every scene that is not
// finished, before its files are read, to make those that are missing; `made_by` says by what.
struct WatPredictions {
  std::filesystem::path directory;
  std::string made_by;
  std::function<void(const std::string& scene)> predict;
};
std::vector<SceneOutcome> run_wat_suite(const std::filesystem::path& out,
                                        const std::filesystem::path& data,
                                        const WatPredictions& predictions,
                                        const BenchmarkOptions& options, ProgressSink& progress);

}  // namespace vggtcd
