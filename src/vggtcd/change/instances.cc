// SPDX-License-Identifier: Apache-2.0
// Changes as things: connected regions of changed points, measured, paired and ranked.
#include "vggtcd/change/instances.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "vggtcd/change/split_region.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/geometry/voxel_components.h"

namespace vggtcd {
namespace {

constexpr size_t kBestPhotos = 3;
// From this confidence on a region is worth a word: of those from 0.3 to 0.5 half have changed.
constexpr double kUnsure = 0.3;
constexpr double kWithoutVotes = 0.8;  // how sure the distance is of a pixel
constexpr size_t kCarvingPhotos =
    8;  // photos that look through the box, those that show most of it
constexpr int kCellsAcross = 32;
constexpr double kBoxDensity = 0.5;       // of the median points per voxel
constexpr size_t kSurfacePoints = 2000;   // of a thing whose surface is added up
constexpr size_t kTestimonyPoints = 300;  // of a thing that its own epoch is asked about

struct Pixel {
  int frame, u, v;
};
Pixel pixel_at(const Reconstruction& epoch, uint32_t pixel) {
  const size_t per_frame = epoch.pixels_per_frame();
  const int in_frame = static_cast<int>(pixel % per_frame);
  return {static_cast<int>(pixel / per_frame), in_frame % epoch.width, in_frame / epoch.width};
}

// The changed points of one epoch, and what is found in them.
class EpochRegions {
 public:
  EpochRegions(const Reconstruction& epoch, const Sim3& t2_from_epoch, const EpochChange& change,
               std::vector<PosedView> others, const ChangeSet& changes,
               const InstanceOptions& options)
      : epoch_(epoch),
        change_(change),
        views_(posed_views(epoch, t2_from_epoch)),
        others_(std::move(others)) {
    collect(t2_from_epoch, changes);
    voxel_size_ = options.link_fraction * changes.scene_extent_u;
    components_ = connected_components(positions_, voxel_size_, options.min_voxel_points);
    position_sigma_u_ = std::max(voxel_size_ / std::sqrt(12.0), changes.surface_sigma_u);
    margin_u_ = changes.surface_sigma_u;
    group();
    split_touching(changes, options);
    const Eigen::Vector3f mean = mean_color(epoch);
    std::vector<std::optional<InstancePart>> parts(members_.size());
    std::vector<double> unsure(members_.size(), 0);
    parallel_for(static_cast<int64_t>(members_.size()), 1, [&](int64_t i, int64_t) {
      const size_t region = static_cast<size_t>(i);
      const auto& members = members_[region];
      const std::optional<ThingSigns> signs = signs_of(members, changes, options);
      if (!signs) return;
      const double confidence = thing_probability(*signs);
      if (confidence >= options.min_confidence) {
        parts[region] = measure(members, *signs, mean);
      } else if (signs->photos_with_body > 0 && confidence >= kUnsure) {
        unsure[region] = confidence;
      }
    });
    for (size_t i = 0; i < parts.size(); ++i) {
      unsure_ += unsure[i] > 0 ? 1 : 0;
      unsure_confidence_ = std::max(unsure_confidence_, unsure[i]);
      if (!parts[i]) continue;
      parts_.push_back(std::move(*parts[i]));
      kept_.push_back(i);
    }
  }

  const std::vector<InstancePart>& parts() const { return parts_; }
  int unsure() const { return unsure_; }
  double unsure_confidence() const { return unsure_confidence_; }

  // Writes the id of part i, ids[i], to its pixels.
  std::vector<int32_t> id_map(const std::vector<int32_t>& ids) const {
    std::vector<int32_t> map(epoch_.num_pixels(), 0);
    for (size_t i = 0; i < kept_.size(); ++i) {
      for (const uint32_t member : members_[kept_[i]]) map[pixels_[member]] = ids[i];
    }
    return map;
  }

