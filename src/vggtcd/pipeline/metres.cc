// SPDX-License-Identifier: Apache-2.0
// What the user knows in metres, and the frame that follows.
#include "vggtcd/pipeline/metres.h"

#include <algorithm>
#include <cmath>

#include "vggtcd/core/number_text.h"
#include "vggtcd/io/quote.h"
#include "vggtcd/scene/local_frame.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

constexpr const char* kOption = "--known-distance";
constexpr double kEdge = 0.05;  // relative range of depth around a pixel that is an edge

// The largest over the smallest depth of the 3 x 3 pixels around, less one.
double depth_range(const PixelQuestion& at, const Reconstruction& epoch) {
  const auto depth = epoch.frame_depth(at.frame);
  float low = 0, high = 0;
  for (int y = std::max(0, at.y - 1); y <= std::min(epoch.height - 1, at.y + 1); ++y) {
    for (int x = std::max(0, at.x - 1); x <= std::min(epoch.width - 1, at.x + 1); ++x) {
      const float z =
          depth[static_cast<size_t>(y) * static_cast<size_t>(epoch.width) + static_cast<size_t>(x)];
      if (!(z > 0)) continue;
      low = low > 0 ? std::min(low, z) : z;
      high = std::max(high, z);
    }
  }
  return low > 0 ? static_cast<double>(high / low) - 1 : 0;
}

PixelQuestion place_of(const std::string& text, const Reconstruction& before,
                       const Reconstruction& after, ProgressSink& progress) {
  const PixelQuestion at = parse_pixel_question(text, before, after, kOption);
  const Reconstruction& epoch = at.in_after ? after : before;
  if (!(epoch.depth[pixel_index(at, epoch)] > 0)) {
    throw_error(ErrorCode::kUsage,
                "{}: {} has no depth; choose a pixel on a surface that is seen well", kOption,
                text);
  }
  if (const double range = depth_range(at, epoch); range > kEdge) {
    progress.notice(fmt::format(
        "{}: {} lies on an edge: the depth around it differs by {:.0f} %, so it may be on the "
        "surface behind; a pixel clearly on one side is better",
        kOption, text, 100 * range));
  }
  return at;
}

Eigen::Vector3d point_in_t2(const PixelQuestion& at, const Reconstruction& before,
                            const Reconstruction& after, const Sim3& t2_from_t1) {
  const Reconstruction& epoch = at.in_after ? after : before;
  const PixelRays rays(epoch.views[static_cast<size_t>(at.frame)],
                       at.in_after ? Sim3{} : t2_from_t1);
  return rays.point(at.x, at.y, epoch.depth[pixel_index(at, epoch)]).cast<double>();
}

// "images/before/a.jpg" -> "before/a.jpg"; "sub/a.jpg" -> "a.jpg"
std::string short_name(const std::string& name) {
  for (const char* epoch : {"before/", "after/"}) {
    const size_t at = name.rfind(epoch);
    if (at != std::string::npos && (at == 0 || name[at - 1] == '/')) return name.substr(at);
  }
  return name.substr(name.rfind('/') + 1);
}

// A time stamp that is a whole number is the number of a photo of T2, whose frame this is.
std::string photo_of_time_stamp(const std::string& name) {
  const auto number = number_in<double>(name);
  const bool whole = number && *number == std::floor(*number) && *number >= 0 && *number < 1e9;
  return whole ? fmt::format("after/{:.0f}", *number) : name;
}

}  // namespace

void MetricInputs::validate() const {
  if (!known_distances.empty() && reference) {
    throw_error(ErrorCode::kUsage,
                "--known-distance and --reference: expected one of them, for each decides what a "
                "metre is; leave one out");
  }
  for (const KnownDistance& known : known_distances) {
    check_pixel_question(known.a, kOption);
    check_pixel_question(known.b, kOption);
    if (!(known.metres > 0) || !std::isfinite(known.metres)) {
      throw_error(ErrorCode::kUsage, "{}: expected a length above 0 m, found {}", kOption,
                  known.metres);
    }
  }
}

MetricProblem::MetricProblem(const MetricInputs& inputs, const Reconstruction& before,
                             const Reconstruction& after, ProgressSink& progress) {
  inputs.validate();
  for (const KnownDistance& known : inputs.known_distances) {
    lengths_.push_back({place_of(known.a, before, after, progress),
                        place_of(known.b, before, after, progress), known});
  }
  if (inputs.reference) match_cameras(*inputs.reference, before, after, progress);
}

void MetricProblem::match_cameras(const std::filesystem::path& path, const Reconstruction& before,
                                  const Reconstruction& after, ProgressSink& progress) {
  const std::vector<ReferenceCamera> reference = read_reference_cameras(path);
  std::string unmatched;
  for (const ReferenceCamera& camera : reference) {
    const std::string name = photo_of_time_stamp(short_name(camera.name));
    const bool says_before = name.starts_with("before/"), says_after = name.starts_with("after/");
    const std::string photo = says_before || says_after ? name.substr(name.find('/') + 1) : name;
    const auto t1 = says_after ? std::nullopt : find_frame(before, photo);
    const auto t2 = says_before ? std::nullopt : find_frame(after, photo);
    if (t1 && t2) {
      throw_error(ErrorCode::kInput,
                  "{}: {} is a photo of both epochs; write before/{} or after/{}", path.string(),
                  quote(camera.name), photo, photo);
    }
    if (!t1 && !t2) {
      if (unmatched.empty()) unmatched = camera.name;
      continue;
    }
    const Reconstruction& epoch = t2 ? after : before;
    const int frame = t2 ? *t2 : *t1;
    cameras_.push_back({t2.has_value(), frame,
                        (t2 ? "after/" : "before/") + epoch.views[static_cast<size_t>(frame)].name,
                        camera.center_m});
  }
  if (cameras_.size() < 3) {
    throw_error(ErrorCode::kInput,
                "{}: expected at least 3 cameras that are among the photos ({}, ...), found {}{}",
                path.string(), "after/" + after.views.front().name, cameras_.size(),
                unmatched.empty() ? "" : fmt::format("; {} is none", quote(unmatched)));
  }
  if (cameras_.size() < reference.size()) {
    progress.notice(fmt::format("{}: {} of {} cameras are not among the photos ({}, ...)",
                                path.string(), reference.size() - cameras_.size(), reference.size(),
                                quote(unmatched)));
  }
}

