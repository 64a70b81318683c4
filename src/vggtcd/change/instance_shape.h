// SPDX-License-Identifier: Apache-2.0
// Shape and look of a changed thing, measured on its points: box, volume, surface, colours.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "vggtcd/scene/point_cloud.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// Columns of rotation are the axes, in a right-handed frame; size is along them, largest first.
struct OrientedBox {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
};

// The principal axes of the points, and along each the range from the 1st to the 99th percentile:
// which way is up is not known. At least one point.
OrientedBox principal_box(std::span<const Eigen::Vector3f> points);

// How a photo projects points of the T2 frame, with its depths in T2 units.
struct PosedView {
  Rigid3 camera_from_t2;
  Pinhole pinhole;
  double depth_scale = 1;  // T2 units per unit of the depths
  std::span<const float> depth;
  std::span<const uint8_t>
      sky{};  // Reconstruction::sky of the photo; the open sky is infinitely far
};
std::vector<PosedView> posed_views(const Reconstruction& epoch, const Sim3& t2_from_epoch);

// A point, and the view that it was seen in.
struct SeenPoint {
  Eigen::Vector3f x_in_t2;
  size_t view = 0;
};

// What the photos of a thing's own epoch say about a sample of its points, each asked by all views
// but the one that shows it.
struct OwnTestimony {
  // Of the views that the points are not hidden from, the share that looks through them: sees only
  // depths more than 3 % beyond, in the 3 x 3 pixels around. Surface is seen by all of them; a
  // point that flies between an edge and what lies behind it, or a photo that went wrong, is
  // contradicted by its own epoch. 0 if no view can tell.
  double seen_through = 0;
  // Of the views that see the points' surface, within 3 %, and judged it, the share that calls it
  // changed. 0 if no view can tell.
  double called_changed = 0;
};
// Whether a pixel of a view is called changed; nothing where it was not judged.
using PixelVerdict = std::function<std::optional<bool>(size_t view, size_t pixel)>;
OwnTestimony own_testimony(std::span<const SeenPoint> points, std::span<const PosedView> views,
                           const PixelVerdict& changed);

// The space in which something is in one epoch and nothing in the other: cells of a regular grid
// (about cells_across along the longest edge) before whose centre no view of `own` sees a surface
// farther away than margin_u, and some view of `other` does. So it reaches from the surface that
// was seen to whatever the other epoch sees behind it. Where `other` is empty the first half
// decides alone. Bounded by the box, grown where it is thinner than its middle edge by the
// difference on both sides. Returns the volume (T2 units cubed) and the box grown to hold the
// cells, its edges in order again.
struct ChangedSpace {
  double volume_u3 = 0;
  OrientedBox box;
};
ChangedSpace changed_space(const OrientedBox& box, std::span<const PosedView> own,
                           std::span<const PosedView> other, double margin_u, int cells_across);

// The surface that the views see of a thing, from a sample of its pixels that each stand for
// `weight` pixels. Several views see a piece of it, and their pixels share its area out by how well
// they do: a pixel counts area c^2 / sum_k c_k^2, c the cosine of the angle between ray and normal,
// k the views that see the piece. No voxels, which count a surface again wherever photos misplace
// it. A view sees a piece that faces it if one of its pixels there, or next to it by 1/160 of its
// width, is the thing's (is_member), at a depth within 6 %: as far as photos misplace a surface.
// The deviation is the jackknife's over the views (the surface without each of them), and that of
// an outline that is off by half such a step in all of them.
struct SeenPixel {
  Eigen::Vector3f x_in_t2;
  size_t view = 0;
  int u_px = 0, v_px = 0;
};
struct SeenSurface {
  double area_u2 = 0, sigma_u2 = 0;
};
SeenSurface seen_surface(std::span<const SeenPixel> sample, double weight,
                         std::span<const PosedView> views,
                         const std::function<bool(size_t view, size_t pixel)>& is_member);

// The area of surface that a pixel covers, T2 units squared: the parallelogram of its depth
// gradient over 1/160 of the photo's width, at most five times the
// area of a surface that faces the camera; the latter at a jump in depth.
double pixel_area(const PosedView& view, int u_px, int v_px);

// A histogram of colours, relative to the mean colour of all: 5 x 5 x 5 bins, sum 1. A colour is
// shared out to the eight nearest bins, so that a little more light changes little.
using ColorHistogram = std::array<float, 125>;
struct ColorSum {
  std::array<double, 125> bins{};
  int64_t count = 0;
  void add(const uint8_t* rgb, const Eigen::Vector3f& mean_rgb);
  ColorHistogram normalized() const;
};
// The mean colour of a sample of all pixels of an epoch, at least 1 per channel: what its light and
// exposure are.
Eigen::Vector3f mean_color(const Reconstruction& epoch);
// The common part of two histograms, 0 to 1.
double histogram_intersection(const ColorHistogram& a, const ColorHistogram& b);

}  // namespace vggtcd