 private:
  void collect(const Sim3& t2_from_epoch, const ChangeSet& changes) {
    for (int frame = 0; frame < epoch_.num_frames(); ++frame) {
      const PixelRays rays(epoch_.views[static_cast<size_t>(frame)], t2_from_epoch);
      size_t pixel = static_cast<size_t>(frame) * epoch_.pixels_per_frame();
      for (int v = 0; v < epoch_.height; ++v) {
        for (int u = 0; u < epoch_.width; ++u, ++pixel) {
          if (!(epoch_.depth[pixel] > 0) || !changes.changed(change_, pixel)) continue;
          positions_.push_back(rays.point(u, v, epoch_.depth[pixel]));
          pixels_.push_back(static_cast<uint32_t>(pixel));
        }
      }
    }
    check(change_.changed_confidence.empty() ||
              change_.changed_confidence.size() == positions_.size(),
          "find_instances: a confidence for every changed pixel");
  }

  void group() {
    members_.resize(static_cast<size_t>(components_.num_components));
    for (uint32_t i = 0; i < positions_.size(); ++i) {
      if (components_.component[i] >= 0) {
        members_[static_cast<size_t>(components_.component[i])].push_back(i);
      }
    }
  }

  void split_touching(const ChangeSet& changes, const InstanceOptions& options) {
    std::vector<std::vector<RegionPoints>> parts(members_.size());
    parallel_for(static_cast<int64_t>(members_.size()), 1, [&](int64_t i, int64_t) {
      parts[static_cast<size_t>(i)] =
          split_region(members_[static_cast<size_t>(i)], positions_, components_.voxel, voxel_size_,
                       options.split_density,
                       [&](const RegionPoints& core) { return is_thing(core, changes, options); });
    });
    members_.clear();
    for (std::vector<RegionPoints>& of_region : parts) {
      std::ranges::move(of_region, std::back_inserter(members_));
    }
  }

  // Whether the points are a thing, and not noise: enough of them, of one place, that the photos of
  // the own epoch agree on.
  bool is_thing(const RegionPoints& members, const ChangeSet& changes,
                const InstanceOptions& options) const {
    const std::optional<ThingSigns> signs = signs_of(members, changes, options);
    return signs && thing_probability(*signs) >= options.min_confidence;
  }

  // Nothing where the points are too few or their box is no thing's; what is dear to know comes
  // last.
  std::optional<ThingSigns> signs_of(const RegionPoints& members, const ChangeSet& changes,
                                     const InstanceOptions& options) const {
    if (members.size() < static_cast<size_t>(options.min_instance_points)) return {};
    ThingSigns signs;
    const std::vector<Eigen::Vector3f> voxels = voxel_means(members, positions_, components_.voxel);
    const OrientedBox box = principal_box(voxels);
    const double face = std::max(voxel_size_, box.size[0]) * std::max(voxel_size_, box.size[1]);
    signs.fill = static_cast<double>(voxels.size()) * voxel_size_ * voxel_size_ / face;
    signs.length = box.size[0] / changes.scene_extent_u;
    signs.width = box.size[1] / changes.scene_extent_u;
    if (signs.length < options.min_size_fraction || signs.width < options.min_width_fraction ||
        signs.fill < options.min_fill) {
      return {};
    }
    std::vector<uint32_t> pixels;
    pixels.reserve(members.size());
    for (const uint32_t i : members) pixels.push_back(pixels_[i]);
    add_body(epoch_, pixels, signs);
    if (signs.photos < options.min_photos) return {};
    signs.pixel_confidence =
        change_.changed_confidence.empty() ? kWithoutVotes : mean_confidence(members);
    if (!change_.changed_evidence.empty()) {
      for (const uint32_t i : members) {
        signs.evidence += static_cast<double>(change_.changed_evidence[i]);
      }
      signs.evidence /= static_cast<double>(members.size());
    }
    const OwnTestimony own = ask_own_epoch(members, changes);
    signs.seen_through = own.seen_through;
    signs.called_changed = own.called_changed;
    return signs;
  }

