// SPDX-License-Identifier: Apache-2.0
// Change detection by bidirectional nearest-neighbour distance (section 3.4 of the paper).
#pragma once

#include <cstdint>
#include <vector>

#include "vggtcd/change/change_label.h"
#include "vggtcd/core/options.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct ChangeOptions {
  double threshold_fraction = 0.01;  // tau / scene extent; > 0
  double bound_fraction = 0.02;      // search bound / scene extent; >= threshold_fraction

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field(
        "threshold_fraction", self.threshold_fraction,
        "Change: a point is changed when the other epoch is farther away than this fraction of the "
        "scene extent (the paper's tau).");
    field("bound_fraction", self.bound_fraction,
          "Change: distances are exact up to this fraction of the scene extent; beyond it the "
          "bound is "
          "reported. Also the red end of the heat maps.");
  };
  void validate() const;
};

// The evidence of one epoch, per pixel of its photos.
struct EpochChange {
  // [S, H, W]: distance to the other epoch in T2 units; NaN where the pixel has no depth or its
  // confidence is not above the epoch's median: no evidence.
  std::vector<float> score;
  // [S, H, W] or empty. Where present it decides, and the score only says how far.
  std::vector<ChangeLabel> label;
  // With labels, of each pixel called changed, in pixel order: how sure it is, 0 to 1, and the gap
  // in sigmas, at most 8 (photo_answers.h).
  std::vector<float> changed_confidence, changed_evidence;
  int64_t points = 0;      // pixels with evidence
  int64_t changed = 0;     // of them called changed
  int64_t unobserved = 0;  // of them not seen by the other epoch; known with labels only
};

struct ChangeSet {
  EpochChange t1, t2;
  double scene_extent_u = 0;  // robust extent of the after epoch's points, T2 units
  double threshold_u = 0;     // tau
  double bound_u = 0;         // scores are exact below, equal to it beyond
  double surface_sigma_u =
      0;  // by which the epochs' surfaces disagree where nothing changed; 0: not known

  // Eq. 8 and its threshold: evidence and farther than tau. NaN compares false.
  bool changed(float score) const { return score > static_cast<float>(threshold_u); }
  // The decision about a pixel of an epoch: by its label if there are labels, else by its score.
  bool changed(const EpochChange& epoch, size_t pixel) const {
    return epoch.label.empty() ? changed(epoch.score[pixel]) : is_change(epoch.label[pixel]);
  }
};

// Both directions: every point of an epoch (confidence above that epoch's median) against all such
// points of the other one, T1 mapped by t2_from_t1. The union over both directions is the pair of
// score maps: each direction labels the pixels of its own photos. Throws Error{kDegenerate} naming
// the epoch if one has no points.
ChangeSet detect_changes(const Reconstruction& before, const Reconstruction& after,
                         const Sim3& t2_from_t1, const ChangeOptions& options);

}  // namespace vggtcd
