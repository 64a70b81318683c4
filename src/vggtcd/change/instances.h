// SPDX-License-Identifier: Apache-2.0
// Changes as things: connected regions of changed points across the photos of an epoch, measured,
// and paired where something moved.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "vggtcd/change/instance_shape.h"
#include "vggtcd/change/nearest_distance.h"
#include "vggtcd/change/thing_signs.h"
#include "vggtcd/core/options.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct InstanceOptions {
  double link_fraction = 0.0125;     // voxel edge / scene extent; > 0
  int min_voxel_points = 1;          // fewer points of one voxel connect nothing; >= 1
  double split_density = 0.5;        // of a region's median points per voxel; thinner ones divide
  double min_size_fraction = 0.02;   // longest edge of the box / scene extent; >= 0
  double min_width_fraction = 0.01;  // its second longest edge; slivers along edges are noise
  double min_fill = 0.2;             // voxels / those that cover the largest face of the box; >= 0
  int min_instance_points = 50;      // >= 1
  int min_photos = 2;                // of its epoch that show it; >= 1
  double min_confidence = 0.5;       // that it is a thing (thing_signs.h); [0, 1]
  double move_shape_ratio = 0.6;     // of the box edges of a pair, smaller / larger; (0, 1]
  double move_color_overlap = 0.6;   // common part of the colour histograms of a pair; (0, 1]

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("link_fraction", self.link_fraction,
          "Instances: changed points in touching voxels of this size (share of the scene extent) "
          "are one thing.");
    field("min_voxel_points", self.min_voxel_points,
          "Instances: voxels with fewer changed points are noise.");
    field("split_density", self.split_density,
          "Instances: a region is divided where its voxels hold less than this share of the median "
          "number of points, if what is left are things by themselves; 0 divides nothing.");
    field("min_size_fraction", self.min_size_fraction,
          "Instances: things whose longest edge is shorter than this share of the scene extent are "
          "left out.");
    field("min_width_fraction", self.min_width_fraction,
          "Instances: and those whose second longest edge is shorter than this.");
    field("min_fill", self.min_fill,
          "Instances: and those whose voxels, laid side by side, cover less than this share of the "
          "largest face of the box: scattered specks.");
    field("min_instance_points", self.min_instance_points,
          "Instances: things with fewer points are left out.");
    field("min_photos", self.min_photos, "Instances: things in fewer photos are left out.");
    field("min_confidence", self.min_confidence,
          "Instances: regions that are less likely to be things that changed are left out; their "
          "number is reported.");
    field("move_shape_ratio", self.move_shape_ratio,
          "Instances: a removed and an added thing are one that moved if the edges of their boxes "
          "agree to this ratio");
    field("move_color_overlap", self.move_color_overlap,
          "Instances: and their colours have this share in common.");
  };
  void validate() const;
};

// The numbers are those of the labels in the files.
enum class InstanceClass : uint8_t { kRemoved = 1, kAdded = 2, kMoved = 4 };
std::span<const EnumName<InstanceClass>> enum_names(InstanceClass);

// A photo that shows an instance.
struct InstancePhoto {
  int frame = 0;
  int64_t pixels = 0;   // that belong to the instance
  double evidence = 0;  // sum of their confidences
};

// An instance as one epoch's photos show it. T2 frame and units.
struct InstancePart {
  OrientedBox box;
  double volume_u3 = 0;        // of the part of the box that no photo of the epoch sees through
  double volume_sigma_u3 = 0;  // twice the surface times the uncertainty of a surface point
  double surface_u2 = 0;       // that the photos see
  double surface_sigma_u2 = 0;
  int64_t pixels = 0;
  double confidence = 0;              // thing_probability of its signs
  std::vector<InstancePhoto> photos;  // at most 3, the most evidence first
  ColorHistogram colors{};
  ThingSigns signs;
};

struct ChangeInstance {
  InstanceClass kind = InstanceClass::kRemoved;
  std::optional<InstancePart> before, after;  // a moved one has both, else one

  // The part that measures the instance: where it is now, or where it was.
  const InstancePart& main() const { return after ? *after : *before; }
  double volume_u3() const { return main().volume_u3; }
  double confidence() const;  // mean of the parts'
  double rank() const { return volume_u3() * confidence(); }
};

struct ChangeInstances {
  std::vector<ChangeInstance> instances;  // highest rank first; instance i has id i + 1
  std::vector<int32_t> id_t1, id_t2;      // [S, H, W] of either epoch; 0: belongs to none
  // Regions with a body in some photo and a confidence of 0.3 or more that are no things for their
  // confidence alone.
  int unsure = 0;
  double unsure_confidence = 0;  // the largest of theirs
  double voxel_size_u = 0;
};

// Changed points (by label where there are labels, else by distance; T1's are removed, T2's added)
// in touching voxels are one region, divided where it is thin (split_region.h); each part that is
// large enough and likely to be a thing (thing_signs.h) is an instance. A point is uncertain by
// position_sigma of its depth, or by a voxel, whichever is more. A removed and an added instance
// that agree in shape and colour are one that moved, best agreement first. A thing that moved by
// less than its own size leaves two partial regions and is usually not recognised as moved.
ChangeInstances find_instances(const Reconstruction& before, const Reconstruction& after,
                               const Sim3& t2_from_t1, const ChangeSet& changes,
                               const InstanceOptions& options);

}  // namespace vggtcd
