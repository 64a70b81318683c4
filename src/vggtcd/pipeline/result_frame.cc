// SPDX-License-Identifier: Apache-2.0
// The frame and the unit of all results.
#include "vggtcd/pipeline/result_frame.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "vggtcd/scene/local_frame.h"

namespace vggtcd {
namespace {

void scale_all(std::span<float> values, double scale) {
  const float factor = static_cast<float>(scale);
  for (float& value : values) value *= factor;
}

void scale_all(ScratchArray<float>& values, size_t size, double scale) {
  std::vector<float> part;
  for (size_t first = 0; first < size; first += part.size()) {
    part.resize(std::min<size_t>(size - first, 1 << 20));
    values.read(first, part);
    scale_all(part, scale);
    values.write(first, part);
  }
}

void express(const ResultFrame& frame, InstancePart& part) {
  const double s = frame.from_t2.scale;
  part.box.center = frame.from_t2 * part.box.center + frame.origin;
  part.box.rotation = frame.from_t2.rotation * part.box.rotation;
  part.box.size *= s;
  part.volume_u3 *= s * s * s;
  part.volume_sigma_u3 =
      std::hypot(s * s * s * part.volume_sigma_u3, 3 * frame.scale_sigma * part.volume_u3);
  part.surface_u2 *= s * s;
  part.surface_sigma_u2 =
      std::hypot(s * s * part.surface_sigma_u2, 2 * frame.scale_sigma * part.surface_u2);
}

void express(double scale, PixelExplanation& why) {
  const float s = static_cast<float>(scale);
  why.gap_u *= s;
  why.level_of_detection_u *= s;
  for (PhotoTestimony& photo : why.photos) {
    for (float Testimony::*length : {&Testimony::z, &Testimony::near, &Testimony::far,
                                     &Testimony::gap_u, &Testimony::sigma_u}) {
      photo.said.*length *= s;
    }
  }
}

}  // namespace

ResultFrame::ResultFrame(const Reconstruction& after) : origin(after.origin_in_world) {}

ResultFrame::ResultFrame(const Metric& metric, const Reconstruction& after)
    : name(frame_name(metric)),
      unit("m"),
      from_t2(metric.frame.metres_from_t2),
      scale_sigma(metric.frame.scale_sigma.value_or(0)) {
  if (metric.cameras.empty()) {  // a length alone scales T2 about its world's origin
    origin = from_t2.scale * after.origin_in_world;
    return;
  }
  std::vector<Eigen::Vector3d> centers;
  for (const View& view : after.views) centers.push_back(camera_center(view.camera_from_world));
  const SceneSize scene = scene_size(after, centers);
  origin = local_origin(from_t2 * scene.middle, from_t2.scale * scene.size);
  from_t2.translation -= origin;
}

std::string ResultFrame::key(std::string_view name_in_u) const {
  std::string result(name_in_u);
  if (!is_metric()) return result;
  const bool has_power = !result.empty() && (result.back() == '2' || result.back() == '3');
  const size_t end = result.size() - (has_power ? 1 : 0);
  if (end >= 2 && result.compare(end - 2, 2, "_u") == 0) result[end - 1] = 'm';
  return result;
}

Json ResultFrame::renamed(const Json& json) const {
  if (json.is_array()) {
    Json result = Json::array();
    for (const Json& item : json) result.push_back(renamed(item));
    return result;
  }
  if (!json.is_object()) return json;
  Json result = Json::object();
  for (const auto& [name_in_u, value] : json.items()) result[key(name_in_u)] = renamed(value);
  return result;
}

void express(const ResultFrame& frame, ChangeSet& changes, AnswerStore* answers,
             ChangeInstances& instances, std::optional<PixelExplanation>& explanation) {
  if (!frame.is_metric() && !frame.is_far()) return;
  for (ChangeInstance& instance : instances.instances) {
    if (instance.before) express(frame, *instance.before);
    if (instance.after) express(frame, *instance.after);
  }
  if (!frame.is_metric()) return;
  const double s = frame.from_t2.scale;
  for (EpochChange* epoch : {&changes.t1, &changes.t2}) scale_all(epoch->score, s);
  if (answers) {
    for (const auto& [stored, epoch] :
         {std::pair(&answers->t1, &changes.t1), {&answers->t2, &changes.t2}}) {
      scale_all(stored->gap, epoch->score.size(), s);
      scale_all(stored->level_of_detection, epoch->score.size(), s);
    }
  }
  for (double* length :
       {&changes.scene_extent_u, &changes.surface_sigma_u, &instances.voxel_size_u}) {
    *length *= s;
  }
  // Rounded as the scores are, so that the same pixels are beyond them.
  for (double* bound : {&changes.threshold_u, &changes.bound_u}) {
    *bound = static_cast<double>(static_cast<float>(*bound) * static_cast<float>(s));
  }
  if (explanation) express(s, *explanation);
}

}  // namespace vggtcd
