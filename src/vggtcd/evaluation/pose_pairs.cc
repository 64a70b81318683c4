// SPDX-License-Identifier: Apache-2.0
// pose_pairs: by name, by time, or in order. Source of the time limit: evo's default (t_max_diff).
#include "vggtcd/evaluation/pose_pairs.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "vggtcd/core/error.h"
#include "vggtcd/core/number_text.h"

namespace vggtcd {
namespace {

constexpr double kMaxDifference_s = 0.01;

using Pairs = std::vector<std::pair<size_t, size_t>>;  // predicted, truth

PosePairs select(const Trajectory& predicted, const Trajectory& truth, const Pairs& pairs) {
  PosePairs result;
  for (const auto& [p, t] : pairs) {
    result.predicted.push_back(predicted[p].camera_from_world);
    result.truth.push_back(truth[t].camera_from_world);
  }
  result.predicted_alone = predicted.size() - pairs.size();
  result.truth_alone = truth.size() - pairs.size();
  return result;
}

PosePairs in_order(const Trajectory& predicted, const Trajectory& truth) {
  PosePairs result;
  for (const NamedPose& pose : predicted) result.predicted.push_back(pose.camera_from_world);
  for (const NamedPose& pose : truth) result.truth.push_back(pose.camera_from_world);
  return result;
}

// --- by name ---

using Names = std::map<std::string, size_t>;

// The place of every name; nothing if one comes twice.
std::optional<Names> names_of(const Trajectory& trajectory, bool with_folders) {
  Names names;
  for (size_t i = 0; i < trajectory.size(); ++i) {
    const std::string& name = trajectory[i].name;
    const size_t begin = with_folders ? 0 : name.find_last_of('/') + 1;
    if (!names.emplace(name.substr(begin), i).second) return {};
  }
  return names;
}

Pairs pairs_by_name(const Trajectory& predicted, const Trajectory& truth) {
  for (const bool with_folders : {true, false}) {
    const auto p = names_of(predicted, with_folders), t = names_of(truth, with_folders);
    Pairs pairs;
    if (!p || !t) continue;
    for (const auto& [name, place] : *t) {
      if (const auto found = p->find(name); found != p->end()) {
        pairs.emplace_back(found->second, place);
      }
    }
    std::ranges::sort(pairs, {}, &Pairs::value_type::second);  // the order of the truth
    if (!pairs.empty()) return pairs;
  }
  return {};
}

// --- by time ---

struct Stamp {
  double time_s = 0;
  size_t place = 0;
};

std::vector<Stamp> stamps_of(const Trajectory& trajectory) {
  std::vector<Stamp> stamps;
  for (size_t i = 0; i < trajectory.size(); ++i) {
    stamps.push_back({signed_number_in(trajectory[i].name).value_or(0), i});
  }
  return stamps;
}

std::vector<Stamp> sorted_stamps(const Trajectory& trajectory, const std::string& file) {
  std::vector<Stamp> stamps = stamps_of(trajectory);
  std::ranges::stable_sort(stamps, {}, &Stamp::time_s);
  const auto twice = std::ranges::adjacent_find(stamps, {}, &Stamp::time_s);
  if (twice != stamps.end()) {
    throw_error(ErrorCode::kInput, "{}: expected every time stamp once, found {} twice", file,
                trajectory[twice->place].name);
  }
  return stamps;
}

size_t nearest(const std::vector<Stamp>& stamps, double time_s) {
  const auto after = std::ranges::lower_bound(stamps, time_s, {}, &Stamp::time_s);
  size_t i = static_cast<size_t>(after - stamps.begin());
  if (i == stamps.size()) return i - 1;
  const bool before_is_nearer = i > 0 && time_s - stamps[i - 1].time_s < stamps[i].time_s - time_s;
  return before_is_nearer ? i - 1 : i;
}

PosePairs by_time(const TrajectoryFile& predicted, const std::string& predicted_file,
                  const TrajectoryFile& truth, const std::string& truth_file) {
  const std::vector<Stamp> p = sorted_stamps(predicted.poses, predicted_file);
  const std::vector<Stamp> t = sorted_stamps(truth.poses, truth_file);
  Pairs pairs;
  for (size_t i = 0; i < p.size() && !t.empty(); ++i) {
    const size_t j = nearest(t, p[i].time_s);
    if (std::abs(p[i].time_s - t[j].time_s) > kMaxDifference_s) continue;
    if (nearest(p, t[j].time_s) != i) continue;  // another one is nearer
    pairs.emplace_back(p[i].place, t[j].place);
  }
  if (pairs.empty()) {
    throw_error(ErrorCode::kInput,
                "{}: expected the time stamps of {} (within {} s), found others: {}, ... and {}, "
                "...; number both files 0, 1, 2, ... if their order is right",
                predicted_file, truth_file, kMaxDifference_s, predicted.poses.front().name,
                truth.poses.front().name);
  }
  return select(predicted.poses, truth.poses, pairs);
}

void expect_rising(const TrajectoryFile& file, const std::string& name) {
  if (file.names != PoseNames::kTimeStamps) return;
  const std::vector<Stamp> stamps = stamps_of(file.poses);
  const auto falls = std::ranges::adjacent_find(
      stamps, [](const Stamp& a, const Stamp& b) { return !(a.time_s < b.time_s); });
  if (falls == stamps.end()) return;
  throw_error(ErrorCode::kInput,
              "{}: expected rising time stamps, for the other file has none to pair by, found {} "
              "after {}; sort the lines by time",
              name, file.poses[falls->place + 1].name, file.poses[falls->place].name);
}

// Whether all stamps are among 0, 1, ... count - 1.
bool are_numbers_below(const Trajectory& trajectory, size_t count) {
  return std::ranges::all_of(stamps_of(trajectory), [&](const Stamp& stamp) {
    return stamp.time_s >= 0 && stamp.time_s < static_cast<double>(count) &&
           stamp.time_s == std::floor(stamp.time_s);
  });
}

}  // namespace

PosePairs pair_poses(const TrajectoryFile& predicted, const std::string& predicted_file,
                     const TrajectoryFile& truth, const std::string& truth_file) {
  const auto both = [&](PoseNames a, PoseNames b) {
    return (predicted.names == a && truth.names == b) || (predicted.names == b && truth.names == a);
  };
  if (both(PoseNames::kPhotos, PoseNames::kPhotos)) {
    const Pairs pairs = pairs_by_name(predicted.poses, truth.poses);
    if (!pairs.empty()) return select(predicted.poses, truth.poses, pairs);
  }
  if (both(PoseNames::kTimeStamps, PoseNames::kTimeStamps)) {
    return by_time(predicted, predicted_file, truth, truth_file);
  }
  if (both(PoseNames::kTimeStamps, PoseNames::kNumbers)) {
    const bool truth_is_numbers = truth.names == PoseNames::kNumbers;
    const Trajectory& numbers = truth_is_numbers ? truth.poses : predicted.poses;
    const Trajectory& stamps = truth_is_numbers ? predicted.poses : truth.poses;
    if (are_numbers_below(stamps, numbers.size())) {
      return by_time(predicted, predicted_file, truth, truth_file);
    }
  }
  expect_rising(predicted, predicted_file);
  expect_rising(truth, truth_file);
  return in_order(predicted.poses, truth.poses);
}

}  // namespace vggtcd
