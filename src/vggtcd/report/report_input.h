// SPDX-License-Identifier: Apache-2.0
// ReportInput: what the report page shows, of whatever method it came from.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "vggtcd/geometry/pinhole.h"
#include "vggtcd/geometry/rigid3.h"
#include "vggtcd/scene/image.h"

namespace vggtcd {

// Points in the T2 frame, less ReportInput::origin; arrays of one length.
struct ReportPoints {
  std::vector<Eigen::Vector3f> positions;
  std::vector<uint8_t> color;          // [N, 3] RGB
  std::vector<float> change_distance;  // T2 units
  std::vector<uint8_t> label;  // [N], or empty: 0 unchanged 1 removed 2 added 3 unobserved 4 moved
};

// The points of one epoch. They are walked through a few times, in blocks, and never all in memory:
// a full-size epoch has 17 million, of which the page shows fewer than one.
struct ReportCloud {
  size_t size = 0;
  bool has_labels = false;
  // Calls the sink with one block after the other; the same points in the same order every time.
  std::function<void(const std::function<void(const ReportPoints& block)>& sink)> for_each_block;
};
// A cloud that is in memory already.
ReportCloud cloud_of(ReportPoints points);

struct ReportPhoto {
  std::string name;                         // as the user knows it; any bytes
  std::optional<Rigid3> camera_from_world;  // world: the T2 frame
  std::optional<Pinhole> pinhole;           // in pixels of the score map
};

struct ReportEpoch {
  ReportCloud cloud;
  std::vector<ReportPhoto> photos;  // S of them
  int height = 0, width = 0;
  std::vector<float> score;    // [S, H, W], T2 units; NaN: no evidence
  std::vector<uint8_t> label;  // [S, H, W], or empty
  // The pixels of photo i; an empty image if there are none. Called from several threads.
  std::function<Image(int)> image;
};

struct ReportInput {
  std::string title;       // what was compared
  std::string unit = "u";  // of all lengths: model units, or "m" once metric
  // What clouds, cameras and changes are relative to, in the coordinates of the results' files.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double extent_u = 0;                       // robust size of the scene
  double threshold_u = 0;                    // beyond it a point is changed
  double bound_u = 0;                        // scores are exact below
  nlohmann::ordered_json summary;            // summary.json, shown as it is
  nlohmann::ordered_json sim3 = nullptr;     // sim3.json, or null
  nlohmann::ordered_json changes = nullptr;  // list of changes (docs/formats.md), or null
  ReportEpoch before, after;
};

}  // namespace vggtcd
