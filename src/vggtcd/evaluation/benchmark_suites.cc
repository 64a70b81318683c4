// SPDX-License-Identifier: Apache-2.0
// Suites: a list of scenes, each kept when finished, and the report over all.
#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "vggtcd/core/error.h"
#include "vggtcd/core/version.h"
#include "vggtcd/evaluation/benchmark.h"
#include "vggtcd/evaluation/benchmark_json.h"
#include "vggtcd/evaluation/benchmark_report.h"
#include "vggtcd/evaluation/registration_methods.h"
#include "vggtcd/evaluation/synthetic/scene.h"
#include "vggtcd/evaluation/wat.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/io/output_directory.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> names(std::span<const std::string_view> list) {
  return {list.begin(), list.end()};
}

std::vector<std::string> chosen_scenes(const std::string& list,
                                       const std::vector<std::string>& available) {
  if (list == "all") return available;
  std::vector<std::string> chosen;
  size_t start = 0;
  while (start <= list.size()) {
    const size_t comma = std::min(list.find(',', start), list.size());
    const std::string name = list.substr(start, comma - start);
    if (std::find(available.begin(), available.end(), name) == available.end()) {
      std::string known;
      for (const std::string& each : available) known += (known.empty() ? "" : ", ") + each;
      throw_error(ErrorCode::kUsage, "scenes: expected some of {}, found '{}'", known, name);
    }
    chosen.push_back(name);
    start = comma + 1;
  }
  return chosen;
}

// What a kept result must agree with to be used again.
Json fingerprint(const BenchmarkOptions& options) {
  Json json = options_to_json(options);
  for (const char* irrelevant : {"scenes", "seeds"}) json.erase(irrelevant);
  json["version"] = kVersion;
  Json methods = Json::array();
  for (const RegistrationMethod& method : registration_methods()) {
    if (method.run) methods.push_back(method.name);
  }
  json["methods"] = methods;
  return json;
}

// Calls `run` unless the file has the outcome of the same options.
SceneOutcome resume_or_run(const fs::path& file, const Json& options,
                           const std::function<SceneOutcome()>& run, ProgressSink& progress) {
  if (exists_at(file)) {
    const auto not_usable = [&](std::string_view why) {
      progress.notice(fmt::format("{}: not usable, computed again ({})", file.string(), why));
    };
    try {
      const Json kept = read_json_file(file);
      if (kept.at("options") == options) {
        progress.notice(fmt::format("{}: finished before, kept", file.filename().string()));
        return scene_outcome_from_json(kept.at("outcome"));
      }
    } catch (const Json::exception& error) {
      not_usable(error.what());
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kInput) throw;
      not_usable(error.what());
    }
  }
  OutputDirectory kept(file.parent_path(), {kCacheKind, {file.filename().string()}, true, true});
  SceneOutcome outcome = run();
  write_json_file(kept / file.filename().string(),
                  Json{{"options", options}, {"outcome", to_json(outcome)}});
  kept.commit();
  return outcome;
}

}  // namespace

std::vector<SceneOutcome> run_synthetic_suite(const fs::path& out, const BenchmarkOptions& options,
                                              ProgressSink& progress) {
  options.validate();
  SuiteReport report{"synthetic", options, {}};
  const std::vector<std::string> scenes =
      options.scenes == "all" ? names(scene_names())
                              : chosen_scenes(options.scenes, names(all_scene_names()));
  claim_report(out);
  for (const std::string& scene : scenes) {
    for (const uint64_t seed : parse_seeds(options.seeds)) {
      const fs::path file = out / "scenes" / fmt::format("{}_{}.json", scene, seed);
      progress.notice(fmt::format("{} #{}", scene, seed));
      report.scenes.push_back(resume_or_run(
          file, fingerprint(options),
          [&] { return run_synthetic_scene(scene, seed, options, out / "rivals", progress); },
          progress));
      write_report(out, report);
    }
  }
  return std::move(report.scenes);
}

std::vector<SceneOutcome> run_wat_suite(const fs::path& out, const fs::path& data,
                                        const WatPredictions& predictions,
                                        const BenchmarkOptions& options, ProgressSink& progress) {
  options.validate();
  SuiteReport report{"wat", options, {}};
  const std::vector<std::string> scenes = chosen_scenes(options.scenes, list_wat_scenes(data));
  claim_report(out);
  Json key = fingerprint(options);
  key["data"] = absolute_path(data).lexically_normal().string();
  key["predictions"] = absolute_path(predictions.directory).lexically_normal().string();
  key["made_by"] = predictions.made_by;
  for (const std::string& scene : scenes) {
    progress.notice(scene);
    report.scenes.push_back(resume_or_run(
        out / "scenes" / (scene + ".json"), key,
        [&] {
          if (predictions.predict) predictions.predict(scene);
          return run_wat_scene(scene, data, predictions.directory, options, out / "rivals",
                               progress);
        },
        progress));
    write_report(out, report);
  }
  return std::move(report.scenes);
}

}  // namespace vggtcd
