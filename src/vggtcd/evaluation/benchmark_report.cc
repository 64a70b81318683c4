// SPDX-License-Identifier: Apache-2.0
// Tables of registration; change is in change_tables.cc, plots in benchmark_plots.cc.
#include "vggtcd/evaluation/benchmark_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "vggtcd/core/version.h"
#include "vggtcd/evaluation/benchmark_json.h"
#include "vggtcd/evaluation/benchmark_summary.h"
#include "vggtcd/evaluation/change_tables.h"
#include "vggtcd/evaluation/paper_numbers.h"
#include "vggtcd/evaluation/registration_methods.h"
#include "vggtcd/evaluation/verdict_table.h"
#include "vggtcd/io/output_directory.h"
#include "vggtcd/io/output_file.h"

namespace vggtcd {
namespace {

// The methods that any scene has a row for, with or without numbers.
std::vector<RegistrationMethod> listed_methods(const std::vector<SceneOutcome>& scenes) {
  std::vector<RegistrationMethod> listed;
  for (RegistrationMethod& method : registration_methods()) {
    const bool any = std::any_of(scenes.begin(), scenes.end(), [&](const SceneOutcome& scene) {
      return std::any_of(scene.methods.begin(), scene.methods.end(),
                         [&](const MethodOutcome& m) { return m.method == method.name; });
    });
    if (any) listed.push_back(std::move(method));
  }
  return listed;
}

std::string cell(const SceneOutcome& scene, const RegistrationMethod& method,
                 double (*value)(const MethodOutcome&), int digits, bool mark_best) {
  if (!method.run) return " not yet |";
  const MethodOutcome* outcome = find_outcome(scene, method.name);
  if (outcome == nullptr) return " failed |";
  const std::string number = fmt::format("{:.{}f}", value(*outcome), digits);
  const bool best = mark_best && outcome->errors.ate_mean <= best_ate(scene);
  return best ? fmt::format(" **{}** |", number) : fmt::format(" {} |", number);
}

std::string table(const SuiteReport& report, const std::string& heading, int digits,
                  double (*value)(const MethodOutcome&), bool is_ate = false) {
  const std::vector<RegistrationMethod> methods = listed_methods(report.scenes);
  const bool floor = is_ate && report.suite == "synthetic";
  std::string head = "| Scene |", rule = "|---|", last = "| **mean** |";
  for (const RegistrationMethod& method : methods) {
    head += " " + method.title + " |";
    rule += "---|";
    double sum = 0;
    size_t count = 0;
    for (const SceneOutcome& scene : report.scenes) {
      const MethodOutcome* outcome = find_outcome(scene, method.name);
      if (outcome == nullptr) continue;
      sum += value(*outcome);
      ++count;
    }
    // A mean over some of the scenes would not compare with the others.
    last += count == report.scenes.size()
                ? fmt::format(" {:.{}f} |", sum / static_cast<double>(count), digits)
                : std::string(" |");
  }
  double floor_sum = 0;
  std::string rows;
  for (const SceneOutcome& scene : report.scenes) {
    rows += "| " + scene_title(scene) + " |";
    for (const RegistrationMethod& method : methods) {
      rows += cell(scene, method, value, digits, is_ate);
    }
    if (floor) rows += fmt::format(" *{:.{}f}* |", scene.best_fit_ate, digits);
    floor_sum += scene.best_fit_ate;
    rows += "\n";
  }
  if (floor) {
    head += " *best Sim(3)* |";
    rule += "---|";
    last +=
        fmt::format(" *{:.{}f}* |", floor_sum / static_cast<double>(report.scenes.size()), digits);
  }
  return fmt::format("\n### {}\n\n{}\n{}\n{}{}\n", heading, head, rule, rows, last);
}

std::string summary_table(const SuiteReport& report) {
  const bool floor = report.suite == "synthetic";
  std::string out = fmt::format(
      "\n### Over all {} scenes\n\n| Method | mean ATE | of coarse | worse than coarse | worst, of "
      "coarse | first |{} mean seconds |\n|---|---|---|---|---|---|{}---|\n",
      report.scenes.size(), floor ? " beats paper | beats robust |" : "", floor ? "---|---|" : "");
  for (const RegistrationMethod& method : registration_methods()) {
    for (const MethodSummary& s : summarise_methods(report.scenes)) {
      if (s.method != method.name) continue;
      const std::string ate = std::isnan(s.ate_mean) ? fmt::format("(no answer in {})", s.without)
                                                     : fmt::format("{:.4f}", s.ate_mean);
      out += fmt::format("| {} | {} | {:.3f} | {} | {:.3f} | {} |", method.title, ate,
                         s.ate_to_coarse, s.worse_than_coarse, s.worst_to_coarse, s.first);
      if (floor) out += fmt::format(" {} | {} |", s.beats_paper, s.beats_robust);
      out += fmt::format(" {:.2f} |\n", s.seconds_mean);
    }
  }
  if (floor) {
    double sum = 0;
    for (const SceneOutcome& scene : report.scenes) sum += scene.best_fit_ate;
    out += fmt::format("| *best Sim(3) for these passes* | {:.4f} | | | | | | | |\n",
                       sum / static_cast<double>(report.scenes.size()));
  }
  out += "\n'first': scenes with the smallest ATE of all, equal ones count for both.";
  if (floor) {
    out +=
        " 'beats paper', 'beats robust': scenes where the method has the smaller ATE though that "
        "is more than 10 % above what the best Sim(3) leaves.";
  }
  return out + "\n";
}

std::string budget_name(int keyframes) {
  return keyframes == 0 ? "all" : std::to_string(keyframes);
}

std::string ablation_section(const SuiteReport& report) {
  std::map<int, std::vector<const AblationOutcome*>> by_keyframes;
  for (const SceneOutcome& scene : report.scenes) {
    for (const AblationOutcome& outcome : scene.ablation) {
      by_keyframes[outcome.keyframes].push_back(&outcome);
    }
  }
  if (by_keyframes.empty()) return "";
  std::string out =
      "\n## Number of keyframes\n\nMean ATE over the scenes that have more frames than K; 'worse' "
      "counts scenes where the fine stage raised the ATE.\n\n| K | scenes | coarse | full | change "
      "| worse |\n|---|---|---|---|---|---|\n";
  for (const int keyframes : kAblationKeyframes) {
    const auto& outcomes = by_keyframes[keyframes];
    if (outcomes.empty()) continue;
    double coarse = 0, full = 0;
    int worse = 0;
    for (const AblationOutcome* outcome : outcomes) {
      coarse += outcome->coarse_ate;
      full += outcome->full_ate;
      worse += outcome->full_ate > outcome->coarse_ate * (1 + 1e-9) ? 1 : 0;
    }
    const double count = static_cast<double>(outcomes.size());
    out += fmt::format("| {} | {} | {:.4f} | {:.4f} | {:+.1f} % | {} |\n", budget_name(keyframes),
                       outcomes.size(), coarse / count, full / count, 100 * (full / coarse - 1),
                       worse);
  }
  const MonotonicityCount count = count_violations(report.scenes);
  return out + fmt::format(
                   "\nThe paper claims that the fine stage never makes ATE worse than coarse. Here "
                   "it did in {} of {} cases; in the worst one by a factor of {:.3f}. (The stage "
                   "checks its own residual, which is another thing: docs/numerics.md.)\n",
                   count.violations, count.cases, count.worst_ratio);
}

std::string paper_tables(const SuiteReport& report) {
  std::string head = "| Method |", rule = "|---|";
  std::vector<std::string> scenes;
  for (const SceneOutcome& scene : report.scenes) {
    if (paper_row(scene.scene, "paper")) scenes.push_back(scene.scene);
  }
  if (scenes.empty()) {
    for (const std::string_view name : wat_scene_names()) scenes.emplace_back(name);
  }
  for (const std::string& scene : scenes) {
    head += " " + scene + " |";
    rule += "---|";
  }
  std::string out =
      "\n## The paper's printed numbers (theirs: their photos, network, hardware)\n\n### ATE, "
      "metres\n\n" +
      head + "\n" + rule + "\n";
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
  out +=
      "\n### Number of keyframes, ATE in millimetres, coarse / full (paper's)\n\n| K | car | mac | "
      "grill | living_room |\n|---|---|---|---|---|\n";
  for (const int keyframes : kAblationKeyframes) {
    out += "| " + budget_name(keyframes) + " |";
    for (const char* scene : {"car", "mac", "grill", "living_room"}) {
      for (const PaperFineRow& row : paper_fine_rows()) {
        if (row.scene != scene || row.keyframes != keyframes) continue;
        out += fmt::format(" {:.1f} / {:.1f} |", row.coarse_mm, row.full_mm);
      }
    }
    out += "\n";
  }
  return out;
}

// Why there is no number, for methods and scenes that have none.
std::string failures(const SuiteReport& report) {
  std::string out;
  for (const RegistrationMethod& method : registration_methods()) {
    if (!method.run) {
      out += fmt::format("\n{}: {}.\n", method.title, method.absent_because);
      continue;
    }
    for (const SceneOutcome& scene : report.scenes) {
      for (const MethodOutcome& outcome : scene.methods) {
        if (outcome.method != method.name || outcome.failure.empty()) continue;
        out += fmt::format("\n{}, {}: {}\n", scene_title(scene), method.title, outcome.failure);
      }
    }
  }
  return out;
}

const OutputContents kReport{"benchmark",
                             {"benchmark.json", "benchmark.md", "benchmark.csv", "trajectories.svg",
                              "ablation.csv", "ablation.svg", "change.csv", "instances.csv"}};

}  // namespace

std::string report_markdown(const SuiteReport& report) {
  const bool synthetic = report.suite == "synthetic";
  std::string out = fmt::format("# Benchmark: {}\n\nvggt-cd {}; {} scenes", report.suite, kVersion,
                                report.scenes.size());
  if (synthetic) {
    out += fmt::format("; {} frames per epoch, {} px wide, {} keyframes per epoch",
                       report.options.frames == 0 ? "each scene's own number of"
                                                  : std::to_string(report.options.frames),
                       report.options.width, report.options.keyframes);
    if (report.options.change == SceneChange::kNone) out += "; nothing changes";
  }
  out += ". What is measured and how: docs/benchmark.md. Bold: smallest ATE of the scene.\n";
  out += "\n## Registration\n";
  out += summary_table(report);
  out += table(
      report, synthetic ? "ATE, mean, metres" : "ATE, mean, units of the true poses", 3,
      [](const MethodOutcome& m) { return m.errors.ate_mean; }, true);
  out += table(report, "RTE, mean", 3, [](const MethodOutcome& m) { return m.errors.rte_mean; });
  out += table(report, "RRE, mean, degrees", 3,
               [](const MethodOutcome& m) { return m.errors.rre_mean_deg; });
  out +=
      table(report, "Registration, seconds", 2, [](const MethodOutcome& m) { return m.seconds; });
  out += failures(report);
  out += verdict_section(report.scenes);
  out += ablation_section(report);
  out += change_section(report.scenes);
  out += instance_section(report.scenes);
  if (!synthetic) out += paper_tables(report);
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
      out += fmt::format("{},{},{},{},{},{}\n", scene.scene, scene.seed, budget_name(a.keyframes),
                         a.coarse_ate, a.full_ate, a.verdict);
    }
  }
  return out;
}

