// SPDX-License-Identifier: Apache-2.0
// The frame and the unit of all results: the one place where they become metres
// (docs/decisions/0007).
#pragma once

#include <optional>
#include <string>

#include "vggtcd/change/explanation.h"
#include "vggtcd/change/instances.h"
#include "vggtcd/change/nearest_distance.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/pipeline/answer_store.h"
#include "vggtcd/pipeline/metres.h"

namespace vggtcd {

// Everything is computed in T2 and its units (names in _u). Before it is written it is expressed in
// the frame and unit of the results; in files that have `unit` "m", names end in _m instead.
struct ResultFrame {
  std::string name = "T2";  // or "reference"
  std::string unit = "u";   // scene units, or "m"
  // From the local frame of T2 to that of the results, whose origin lies there in the coordinates
  // that files have: points are floats in the former, doubles in files (scene/local_frame.h).
  Sim3 from_t2;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double scale_sigma = 0;  // relative; 0 also where it is not known

  ResultFrame() = default;
  // Without metres.
  explicit ResultFrame(const Reconstruction& after);
  ResultFrame(const Metric& metric, const Reconstruction& after);

  bool is_far() const { return !origin.isZero(0); }

  bool is_metric() const { return unit == "m"; }
  // "scene_extent_u" -> "scene_extent_m", "volume_u3" -> "volume_m3" if the unit is "m".
  std::string key(std::string_view name_in_u) const;
  // The same for all keys of a document.
  Json renamed(const Json& json) const;
  // "scene units" or "m".
  std::string unit_in_words() const { return is_metric() ? "m" : "scene units"; }
};

// Lengths, areas and volumes in the unit of the frame, boxes in the frame. The standard deviations
// of sizes grow by that of the scale. answers: of the photos' votes, where there are any.
void express(const ResultFrame& frame, ChangeSet& changes, AnswerStore* answers,
             ChangeInstances& instances, std::optional<PixelExplanation>& explanation);

}  // namespace vggtcd
