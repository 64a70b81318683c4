// SPDX-License-Identifier: Apache-2.0
// Both directions of the benchmark's JSON.
#include "vggtcd/evaluation/benchmark_json.h"

#include <limits>

#include "vggtcd/io/sim3_file.h"

namespace vggtcd {
namespace {

// One list of members per struct serves both directions: io(json, name, member).
struct Write {
  Json& json;
  template <typename T>
  void operator()(const char* name, const T& value) const {
    json[name] = encode(value);
  }
  template <typename T>
  static Json encode(const T& value) {
    return value;
  }
  static Json encode(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
  static Json encode(const Sim3& s);
  template <typename T>
  static Json encode(const std::vector<T>& values) {
    Json list = Json::array();
    for (const T& value : values) list.push_back(encode(value));
    return list;
  }
  static Json encode(const TrajectoryErrors& v) { return object(v); }
  static Json encode(const ChangeScores& v) { return object(v); }
  static Json encode(const MethodOutcome& v) { return object(v); }
  static Json encode(const AblationOutcome& v) { return object(v); }
  static Json encode(const ChangeOutcome& v) { return object(v); }
  template <typename T>
  static Json object(const T& value);
};

struct Read {
  const Json& json;
  template <typename T>
  void operator()(const char* name, T& value) const {
    decode(json.at(name), value);
  }
  template <typename T>
  static void decode(const Json& from, T& value) {
    from.get_to(value);
  }
  // A best threshold of minus infinity is null in JSON.
  static void decode(const Json& from, float& value) {
    value = from.is_null() ? -std::numeric_limits<float>::infinity() : from.get<float>();
  }
  static void decode(const Json& from, Eigen::Vector3d& v) {
    for (int k = 0; k < 3; ++k) v[k] = from.at(static_cast<size_t>(k)).get<double>();
  }
  static void decode(const Json& from, Sim3& s);
  template <typename T>
  static void decode(const Json& from, std::vector<T>& values) {
    values.clear();
    for (const Json& each : from) decode(each, values.emplace_back());
  }
  static void decode(const Json& from, TrajectoryErrors& v) { object(from, v); }
  static void decode(const Json& from, ChangeScores& v) { object(from, v); }
  static void decode(const Json& from, MethodOutcome& v) { object(from, v); }
  static void decode(const Json& from, AblationOutcome& v) { object(from, v); }
  static void decode(const Json& from, ChangeOutcome& v) { object(from, v); }
  template <typename T>
  static void object(const Json& from, T& value);
};

template <typename Visit, typename T>
requires std::is_same_v<std::remove_const_t<T>, TrajectoryErrors>
void members(const Visit& io, T& v) {
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

template <typename Visit, typename T>
requires std::is_same_v<std::remove_const_t<T>, ChangeScores>
void members(const Visit& io, T& v) {
  io("pixels", v.pixels);
  io("changed_pixels", v.changed_pixels);
  io("precision", v.precision);
  io("recall", v.recall);
  io("f1", v.f1);
  io("auprc", v.auprc);
  io("best_f1", v.best_f1);
  io("best_threshold", v.best_threshold);
}

template <typename Visit, typename T>
requires std::is_same_v<std::remove_const_t<T>, MethodOutcome>
void members(const Visit& io, T& v) {
  io("method", v.method);
  io("failure", v.failure);
  io("seconds", v.seconds);
  io("t2_from_t1", v.t2_from_t1);
  io("errors", v.errors);
  io("centers_t1", v.centers_t1);
  io("centers_t2", v.centers_t2);
}

template <typename Visit, typename T>
requires std::is_same_v<std::remove_const_t<T>, AblationOutcome>
void members(const Visit& io, T& v) {
  io("keyframes", v.keyframes);
  io("coarse_ate", v.coarse_ate);
  io("full_ate", v.full_ate);
  io("verdict", v.verdict);
}

template <typename Visit, typename T>
requires std::is_same_v<std::remove_const_t<T>, ChangeOutcome>
void members(const Visit& io, T& v) {
  io("method", v.method);
  io("unseen_counted", v.unseen_counted);
  io("every_pixel", v.every_pixel);
  io("scores", v.scores);
  io("unseen_called_changed", v.unseen_called_changed);
}

template <typename Visit, typename T>
requires std::is_same_v<std::remove_const_t<T>, SceneOutcome>
void members(const Visit& io, T& v) {
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
  io("true_centers_t1", v.true_centers_t1);
  io("true_centers_t2", v.true_centers_t2);
}

template <typename T>
Json Write::object(const T& value) {
  Json json = Json::object();
  members(Write{json}, value);
  return json;
}

template <typename T>
void Read::object(const Json& from, T& value) {
  members(Read{from}, value);
}

Json Write::encode(const Sim3& s) { return sim3_to_json(s); }

void Read::decode(const Json& from, Sim3& s) { s = sim3_from_json(from, "Sim(3)"); }

}  // namespace

Json to_json(const SceneOutcome& outcome) { return Write::object(outcome); }

SceneOutcome scene_outcome_from_json(const Json& json) {
  SceneOutcome outcome;
  Read::object(json, outcome);
  return outcome;
}

}  // namespace vggtcd