void claim_report(const std::filesystem::path& directory) {
  OutputDirectory::claim(directory, kReport);
}

void write_report(const std::filesystem::path& directory, const SuiteReport& report) {
  OutputDirectory out(directory, kReport);
  Json json{{"suite", report.suite},
            {"version", kVersion},
            {"options", options_to_json(report.options)},
            {"scenes", Json::array()}};
  for (const SceneOutcome& scene : report.scenes) json["scenes"].push_back(to_json(scene));
  write_json_file(out / "benchmark.json", json);
  write_text_file(out / "benchmark.md", report_markdown(report));
  write_text_file(out / "benchmark.csv", registration_csv(report));
  write_text_file(out / "trajectories.svg", trajectories_svg(report));
  const auto any = [&](auto member) {
    return std::any_of(report.scenes.begin(), report.scenes.end(),
                       [&](const SceneOutcome& scene) { return !(scene.*member).empty(); });
  };
  if (any(&SceneOutcome::ablation)) {
    write_text_file(out / "ablation.csv", ablation_csv(report));
    write_text_file(out / "ablation.svg", ablation_svg(report));
  }
  if (any(&SceneOutcome::changes)) {
    write_text_file(out / "change.csv", change_csv(report.scenes));
  }
  if (any(&SceneOutcome::instances)) {
    write_text_file(out / "instances.csv", instance_csv(report.scenes));
  }
  out.commit();
}

}  // namespace vggtcd