  OwnTestimony ask_own_epoch(const RegionPoints& members, const ChangeSet& changes) const {
    const size_t step = std::max<size_t>(1, members.size() / kTestimonyPoints);
    std::vector<SeenPoint> sample;
    for (size_t k = step / 2; k < members.size(); k += step) {
      const uint32_t i = members[k];
      sample.push_back({positions_[i], pixels_[i] / epoch_.pixels_per_frame()});
    }
    return own_testimony(sample, views_, [&](size_t view, size_t in_view) -> std::optional<bool> {
      const size_t pixel = view * epoch_.pixels_per_frame() + in_view;
      if (change_.label.empty() ? std::isnan(change_.score[pixel])
                                : change_.label[pixel] == ChangeLabel::kNoEvidence) {
        return {};
      }
      return changes.changed(change_, pixel);
    });
  }

  InstancePart measure(const RegionPoints& members, const ThingSigns& signs,
                       const Eigen::Vector3f& mean) const {
    InstancePart part;
    part.signs = signs;
    part.confidence = thing_probability(signs);
    part.pixels = static_cast<int64_t>(members.size());
    // Strays would stretch the box.
    const RegionPoints dense = dense_points(members, components_.voxel, kBoxDensity);
    part.box = principal_box(voxel_means(dense, positions_, components_.voxel));
    part.colors = colors(members, mean);

    std::vector<InstancePhoto> photos = photos_of(members);
    std::vector<PosedView> own;
    for (size_t k = 0; k < std::min(kCarvingPhotos, photos.size()); ++k) {
      own.push_back(views_[static_cast<size_t>(photos[k].frame)]);
    }
    photos.resize(std::min(kBestPhotos, photos.size()));
    part.photos = std::move(photos);

    const ChangedSpace space =
        changed_space(part.box, own, others_that_see(part.box.center), margin_u_, kCellsAcross);
    part.volume_u3 = space.volume_u3;
    part.box = space.box;
    const SeenSurface seen = surface(members);
    part.surface_u2 = seen.area_u2;
    // A body whose whole surface, about twice what is seen, moves by sigma: dV = 2 S sigma; of one
    // radius r, dS / S = 2 sigma / r.
    const double radius = std::max(voxel_size_, std::cbrt(part.volume_u3));
    part.volume_sigma_u3 = 2 * part.surface_u2 * position_sigma_u_;
    part.surface_sigma_u2 =
        std::hypot(seen.sigma_u2, part.surface_u2 * 2 * position_sigma_u_ / radius);
    return part;
  }

  // Evenly chosen among those whose photo contains the point.
  std::vector<PosedView> others_that_see(const Eigen::Vector3d& x) const {
    std::vector<PosedView> seeing, chosen;
    for (const PosedView& view : others_) {
      const Eigen::Vector3d in_camera = view.camera_from_t2 * x;
      if (!(in_camera.z() > 0)) continue;
      const Eigen::Vector2d uv = view.pinhole.project(in_camera);
      if (view.pinhole.contains(uv.x(), uv.y())) seeing.push_back(view);
    }
    const size_t count = std::min(kCarvingPhotos, seeing.size());
    for (size_t k = 0; k < count; ++k) chosen.push_back(seeing[k * seeing.size() / count]);
    return chosen;
  }

  double confidence_of(uint32_t point) const {
    const std::vector<float>& known = change_.changed_confidence;
    return known.empty() ? 1.0 : static_cast<double>(known[point]);
  }

  double mean_confidence(const RegionPoints& members) const {
    double sum = 0;
    for (const uint32_t i : members) sum += confidence_of(i);
    return sum / static_cast<double>(members.size());
  }

  ColorHistogram colors(const RegionPoints& members, const Eigen::Vector3f& mean) const {
    ColorSum sum;
    for (const uint32_t i : members) sum.add(&epoch_.color[3 * size_t{pixels_[i]}], mean);
    return sum.normalized();
  }

