// SPDX-License-Identifier: Apache-2.0
// Tables of the benchmark; plots are in benchmark_plots.cc.
#include "vggtcd/evaluation/benchmark_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "vggtcd/core/version.h"
#include "vggtcd/evaluation/benchmark_json.h"
#include "vggtcd/evaluation/paper_numbers.h"
#include "vggtcd/evaluation/registration_methods.h"
#include "vggtcd/io/output_file.h"

namespace vggtcd {
namespace {

const MethodOutcome* find(const SceneOutcome& scene, const std::string& method) {
  for (const MethodOutcome& outcome : scene.methods) {
    if (outcome.method == method) return &outcome;
  }
  return nullptr;
}

// The smallest ATE of a scene.
double best_ate(const SceneOutcome& scene) {
  double best = 1e300;
  for (const MethodOutcome& outcome : scene.methods) {
    if (outcome.failure.empty()) best = std::min(best, outcome.errors.ate_mean);
  }
  return best;
}

std::string scene_title(const SceneOutcome& scene) {
  return scene.seed == 0 ? scene.scene : fmt::format("{} #{}", scene.scene, scene.seed);
}

using Cell = std::string (*)(const MethodOutcome&, bool best);

std::string table(const SuiteReport& report, const std::string& heading, Cell cell,
                  double (*value)(const MethodOutcome&)) {
  std::string out = "\n### " + heading + "\n\n| Method |";
  for (const SceneOutcome& scene : report.scenes) out += " " + scene_title(scene) + " |";
  out += " mean |\n|---|";
  for (size_t k = 0; k <= report.scenes.size(); ++k) out += "---|";
  out += "\n";
  for (const RegistrationMethod& method : registration_methods()) {
    std::string row = "| " + method.title + " |";
    double sum = 0;
    size_t count = 0;
    std::string absent = method.absent_because;
    bool any = false;
    for (const SceneOutcome& scene : report.scenes) {
      const MethodOutcome* outcome = find(scene, method.name);
      if (outcome == nullptr) {
        row += " |";
        continue;
      }
      any = true;
      if (!outcome->failure.empty()) {
        row += outcome->failure == absent ? " not yet |" : " failed |";
        continue;
      }
      row += " " + cell(*outcome, outcome->errors.ate_mean <= best_ate(scene)) + " |";
      sum += value(*outcome);
      ++count;
    }
    if (!any) continue;
    // A mean over some of the scenes would not compare with the others.
    row += count == report.scenes.size()
               ? fmt::format(" {:.3f} |\n", sum / static_cast<double>(count))
               : std::string(" |\n");
    out += row;
  }
  return out;
}

std::string floor_row(const SuiteReport& report) {
  std::string row = "| *best Sim(3) for these passes* |";
  double sum = 0;
  for (const SceneOutcome& scene : report.scenes) {
    row += fmt::format(" {:.3f} |", scene.best_fit_ate);
    sum += scene.best_fit_ate;
  }
  return row + fmt::format(" {:.3f} |\n", sum / static_cast<double>(report.scenes.size()));
}

std::string wins_line(const SuiteReport& report) {
  std::map<std::string, int> wins;
  for (const SceneOutcome& scene : report.scenes) {
    for (const MethodOutcome& outcome : scene.methods) {
      if (outcome.failure.empty() && outcome.errors.ate_mean <= best_ate(scene)) {
        ++wins[outcome.method];
      }
    }
  }
  std::string line = "\nFirst in ATE: ";
  for (const RegistrationMethod& method : registration_methods()) {
    if (wins.contains(method.name)) line += fmt::format("{} {}, ", method.title, wins[method.name]);
  }
  return line + fmt::format("of {} scenes (equal ones count for both).\n", report.scenes.size());
}

std::string paper_table(const SuiteReport& report) {
  std::string out =
      "\n### The paper's printed numbers (theirs: their photos, network, hardware), ATE in "
      "metres\n\n"
      "| Method |";
  std::vector<std::string> scenes;
  for (const SceneOutcome& scene : report.scenes) {
    if (paper_row(scene.scene, "paper")) scenes.push_back(scene.scene);
  }
  if (scenes.empty()) {
    for (const std::string_view name : wat_scene_names()) scenes.emplace_back(name);
  }
  for (const std::string& scene : scenes) out += " " + scene + " |";
  out += "\n|---|";
  for (size_t k = 0; k < scenes.size(); ++k) out += "---|";
  out += "\n";
  for (const RegistrationMethod& method : registration_methods()) {
    std::string row = "| " + method.title + " (paper's) |";
    bool any = false;
    for (const std::string& scene : scenes) {
      const auto printed = paper_row(scene, method.name);
      any = any || printed;
      row += printed ? fmt::format(" {:.3f} |", printed->ate_m) : std::string(" |");
    }
    if (any) out += row + "\n";
  }
  return out;
}

std::string ablation_table(const SuiteReport& report) {
  std::map<int, std::vector<const AblationOutcome*>> by_keyframes;
  for (const SceneOutcome& scene : report.scenes) {
    for (const AblationOutcome& outcome : scene.ablation) {
      by_keyframes[outcome.keyframes == 0 ? 1 << 20 : outcome.keyframes].push_back(&outcome);
    }
  }
  if (by_keyframes.empty()) return "";
  std::string out =
      "\n## Number of keyframes\n\nMean ATE over the scenes that have more frames than K; 'worse' "
      "counts scenes where the fine stage raised the ATE.\n\n| K | scenes | coarse | full | change "
      "| "
      "worse |\n|---|---|---|---|---|---|\n";
  for (const auto& [keyframes, outcomes] : by_keyframes) {
    double coarse = 0, full = 0;
    int worse = 0;
    for (const AblationOutcome* outcome : outcomes) {
      coarse += outcome->coarse_ate;
      full += outcome->full_ate;
      worse += outcome->full_ate > outcome->coarse_ate * (1 + 1e-9) ? 1 : 0;
    }
    const double count = static_cast<double>(outcomes.size());
    out += fmt::format("| {} | {} | {:.4f} | {:.4f} | {:+.1f} % | {} |\n",
                       keyframes == 1 << 20 ? "all" : std::to_string(keyframes), outcomes.size(),
                       coarse / count, full / count, 100 * (full / coarse - 1), worse);
  }
  const MonotonicityCount count = count_violations(report.scenes);
  out += fmt::format(
      "\nThe paper claims that the fine stage never makes ATE worse than coarse. Here it did in {} "
      "of "
      "{} cases; in the worst one by a factor of {:.3f}. (The stage checks its own residual, which "
      "is another thing: docs/numerics.md.)\n",
      count.violations, count.cases, count.worst_ratio);
  return out;
}

std::string change_table(const SuiteReport& report) {
  std::string out;
  for (const bool every_pixel : {false, true}) {
    for (const bool unseen : {false, true}) {
      std::string rows;
      ChangeScores sum;
      double unseen_called = 0;
      int count = 0;
      for (const SceneOutcome& scene : report.scenes) {
        for (const ChangeOutcome& c : scene.changes) {
          if (c.every_pixel != every_pixel || c.unseen_counted != unseen) continue;
          rows += fmt::format(
              "| {} | {:.1f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.1f} |\n",
              scene_title(scene), 100 * scene.changed_share, c.scores.precision, c.scores.recall,
              c.scores.f1, c.scores.auprc, c.scores.best_f1, 100 * c.unseen_called_changed);
          sum.precision += c.scores.precision;
          sum.recall += c.scores.recall;
          sum.f1 += c.scores.f1;
          sum.auprc += c.scores.auprc;
          sum.best_f1 += c.scores.best_f1;
          unseen_called += c.unseen_called_changed;
          ++count;
        }
      }
      if (count == 0) continue;
      out += fmt::format(
          "\n### {}, {}\n\n| Scene | changed % | precision | recall | F1 | AUPRC | best F1 | "
          "never-seen "
          "called changed % |\n|---|---|---|---|---|---|---|---|\n{}",
          unseen ? "Never-seen surface counted" : "Only surface that both epochs saw",
          every_pixel ? "every pixel (without evidence: called unchanged)" : "pixels with evidence",
          rows);
      out += fmt::format("| **mean** | | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.1f} |\n",
                         sum.precision / count, sum.recall / count, sum.f1 / count,
                         sum.auprc / count, sum.best_f1 / count, 100 * unseen_called / count);
    }
  }
  return out.empty() ? out
                     : "\n## Change\n\nNearest-neighbour distance (the paper's), alignment by the "
                       "paper's method. 'best F1' is the threshold tuned on the answer.\n" +
                           out;
}

}  // namespace

MonotonicityCount count_violations(const std::vector<SceneOutcome>& scenes) {
  MonotonicityCount count;
  for (const SceneOutcome& scene : scenes) {
    for (const AblationOutcome& outcome : scene.ablation) {
      ++count.cases;
      const double ratio = outcome.full_ate / outcome.coarse_ate;
      if (ratio > 1 + 1e-9) ++count.violations;
      count.worst_ratio = std::max(count.worst_ratio, ratio);
    }
  }
  return count;
}

std::string report_markdown(const SuiteReport& report) {
  const bool synthetic = report.suite == "synthetic";
  std::string out = fmt::format("# Benchmark: {}\n\nvggt-cd {}; {} scenes", report.suite, kVersion,
                                report.scenes.size());
  if (synthetic) {
    out += fmt::format("; {} frames per epoch, {} px wide, {} keyframes per epoch",
                       report.options.frames == 0 ? "each scene's own number of"
                                                  : std::to_string(report.options.frames),
                       report.options.width, report.options.keyframes);
  }
  out += ". What is measured and how: docs/benchmark.md. Bold: smallest ATE of the scene.\n";
  out += "\n## Registration\n";
  out += table(
      report, synthetic ? "ATE, mean, metres" : "ATE, mean, units of the true poses",
      [](const MethodOutcome& m, bool best) {
        const std::string number = fmt::format("{:.3f}", m.errors.ate_mean);
        return best ? "**" + number + "**" : number;
      },
      [](const MethodOutcome& m) { return m.errors.ate_mean; });
  if (synthetic) out += floor_row(report);
  out += wins_line(report);
  out += table(
      report, "RTE, mean",
      [](const MethodOutcome& m, bool) { return fmt::format("{:.3f}", m.errors.rte_mean); },
      [](const MethodOutcome& m) { return m.errors.rte_mean; });
  out += table(
      report, "RRE, mean, degrees",
      [](const MethodOutcome& m, bool) { return fmt::format("{:.3f}", m.errors.rre_mean_deg); },
      [](const MethodOutcome& m) { return m.errors.rre_mean_deg; });
  out += table(
      report, "Registration, seconds",
      [](const MethodOutcome& m, bool) { return fmt::format("{:.2f}", m.seconds); },
      [](const MethodOutcome& m) { return m.seconds; });
  for (const RegistrationMethod& method : registration_methods()) {
    if (!method.run) out += fmt::format("\n{}: {}.\n", method.title, method.absent_because);
  }
  for (const SceneOutcome& scene : report.scenes) {
    for (const MethodOutcome& outcome : scene.methods) {
      if (outcome.failure.empty() || outcome.failure == "not yet") continue;
      out += fmt::format("\n{}, {}: {}\n", scene_title(scene), outcome.method, outcome.failure);
    }
  }
  out += ablation_table(report);
  out += change_table(report);
  if (!synthetic) out += paper_table(report);
  return out;
}

std::string registration_csv(const SuiteReport& report) {
  std::string out =
      "scene,seed,outdoor,scale,extent,method,ate_mean,ate_rmse,ate_median,ate_relative,rte_mean,"
      "rre_mean_deg,seconds,best_fit_ate,failure\n";
  for (const SceneOutcome& scene : report.scenes) {
    for (const MethodOutcome& m : scene.methods) {
      const std::string start =
          fmt::format("{},{},{},{},{},{},", scene.scene, scene.seed, scene.outdoor ? 1 : 0,
                      scene.scale, scene.extent, m.method);
      const TrajectoryErrors& e = m.errors;
      out += m.failure.empty()
                 ? start + fmt::format("{},{},{},{},{},{},{},{},\n", e.ate_mean, e.ate_rmse,
                                       e.ate_median, e.ate_relative, e.rte_mean, e.rre_mean_deg,
                                       m.seconds, scene.best_fit_ate)
                 : start + fmt::format(",,,,,,,{},\"{}\"\n", scene.best_fit_ate, m.failure);
    }
  }
  return out;
}

std::string ablation_csv(const SuiteReport& report) {
  std::string out = "scene,seed,keyframes,coarse_ate,full_ate,verdict\n";
  for (const SceneOutcome& scene : report.scenes) {
    for (const AblationOutcome& a : scene.ablation) {
      out += fmt::format("{},{},{},{},{},{}\n", scene.scene, scene.seed,
                         a.keyframes == 0 ? "all" : std::to_string(a.keyframes), a.coarse_ate,
                         a.full_ate, a.verdict);
    }
  }
  return out;
}

std::string change_csv(const SuiteReport& report) {
  std::string out =
      "scene,seed,method,unseen_counted,every_pixel,pixels,changed_pixels,precision,recall,f1,"
      "auprc,"
      "best_f1,unseen_called_changed\n";
  for (const SceneOutcome& scene : report.scenes) {
    for (const ChangeOutcome& c : scene.changes) {
      const ChangeScores& s = c.scores;
      out +=
          fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}\n", scene.scene, scene.seed, c.method,
                      c.unseen_counted ? 1 : 0, c.every_pixel ? 1 : 0, s.pixels, s.changed_pixels,
                      s.precision, s.recall, s.f1, s.auprc, s.best_f1, c.unseen_called_changed);
    }
  }
  return out;
}

void write_report(const std::filesystem::path& directory, const SuiteReport& report) {
  Json json{{"suite", report.suite},
            {"version", kVersion},
            {"options", options_to_json(report.options)},
            {"scenes", Json::array()}};
  for (const SceneOutcome& scene : report.scenes) json["scenes"].push_back(to_json(scene));
  write_json_file(directory / "benchmark.json", json);
  write_text_file(directory / "benchmark.md", report_markdown(report));
  write_text_file(directory / "benchmark.csv", registration_csv(report));
  write_text_file(directory / "trajectories.svg", trajectories_svg(report));
  const bool has_ablation = std::any_of(report.scenes.begin(), report.scenes.end(),
                                        [](const auto& scene) { return !scene.ablation.empty(); });
  if (has_ablation) {
    write_text_file(directory / "ablation.csv", ablation_csv(report));
    write_text_file(directory / "ablation.svg", ablation_svg(report));
  }
  const bool has_change = std::any_of(report.scenes.begin(), report.scenes.end(),
                                      [](const auto& scene) { return !scene.changes.empty(); });
  if (has_change) write_text_file(directory / "change.csv", change_csv(report));
}

}  // namespace vggtcd
