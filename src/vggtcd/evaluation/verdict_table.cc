// SPDX-License-Identifier: Apache-2.0
// The table of verdicts against the truth.
#include "vggtcd/evaluation/verdict_table.h"

#include <fmt/format.h>

#include "vggtcd/evaluation/benchmark_summary.h"
#include "vggtcd/evaluation/change_tables.h"

namespace vggtcd {
namespace {

constexpr double kFarFromFloor = 2;       // times the ATE of the best Sim(3)
constexpr double kManyFalseAlarms = 0.1;  // of the unchanged pixels

}  // namespace

std::string verdict_section(const std::vector<SceneOutcome>& scenes) {
  std::string rows;
  int believable = 0, judged = 0, far = 0, alarming = 0;
  for (const SceneOutcome& scene : scenes) {
    const MethodOutcome* robust = find_outcome(scene, "robust");
    const MethodOutcome* coarse = find_outcome(scene, "coarse");
    if (robust == nullptr || coarse == nullptr || !(scene.best_fit_ate > 0)) continue;
    const double of_floor = robust->errors.ate_mean / scene.best_fit_ate;
    const double of_coarse = robust->errors.ate_mean / coarse->errors.ate_mean;
    const ChangeOutcome* change = find_change(scene, "votes", "robust");
    const double false_alarms = change == nullptr ? 0 : change->scores.false_alarms;
    ++judged;
    if (robust->plausibility == "believable") {
      ++believable;
      far += of_floor > kFarFromFloor ? 1 : 0;
      alarming += false_alarms > kManyFalseAlarms ? 1 : 0;
    }
    rows += fmt::format("| {} | {} | {} | {:.2f} | {:.2f} | {:.2f} |\n", scene_title(scene),
                        robust->found.verdict, robust->plausibility, of_floor, of_coarse,
                        100 * false_alarms);
  }
  if (judged == 0) return "";
  return fmt::format(
             "\n## Verdicts of the robust method\n\n{} of {} alignments are called believable. Of "
             "these {} have an ATE above twice the floor (what the best Sim(3) leaves), and {} "
             "call more than a tenth of the unchanged pixels changed.\n\n"
             "| Scene | verdict | plausibility | ATE, of the floor | ATE, of coarse | false alarms "
             "% |\n|---|---|---|---|---|---|\n",
             believable, judged, far, alarming) +
         rows;
}

}  // namespace vggtcd