  std::vector<InstancePhoto> photos_of(const RegionPoints& members) const {
    std::vector<InstancePhoto> photos;  // members are in pixel order, so photo by photo
    for (const uint32_t i : members) {
      const int frame = pixel_at(epoch_, pixels_[i]).frame;
      if (photos.empty() || photos.back().frame != frame) photos.push_back({frame, 0, 0});
      ++photos.back().pixels;
      photos.back().evidence += confidence_of(i);
    }
    std::ranges::stable_sort(photos, std::greater{}, &InstancePhoto::evidence);
    return photos;
  }

  SeenSurface surface(const RegionPoints& members) const {
    const size_t step = std::max<size_t>(1, members.size() / kSurfacePoints);
    std::vector<SeenPixel> sample;
    for (size_t k = step / 2; k < members.size(); k += step) {
      const Pixel at = pixel_at(epoch_, pixels_[members[k]]);
      sample.push_back({positions_[members[k]], static_cast<size_t>(at.frame), at.u, at.v});
    }
    const double weight = static_cast<double>(members.size()) / static_cast<double>(sample.size());
    return seen_surface(sample, weight, views_, [&](size_t view, size_t in_view) {
      const size_t pixel = view * epoch_.pixels_per_frame() + in_view;
      // Members are in pixel order.
      return std::ranges::binary_search(members, pixel, {},
                                        [&](uint32_t i) { return size_t{pixels_[i]}; });
    });
  }

  const Reconstruction& epoch_;
  const EpochChange& change_;
  std::vector<PosedView> views_, others_;
  double voxel_size_ = 0, position_sigma_u_ = 0, margin_u_ = 0;
  std::vector<Eigen::Vector3f> positions_;  // of the changed points, T2, in pixel order
  std::vector<uint32_t> pixels_;
  VoxelComponents components_;
  std::vector<RegionPoints> members_;  // points of each region or part, in pixel order
  std::vector<InstancePart> parts_;
  std::vector<size_t> kept_;  // members of each part that is a thing
  int unsure_ = 0;
  double unsure_confidence_ = 0;
};

// How well two things agree; 0 if they are not the same thing.
double agreement(const InstancePart& a, const InstancePart& b, const InstanceOptions& options) {
  double shape = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double ratio =
        std::min(a.box.size[axis], b.box.size[axis]) / std::max(a.box.size[axis], b.box.size[axis]);
    // The shortest edge is the depth of what could be seen, which depends on the photos.
    if (axis < 2 && ratio < options.move_shape_ratio) return 0;
    shape *= ratio;
  }
  const double colors = histogram_intersection(a.colors, b.colors);
  return colors < options.move_color_overlap ? 0 : std::cbrt(shape) * colors;
}

struct Pair {
  size_t removed, added;
  double agreement;
};

// The pairs of things that moved, each thing at most once, best agreement first.
std::vector<Pair> match_moved(const std::vector<InstancePart>& removed,
                              const std::vector<InstancePart>& added,
                              const InstanceOptions& options) {
  std::vector<Pair> candidates, pairs;
  for (size_t r = 0; r < removed.size(); ++r) {
    for (size_t a = 0; a < added.size(); ++a) {
      const double value = agreement(removed[r], added[a], options);
      if (value > 0) candidates.push_back({r, a, value});
    }
  }
  std::ranges::stable_sort(candidates, std::greater{}, &Pair::agreement);
  std::vector<bool> removed_taken(removed.size()), added_taken(added.size());
  for (const Pair& pair : candidates) {
    if (removed_taken[pair.removed] || added_taken[pair.added]) continue;
    removed_taken[pair.removed] = added_taken[pair.added] = true;
    pairs.push_back(pair);
  }
  return pairs;
}

}  // namespace

