// SPDX-License-Identifier: Apache-2.0
// What the user knows in metres (distances between pixels, positions of cameras), and the frame
// that follows.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "vggtcd/change/explanation.h"
#include "vggtcd/core/progress.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/io/reference_cameras.h"
#include "vggtcd/registration/metric_frame.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct KnownDistance {
  std::string a, b;  // X,Y,before/PHOTO or X,Y,after/PHOTO (explanation.h)
  double metres = 0;
};

// At most one of the two.
struct MetricInputs {
  std::vector<KnownDistance> known_distances;
  std::optional<std::filesystem::path> reference;  // reference_cameras.h

  bool given() const { return !known_distances.empty() || reference; }
  // Without any photo. Throws Error{kUsage}.
  void validate() const;
};

// What was found, for sim3.json, summary.json and the terminal.
struct Metric {
  MetricFrame frame;
  std::vector<KnownDistance> distances;  // or:
  std::vector<std::string> cameras;      // before/NAME or after/NAME, as the residuals
  std::vector<double> measured_m;        // of the distances
};

// The inputs held against the photos: every pixel has depth, every camera is one of the photos.
class MetricProblem {
 public:
  // Throws Error{kUsage} naming the photo or pixel that is not there or has no depth, and
  // Error{kInput} naming the file if fewer than 3 of its cameras are among the photos, or if a name
  // is that of a photo of both epochs. Notices: pixels on an edge of depth, cameras without a
  // photo.
  MetricProblem(const MetricInputs& inputs, const Reconstruction& before,
                const Reconstruction& after, ProgressSink& progress);
  // Cameras go by t2_from_t1, distances between pixels by surface_t2_from_t1 (alignment.h).
  // point_sigma_u: the standard deviation of a surface point, 0 if not known (metric_frame.h).
  Metric solve(const Reconstruction& before, const Reconstruction& after, const Sim3& t2_from_t1,
               const Sim3& surface_t2_from_t1, double point_sigma_u) const;

 private:
  struct Length {
    PixelQuestion a, b;
    KnownDistance known;
  };
  struct Camera {
    bool in_after = false;
    int frame = 0;
    std::string name;
    Eigen::Vector3d center_m;
  };
  void match_cameras(const std::filesystem::path& path, const Reconstruction& before,
                     const Reconstruction& after, ProgressSink& progress);
  std::vector<Length> lengths_;
  std::vector<Camera> cameras_;
};

// "T2", scaled to metres, or "reference".
std::string frame_name(const Metric& metric);

// The same with metres_from_t2 between the worlds of the files, as results state it: it is found in
// T2's local frame, whose origin lies at origin_t2 (scene/local_frame.h).
Metric in_worlds(Metric metric, const Eigen::Vector3d& origin_t2);

// "1 scene unit is 0.742 m (standard error 0.4 %), from ..."
std::string metric_sentence(const Metric& metric);

// The "metric" part of summary.json.
Json metric_json(const Metric& metric);

}  // namespace vggtcd
