// SPDX-License-Identifier: Apache-2.0
// Both directions of the benchmark's JSON.
#include "vggtcd/evaluation/benchmark_json.h"

#include <concepts>
#include <limits>

#include "vggtcd/io/sim3_file.h"

namespace vggtcd {
namespace {

template <typename T, typename U>
concept Like = std::same_as<std::remove_const_t<T>, U>;

// Every struct has one list of members, which serves both directions: visit(name, member).
template <Like<TrajectoryErrors> T, typename Visit>
void members(T& v, const Visit& io) {
  io("ate_mean", v.ate_mean);
  io("ate_rmse", v.ate_rmse);
  io("ate_median", v.ate_median);
  io("ate_relative", v.ate_relative);
  io("rte_mean", v.rte_mean);
  io("rre_mean_deg", v.rre_mean_deg);
  io("trajectory_length", v.trajectory_length);
  io("frames", v.frames);
  io("truth_from_predicted", v.truth_from_predicted);
}

template <Like<ChangeScores> T, typename Visit>
void members(T& v, const Visit& io) {
  io("pixels", v.pixels);
  io("changed_pixels", v.changed_pixels);
  io("precision", v.precision);
  io("recall", v.recall);
  io("f1", v.f1);
  io("auprc", v.auprc);
  io("best_f1", v.best_f1);
  io("false_alarms", v.false_alarms);
  io("best_threshold", v.best_threshold);
}

template <Like<InstanceScores> T, typename Visit>
void members(T& v, const Visit& io) {
  io("objects", v.objects);
  io("found", v.found);
  io("told_apart", v.told_apart);
  io("small", v.small);
  io("hardly_seen", v.hardly_seen);
  io("reported", v.reported);
  io("right", v.right);
}

template <Like<MethodOutcome> T, typename Visit>
void members(T& v, const Visit& io) {
  io("method", v.method);
  io("failure", v.failure);
  io("seconds", v.seconds);
  io("t2_from_t1", v.found.t2_from_t1);
  io("surface_t2_from_t1", v.found.surface_t2_from_t1);
  io("verdict", v.found.verdict);
  io("plausibility", v.plausibility);
  io("errors", v.errors);
  io("centers_t1", v.centers_t1);
  io("centers_t2", v.centers_t2);
}

template <Like<AblationOutcome> T, typename Visit>
void members(T& v, const Visit& io) {
  io("keyframes", v.keyframes);
  io("coarse_ate", v.coarse_ate);
  io("full_ate", v.full_ate);
  io("verdict", v.verdict);
}

template <Like<ChangeOutcome> T, typename Visit>
void members(T& v, const Visit& io) {
  io("method", v.method);
  io("alignment", v.alignment);
  io("unseen_counted", v.unseen_counted);
  io("every_pixel", v.every_pixel);
  io("scores", v.scores);
  io("evidence", v.evidence);
  io("unseen_called_changed", v.unseen_called_changed);
  io("sky_called_changed", v.sky_called_changed);
}

template <Like<InstanceOutcome> T, typename Visit>
void members(T& v, const Visit& io) {
  io("method", v.method);
  io("alignment", v.alignment);
  io("scores", v.scores);
}

template <Like<SceneOutcome> T, typename Visit>
void members(T& v, const Visit& io) {
  io("scene", v.scene);
  io("seed", v.seed);
  io("outdoor", v.outdoor);
  io("scale", v.scale);
  io("extent", v.extent);
  io("changed_share", v.changed_share);
  io("best_fit_ate", v.best_fit_ate);
  io("methods", v.methods);
  io("ablation", v.ablation);
  io("changes", v.changes);
  io("instances", v.instances);
  io("true_centers_t1", v.true_centers_t1);
  io("true_centers_t2", v.true_centers_t2);
}

struct NoVisit {
  void operator()(const char*, const auto&) const {}
};
template <typename T>
concept HasMembers = requires(T& value) {
  members(value, NoVisit{});
};

template <typename T>
constexpr bool kIsVector = false;
template <typename T>
constexpr bool kIsVector<std::vector<T>> = true;

template <typename T>
Json encode(const T& value) {
  if constexpr (HasMembers<T>) {
    Json json = Json::object();
    members(value, [&](const char* name, const auto& member) { json[name] = encode(member); });
    return json;
  } else if constexpr (kIsVector<T>) {
    Json json = Json::array();
    for (const auto& each : value) json.push_back(encode(each));
    return json;
  } else if constexpr (std::same_as<T, Eigen::Vector3d>) {
    return {value.x(), value.y(), value.z()};
  } else if constexpr (std::same_as<T, Sim3>) {
    return sim3_to_json(value);
  } else {
    return value;
  }
}

template <typename T>
void decode(const Json& json, T& value) {
  if constexpr (HasMembers<T>) {
    members(value, [&](const char* name, auto& member) { decode(json.at(name), member); });
  } else if constexpr (kIsVector<T>) {
    value.clear();
    for (const Json& each : json) decode(each, value.emplace_back());
  } else if constexpr (std::same_as<T, Eigen::Vector3d>) {
    for (int k = 0; k < 3; ++k) value[k] = json.at(static_cast<size_t>(k)).get<double>();
  } else if constexpr (std::same_as<T, Sim3>) {
    value = sim3_from_json(json, "Sim(3)");
  } else if constexpr (std::same_as<T, float>) {
    // A best threshold of minus infinity is null in JSON.
    value = json.is_null() ? -std::numeric_limits<float>::infinity() : json.get<float>();
  } else {
    json.get_to(value);
  }
}

}  // namespace

Json to_json(const SceneOutcome& outcome) { return encode(outcome); }

SceneOutcome scene_outcome_from_json(const Json& json) {
  SceneOutcome outcome;
  decode(json, outcome);
  return outcome;
}

}  // namespace vggtcd