void InstanceOptions::validate() const {
  check_field(link_fraction > 0, "link_fraction", link_fraction, "a positive number");
  check_field(min_voxel_points >= 1, "min_voxel_points", min_voxel_points, "at least 1");
  check_field(split_density >= 0, "split_density", split_density, "at least 0");
  check_field(min_size_fraction >= 0, "min_size_fraction", min_size_fraction, "at least 0");
  check_field(min_width_fraction >= 0, "min_width_fraction", min_width_fraction, "at least 0");
  check_field(min_fill >= 0, "min_fill", min_fill, "at least 0");
  check_field(min_photos >= 1, "min_photos", min_photos, "at least 1");
  check_field(min_confidence >= 0 && min_confidence <= 1, "min_confidence", min_confidence,
              "a number in [0, 1]");
  check_field(min_instance_points >= 1, "min_instance_points", min_instance_points, "at least 1");
  check_field(move_shape_ratio > 0 && move_shape_ratio <= 1, "move_shape_ratio", move_shape_ratio,
              "a number in (0, 1]");
  check_field(move_color_overlap > 0 && move_color_overlap <= 1, "move_color_overlap",
              move_color_overlap, "a number in (0, 1]");
}

std::span<const EnumName<InstanceClass>> enum_names(InstanceClass) {
  static constexpr EnumName<InstanceClass> kNames[] = {{InstanceClass::kRemoved, "removed"},
                                                       {InstanceClass::kAdded, "added"},
                                                       {InstanceClass::kMoved, "moved"}};
  return kNames;
}

double ChangeInstance::confidence() const {
  if (before && after) return 0.5 * (before->confidence + after->confidence);
  return main().confidence;
}

ChangeInstances find_instances(const Reconstruction& before, const Reconstruction& after,
                               const Sim3& t2_from_t1, const ChangeSet& changes,
                               const InstanceOptions& options) {
  options.validate();
  const EpochRegions t1(before, t2_from_t1, changes.t1, posed_views(after, {}), changes, options);
  const EpochRegions t2(after, {}, changes.t2, posed_views(before, t2_from_t1), changes, options);

  // Which part of either epoch each instance has; -1: none.
  struct Draft {
    ChangeInstance instance;
    int64_t part_t1 = -1, part_t2 = -1;
  };
  std::vector<Draft> drafts;
  std::vector<bool> moved_t1(t1.parts().size()), moved_t2(t2.parts().size());
  for (const Pair& pair : match_moved(t1.parts(), t2.parts(), options)) {
    moved_t1[pair.removed] = moved_t2[pair.added] = true;
    drafts.push_back({{InstanceClass::kMoved, t1.parts()[pair.removed], t2.parts()[pair.added]},
                      static_cast<int64_t>(pair.removed),
                      static_cast<int64_t>(pair.added)});
  }
  for (size_t i = 0; i < t1.parts().size(); ++i) {
    if (moved_t1[i]) continue;
    drafts.push_back({{InstanceClass::kRemoved, t1.parts()[i], {}}, static_cast<int64_t>(i), -1});
  }
  for (size_t i = 0; i < t2.parts().size(); ++i) {
    if (moved_t2[i]) continue;
    drafts.push_back({{InstanceClass::kAdded, {}, t2.parts()[i]}, -1, static_cast<int64_t>(i)});
  }
  std::ranges::stable_sort(drafts, std::greater{},
                           [](const Draft& draft) { return draft.instance.rank(); });

  ChangeInstances result;
  result.voxel_size_u = options.link_fraction * changes.scene_extent_u;
  result.unsure = t1.unsure() + t2.unsure();
  result.unsure_confidence = std::max(t1.unsure_confidence(), t2.unsure_confidence());
  std::vector<int32_t> ids_t1(t1.parts().size()), ids_t2(t2.parts().size());
  for (Draft& draft : drafts) {
    result.instances.push_back(std::move(draft.instance));
    const int32_t id = static_cast<int32_t>(result.instances.size());
    if (draft.part_t1 >= 0) ids_t1[static_cast<size_t>(draft.part_t1)] = id;
    if (draft.part_t2 >= 0) ids_t2[static_cast<size_t>(draft.part_t2)] = id;
  }
  result.id_t1 = t1.id_map(ids_t1);
  result.id_t2 = t2.id_map(ids_t2);
  return result;
}

}  // namespace vggtcd
