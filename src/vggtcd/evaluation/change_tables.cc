// SPDX-License-Identifier: Apache-2.0
// Means of the four ways of counting; scene by scene for the first of them.
#include "vggtcd/evaluation/change_tables.h"

#include <fmt/format.h>

#include <algorithm>

#include "vggtcd/evaluation/benchmark_summary.h"

namespace vggtcd {
namespace {

std::string row_name(const std::string& method, const std::string& alignment) {
  return fmt::format("{}, alignment {}", method, alignment);
}

std::string means(const std::vector<ChangeSummary>& summaries, bool unseen, bool every_pixel) {
  std::string out = fmt::format(
      "\n### {}, {}\n\n| Method | evidence % | precision | recall | F1 | AUPRC | best F1 | false "
      "alarms % | never-seen called changed % | sky called changed % |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n",
      unseen ? "Never-seen surface counted" : "Only surface that both epochs saw",
      every_pixel ? "every pixel (without evidence: called unchanged)" : "pixels with evidence");
  for (const ChangeSummary& s : summaries) {
    if (s.unseen_counted != unseen || s.every_pixel != every_pixel) continue;
    out += fmt::format("| {} | {:.0f} |", row_name(s.method, s.alignment), 100 * s.evidence);
    if (s.changed_scenes > 0) {
      out += fmt::format(" {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} |", s.precision, s.recall,
                         s.f1, s.auprc, s.best_f1);
    } else {
      out += " | | | | |";  // nothing changed: only false alarms can be counted
    }
    out += fmt::format(" {:.2f} | {:.2f} | {:.1f} |\n", 100 * s.false_alarms,
                       100 * s.unseen_called_changed, 100 * s.sky_called_changed);
  }
  return out;
}

// F1, AUPRC and never-seen of every row, a scene per line.
std::string by_scene(const std::vector<SceneOutcome>& scenes,
                     const std::vector<ChangeSummary>& summaries) {
  std::vector<const ChangeSummary*> columns;
  for (const ChangeSummary& s : summaries) {
    if (!s.unseen_counted && !s.every_pixel) columns.push_back(&s);
  }
  std::string out =
      "\n### By scene: only surface that both epochs saw, pixels with evidence\n\nEach cell: F1 / "
      "AUPRC / never-seen called changed in percent.\n\n| Scene | changed % |";
  for (const ChangeSummary* s : columns) out += " " + row_name(s->method, s->alignment) + " |";
  out += "\n|---|---|";
  for (size_t k = 0; k < columns.size(); ++k) out += "---|";
  out += "\n";
  for (const SceneOutcome& scene : scenes) {
    out += fmt::format("| {} | {:.1f} |", scene_title(scene), 100 * scene.changed_share);
    for (const ChangeSummary* s : columns) {
      const ChangeOutcome* found = find_change(scene, s->method, s->alignment);
      out += found == nullptr
                 ? " |"
                 : fmt::format(" {:.3f} / {:.3f} / {:.1f} |", found->scores.f1, found->scores.auprc,
                               100 * found->unseen_called_changed);
    }
    out += "\n";
  }
  return out;
}

}  // namespace

std::string scene_title(const SceneOutcome& scene) {
  return scene.seed == 0 ? scene.scene : fmt::format("{} #{}", scene.scene, scene.seed);
}

std::string change_section(const std::vector<SceneOutcome>& scenes) {
  const std::vector<ChangeSummary> summaries = summarise_changes(scenes);
  if (summaries.empty()) return "";
  std::string out = fmt::format(
      "\n## Change\n\n'distance' is the paper's nearest-neighbour distance with its threshold, "
      "'votes' free space (docs/benchmark.md). Means over {} scenes. 'best F1' is the threshold "
      "tuned on the answer.\n",
      scenes.size());
  for (const bool every_pixel : {false, true}) {
    for (const bool unseen : {false, true}) out += means(summaries, unseen, every_pixel);
  }
  return out + by_scene(scenes, summaries);
}

std::string instance_section(const std::vector<SceneOutcome>& scenes) {
  const std::vector<InstanceSummary> summaries = summarise_instances(scenes);
  if (summaries.empty()) return "";
  std::string out = fmt::format(
      "\n## Changed things\n\nOver all scenes. To be found: changed objects larger than {:.0f} % "
      "of the scene extent whose place the other epoch looked at; a moved one counts at both "
      "places. The rule: docs/benchmark.md.\n\n| Method | to be found | found | recall | told "
      "apart | reported | right | precision |\n|---|---|---|---|---|---|---|---|\n",
      100 * InstanceMatchRule::kMinSize);
  for (const auto& [method, alignment, total] : summaries) {
    out += fmt::format("| {} | {} | {} | {:.3f} | {} | {} | {} | {:.3f} |\n",
                       row_name(method, alignment), total.objects, total.found, total.recall(),
                       total.told_apart, total.reported, total.right, total.precision());
  }
  return out + fmt::format("\nLeft out: {} too small, {} hardly seen.\n",
                           summaries.front().total.small, summaries.front().total.hardly_seen);
}

std::string change_csv(const std::vector<SceneOutcome>& scenes) {
  std::string out =
      "scene,seed,method,alignment,unseen_counted,every_pixel,pixels,changed_pixels,precision,"
      "recall,f1,auprc,best_f1,false_alarms,unseen_called_changed,sky_called_changed,evidence\n";
  for (const SceneOutcome& scene : scenes) {
    for (const ChangeOutcome& c : scene.changes) {
      const ChangeScores& s = c.scores;
      out += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", scene.scene,
                         scene.seed, c.method, c.alignment, c.unseen_counted ? 1 : 0,
                         c.every_pixel ? 1 : 0, s.pixels, s.changed_pixels, s.precision, s.recall,
                         s.f1, s.auprc, s.best_f1, s.false_alarms, c.unseen_called_changed,
                         c.sky_called_changed, c.evidence);
    }
  }
  return out;
}

std::string instance_csv(const std::vector<SceneOutcome>& scenes) {
  std::string out =
      "scene,seed,method,alignment,objects,found,told_apart,small,hardly_seen,reported,right\n";
  for (const SceneOutcome& scene : scenes) {
    for (const auto& [method, alignment, s] : scene.instances) {
      out += fmt::format("{},{},{},{},{},{},{},{},{},{},{}\n", scene.scene, scene.seed, method,
                         alignment, s.objects, s.found, s.told_apart, s.small, s.hardly_seen,
                         s.reported, s.right);
    }
  }
  return out;
}

}  // namespace vggtcd
