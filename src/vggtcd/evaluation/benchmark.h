// SPDX-License-Identifier: Apache-2.0
// The benchmark: methods against scenes with known truth, every scene resumable.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "vggtcd/core/options.h"
#include "vggtcd/core/progress.h"
#include "vggtcd/evaluation/change_metrics.h"
#include "vggtcd/evaluation/synthetic/predict.h"
#include "vggtcd/evaluation/synthetic/render.h"
#include "vggtcd/evaluation/trajectory_metrics.h"

namespace vggtcd {

struct BenchmarkOptions {
  std::string scenes = "all";
  int seeds = 1;
  uint64_t first_seed = 1;
  int frames = 24;
  int width = 160;
  int keyframes = 5;
  bool rivals = true;
  bool ablation = true;

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("scenes", self.scenes, "comma-separated names, or all");
    field("seeds", self.seeds, "synthetic: this many variants of each scene, at least 1");
    field("first_seed", self.first_seed, "synthetic: the first variant");
    field("frames", self.frames, "synthetic: frames per epoch; 0: each scene's own number");
    field("width", self.width, "synthetic: width of the depth maps in px");
    field("keyframes", self.keyframes, "synthetic: keyframes per epoch in the joint pass");
    field("rivals", self.rivals, "also run FGR, RANSAC+ICP and Scale+ICP");
    field("ablation", self.ablation, "synthetic: also vary the number of keyframes");
  };
  void validate() const;
};

struct MethodOutcome {
  std::string method;   // registration_methods() name
  std::string failure;  // why there are no numbers; empty: there are
  TrajectoryErrors errors;
  double seconds = 0;
  Sim3 t2_from_t1;
  // Camera centres in the truth's frame after the one alignment of the protocol, for plots.
  std::vector<Eigen::Vector3d> centers_t1, centers_t2;
};

struct AblationOutcome {
  int keyframes = 0;  // 0: all frames
  double coarse_ate = 0, full_ate = 0;
  std::string verdict;  // of the fine stage
};

// Change detection with the paper's alignment and distance. `unseen_counted`: pixels that the other
// epoch never saw are evaluated too. `every_pixel`: pixels without evidence (low confidence) count
// as called unchanged; else they are left out.
struct ChangeOutcome {
  std::string method;
  bool unseen_counted = false, every_pixel = false;
  ChangeScores scores;
  double unseen_called_changed =
      0;  // share of unchanged, never-seen pixels that are called changed
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
  std::vector<Eigen::Vector3d> true_centers_t1, true_centers_t2;
};

// One scene: renders, predicts, registers, measures. Deterministic but for the seconds (and for
// rivals, see docs/benchmark.md).
SceneOutcome run_synthetic_scene(const std::string& scene, uint64_t seed,
                                 const BenchmarkOptions& options, ProgressSink& progress);

// One scene from files (protocol of the paper's WAT benchmark, docs/benchmark.md): the true poses
// from data/SCENE/sparse/0, predictions from predictions/SCENE/{t1,t2,joint}.npz.
SceneOutcome run_wat_scene(const std::string& scene, const std::filesystem::path& data,
                           const std::filesystem::path& predictions,
                           const BenchmarkOptions& options, ProgressSink& progress);

// All scenes; finished ones are kept in out/scenes/*.json and not computed again when the options
// are the same. Writes the report (benchmark_report.h).
std::vector<SceneOutcome> run_synthetic_suite(const std::filesystem::path& out,
                                              const BenchmarkOptions& options,
                                              ProgressSink& progress);
std::vector<SceneOutcome> run_wat_suite(const std::filesystem::path& out,
                                        const std::filesystem::path& data,
                                        const std::filesystem::path& predictions,
                                        const BenchmarkOptions& options, ProgressSink& progress);

}  // namespace vggtcd
