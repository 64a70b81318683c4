// SPDX-License-Identifier: Apache-2.0
// One small file per rival and pair of epochs.
#include "vggtcd/evaluation/kept_rivals.h"

#include <fmt/format.h>

#include <chrono>
#include <span>

#include "vggtcd/core/error.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/io/output_directory.h"
#include "vggtcd/io/sim3_file.h"

namespace vggtcd {
namespace {

class Fnv1a {
 public:
  template <typename T>
  void add(std::span<const T> values) {
    for (const std::byte byte : std::as_bytes(values)) {
      hash_ = (hash_ ^ static_cast<uint64_t>(byte)) * 0x100000001b3u;
    }
  }
  void add(double value) { add(std::span<const double>(&value, 1)); }
  uint64_t hash() const { return hash_; }

 private:
  uint64_t hash_ = 0xcbf29ce484222325u;
};

void add_epoch(Fnv1a& hash, const Reconstruction& epoch) {
  for (const View& view : epoch.views) {
    hash.add(std::span<const double>(view.camera_from_world.rotation.data(), 9));
    hash.add(std::span<const double>(view.camera_from_world.translation.data(), 3));
    for (const double value :
         {view.pinhole.fx, view.pinhole.fy, view.pinhole.cx, view.pinhole.cy}) {
      hash.add(value);
    }
  }
  hash.add(std::span<const float>(epoch.depth));
  hash.add(std::span<const float>(epoch.confidence));
  hash.add(std::span<const uint8_t>(epoch.color));
}

MethodAnswer run(const RegistrationMethod& method, const RegistrationProblem& problem) {
  MethodAnswer answer;
  const auto start = std::chrono::steady_clock::now();
  try {
    answer.found = method.run(problem);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kDegenerate) throw;
    answer.failure = error.what();
  }
  answer.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return answer;
}

}  // namespace

uint64_t hash_of_epochs(const RegistrationProblem& problem) {
  Fnv1a hash;
  add_epoch(hash, problem.before);
  add_epoch(hash, problem.after);
  return hash.hash();
}

MethodAnswer run_or_recall(const RegistrationMethod& method, const RegistrationProblem& problem,
                           uint64_t hash, const std::filesystem::path& directory) {
  if (directory.empty()) return run(method, problem);
  const std::filesystem::path file = directory / fmt::format("{}_{:016x}.json", method.name, hash);
  if (exists_at(file)) {
    try {
      const Json kept = read_json_file(file);
      return {kept.at("failure").get<std::string>(),
              sim3_from_json(kept.at("t2_from_t1"), file.string()),
              kept.at("seconds").get<double>()};
    } catch (const Json::exception&) {
      // Broken: computed and written again.
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kInput) throw;
    }
  }
  OutputDirectory kept(directory, {kCacheKind, {file.filename().string()}, true, true});
  const MethodAnswer answer = run(method, problem);
  write_json_file(kept / file.filename().string(),
                  Json{{"failure", answer.failure},
                       {"seconds", answer.seconds},
                       {"t2_from_t1", sim3_to_json(answer.found.t2_from_t1)}});
  kept.commit();
  return answer;
}

}  // namespace vggtcd