Metric MetricProblem::solve(const Reconstruction& before, const Reconstruction& after,
                            const Sim3& t2_from_t1, const Sim3& surface_t2_from_t1,
                            double point_sigma_u) const {
  Metric metric;
  if (lengths_.empty()) {
    std::vector<Eigen::Vector3d> in_t2, in_metres;
    for (const Camera& camera : cameras_) {
      const View& view =
          (camera.in_after ? after : before).views[static_cast<size_t>(camera.frame)];
      const Eigen::Vector3d center = camera_center(view.camera_from_world);
      in_t2.push_back(camera.in_after ? center : t2_from_t1 * center);
      in_metres.push_back(camera.center_m);
      metric.cameras.push_back(camera.name);
    }
    metric.frame = metric_frame_from_cameras(in_t2, in_metres);
    return metric;
  }
  std::vector<KnownLength> lengths;
  for (const Length& length : lengths_) {
    const double length_u = (point_in_t2(length.a, before, after, surface_t2_from_t1) -
                             point_in_t2(length.b, before, after, surface_t2_from_t1))
                                .norm();
    if (!(length_u > 0)) {
      throw_error(ErrorCode::kUsage, "{}: {} and {} are one place; expected two", kOption,
                  length.known.a, length.known.b);
    }
    lengths.push_back({length_u, length.known.metres});
    metric.distances.push_back(length.known);
  }
  metric.frame = metric_frame_from_lengths(lengths, point_sigma_u);
  for (const KnownLength& length : lengths) {
    metric.measured_m.push_back(metric.frame.metres_from_t2.scale * length.length_u);
  }
  return metric;
}

std::string frame_name(const Metric& metric) { return metric.cameras.empty() ? "T2" : "reference"; }

Metric in_worlds(Metric metric, const Eigen::Vector3d& origin_t2) {
  Sim3& metres_from_t2 = metric.frame.metres_from_t2;
  // A length alone scales T2 about its world's origin.
  const Eigen::Vector3d origin_m = metric.cameras.empty()
                                       ? Eigen::Vector3d(metres_from_t2.scale * origin_t2)
                                       : Eigen::Vector3d(Eigen::Vector3d::Zero());
  metres_from_t2 = between_worlds(metres_from_t2, origin_t2, origin_m);
  return metric;
}

std::string metric_sentence(const Metric& metric) {
  const MetricFrame& frame = metric.frame;
  std::string text = fmt::format("1 scene unit is {:.4g} m", frame.metres_from_t2.scale);
  if (frame.scale_sigma)
    text += fmt::format(" (standard error {:.2g} %)", 100 * *frame.scale_sigma);
  if (metric.distances.size() == 1) return text + ", from 1 known distance.";
  if (!metric.distances.empty()) {
    return text + fmt::format(", from {} known distances, which disagree by {:.2g} m.",
                              metric.distances.size(), frame.rms_residual_m);
  }
  const auto worst = std::ranges::max_element(frame.residuals_m);
  return text + fmt::format(
                    ", from {} reference cameras, off by {:.2g} m (worst {:.2g} m, {}); their "
                    "frame is known "
                    "to {:.2g} degrees and {:.2g} m.",
                    metric.cameras.size(), frame.rms_residual_m, *worst,
                    metric.cameras[static_cast<size_t>(worst - frame.residuals_m.begin())],
                    frame.rotation_sigma_rad * 180 / M_PI, frame.position_sigma_m);
}

Json metric_json(const Metric& metric) {
  const MetricFrame& frame = metric.frame;
  Json json = {{"sentence", metric_sentence(metric)},
               {"metres_per_unit", frame.metres_from_t2.scale},
               {"relative_sigma", frame.scale_sigma ? Json(*frame.scale_sigma) : Json(nullptr)},
               {"rms_residual_m", frame.rms_residual_m}};
  for (size_t i = 0; i < metric.distances.size(); ++i) {
    const KnownDistance& known = metric.distances[i];
    json["known_distances"].push_back({{"a", known.a},
                                       {"b", known.b},
                                       {"known_m", known.metres},
                                       {"measured_m", metric.measured_m[i]},
                                       {"residual_m", frame.residuals_m[i]}});
  }
  if (metric.cameras.empty()) return json;
  json["rotation_sigma_deg"] = frame.rotation_sigma_rad * 180 / M_PI;
  json["position_sigma_m"] = frame.position_sigma_m;
  for (size_t i = 0; i < metric.cameras.size(); ++i) {
    json["reference_cameras"].push_back(
        {{"name", metric.cameras[i]}, {"residual_m", frame.residuals_m[i]}});
  }
  return json;
}

}  // namespace vggtcd
