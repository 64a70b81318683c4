// SPDX-License-Identifier: Apache-2.0
// Shape and look of a changed thing, measured on its points.
#include "vggtcd/change/instance_shape.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/geometry/order_statistics.h"
#include "vggtcd/scene/sky.h"

namespace vggtcd {
namespace {

constexpr double kLowPercent = 1, kHighPercent = 99;
constexpr double kMaxSlope = 5;            // a surface seen more obliquely counts as this oblique
constexpr double kJump = 0.05;             // relative step in depth that is an edge, not a slope
constexpr int kColorBins = 5;              // per channel
constexpr float kBrightest = 2.5f;         // times the mean; brighter falls into the last bin
constexpr double kOtherSurface = 0.03;     // relative: depths closer than this are one surface
constexpr double kMisplaced = 0.06;        // relative: as far as photos put one surface apart
constexpr double kMinSight = 0.01;         // of the view that shows a point
constexpr double kStepsAcross = 160;       // see photo_step
constexpr size_t kColorStride = 97;        // every 97th pixel is looked at for the mean colour
constexpr double kMinRelativeEdge = 1e-3;  // of the longest edge: no box is without thickness

// The depth at a pixel in T2 units; 0: none, or not in the photo; infinite in the open sky.
double depth_at(const PosedView& view, int u, int v) {
  if (u < 0 || v < 0 || u >= view.pinhole.width || v >= view.pinhole.height) return 0;
  const size_t pixel =
      static_cast<size_t>(v) * static_cast<size_t>(view.pinhole.width) + static_cast<size_t>(u);
  if (!view.sky.empty() && view.sky[pixel] == kOpenSky) {
    return std::numeric_limits<double>::infinity();
  }
  return view.depth_scale * static_cast<double>(view.depth[pixel]);
}

// Whether one of the views looks through the point: it is in the photo, and the surface there is
// farther away.
bool seen_through(std::span<const PosedView> views, const Eigen::Vector3d& x, double margin_u) {
  return std::ranges::any_of(views, [&](const PosedView& view) {
    const Eigen::Vector3d in_camera = view.camera_from_t2 * x;
    if (!(in_camera.z() > 0)) return false;
    const Eigen::Vector2d uv = view.pinhole.project(in_camera);
    if (!view.pinhole.contains(uv.x(), uv.y())) return false;
    const double depth = depth_at(view, static_cast<int>(std::lround(uv.x())),
                                  static_cast<int>(std::lround(uv.y())));
    return in_camera.z() + margin_u < depth;
  });
}

// The nearest and the farthest depth of the 3 x 3 pixels around one that is not on the rim.
std::pair<double, double> window_of(const PosedView& view, int u, int v) {
  double near = std::numeric_limits<double>::max(), far = 0;
  for (int y = v - 1; y <= v + 1; ++y) {
    for (int x = u - 1; x <= u + 1; ++x) {
      const double depth = depth_at(view, x, y);
      near = std::min(near, depth);
      far = std::max(far, depth);
    }
  }
  return {near, far};
}

struct Share {
  int64_t yes = 0, all = 0;
  void add(bool is) {
    yes += is ? 1 : 0;
    ++all;
  }
  double value() const { return all > 0 ? static_cast<double>(yes) / static_cast<double>(all) : 0; }
};

// By how many pixels photos misplace a surface against each other: 1/160 of their width.
int photo_step(const PosedView& view) {
  return std::max(1, static_cast<int>(std::lround(view.pinhole.width / kStepsAcross)));
}

// How well a view sees the surface at x: the squared cosine of the angle between its ray and the
// normal if a pixel next to x is a member and shows that surface, else 0.
double sight_of(const PosedView& view, size_t index, const Eigen::Vector3d& x,
                const Eigen::Vector3d& normal,
                const std::function<bool(size_t view, size_t pixel)>& is_member) {
  const Eigen::Vector3d in_camera = view.camera_from_t2 * x;
  const double cosine = -(view.camera_from_t2.rotation * normal).dot(in_camera.normalized());
  if (!(in_camera.z() > 0) || !(cosine > 0)) return 0;
  const Eigen::Vector2d uv = view.pinhole.project(in_camera);
  if (!view.pinhole.contains(uv.x(), uv.y())) return 0;
  const int u = static_cast<int>(std::lround(uv.x())), v = static_cast<int>(std::lround(uv.y()));
  const int reach = photo_step(view);
  for (int y = v - reach; y <= v + reach; ++y) {
    for (int i = u - reach; i <= u + reach; ++i) {
      const double depth = depth_at(view, i, y);
      if (depth > 0 && std::abs(depth - in_camera.z()) <= kMisplaced * in_camera.z() &&
          is_member(index, static_cast<size_t>(y * view.pinhole.width + i))) {
        return cosine * cosine;
      }
    }
  }
  return 0;
}

// The range of layers [first, last) without the outermost ones that together hold less than 1 % of
// all cells at either end.
std::pair<int, int> without_strays(const std::vector<int64_t>& layers, int64_t cells) {
  const int n = static_cast<int>(layers.size());
  int first = 0, last = n;
  int64_t before = 0, behind = 0;
  while (first < n && 100 * (before + layers[static_cast<size_t>(first)]) <= cells) {
    before += layers[static_cast<size_t>(first++)];
  }
  while (last > first && 100 * (behind + layers[static_cast<size_t>(last - 1)]) <= cells) {
    behind += layers[static_cast<size_t>(--last)];
  }
  return {first, last};
}

// The step in depth to the next pixel along (du, dv): of those to either side that are no edge the
// smaller one, because noise and the rim of a thing look like slopes; NaN: none.
double depth_step(const PosedView& view, int u, int v, int du, int dv) {
  const double here = depth_at(view, u, v);
  double step = std::numeric_limits<double>::quiet_NaN();
  for (const int sign : {-1, 1}) {
    const double there = depth_at(view, u + sign * du, v + sign * dv);
    if (!(there > 0) || std::abs(there - here) > kJump * here) continue;
    const double own = sign * (there - here);
    if (!(std::abs(step) <= std::abs(own))) step = own;
  }
  return step;
}

// The normal of the surface at a pixel, in the camera and towards it, as long as the area that the
// pixel covers is large.
Eigen::Vector3d surface_element(const PosedView& view, int u_px, int v_px) {
  const double z = depth_at(view, u_px, v_px);
  const Pinhole& k = view.pinhole;
  const double facing = z * z / (k.fx * k.fy);
  const int step = photo_step(view);
  const double along_u = depth_step(view, u_px, v_px, step, 0) / step;
  const double along_v = depth_step(view, u_px, v_px, 0, step) / step;
  const Eigen::Vector3d ray = k.unproject(u_px, v_px, 1.0);
  if (std::isnan(along_u) || std::isnan(along_v)) return -facing * ray.normalized();
  // The derivatives of the point z (x, y, 1), x = (u - cx) / fx, y = (v - cy) / fy.
  const Eigen::Vector3d du = along_u * ray + Eigen::Vector3d(z / k.fx, 0, 0);
  const Eigen::Vector3d dv = along_v * ray + Eigen::Vector3d(0, z / k.fy, 0);
  const Eigen::Vector3d element = dv.cross(du);
  return element * std::min(1.0, kMaxSlope * facing / element.norm());
}

// The same box with its axes in the order of their lengths, right-handed.
OrientedBox largest_first(const OrientedBox& box) {
  std::array<int, 3> order = {0, 1, 2};
  std::ranges::stable_sort(order, [&](int a, int b) { return box.size[a] > box.size[b]; });
  OrientedBox sorted = box;
  for (int k = 0; k < 3; ++k) {
    const int axis = order[static_cast<size_t>(k)];
    sorted.rotation.col(k) = box.rotation.col(axis);
    sorted.size[k] = box.size[axis];
  }
  if (sorted.rotation.determinant() < 0) sorted.rotation.col(2) = -sorted.rotation.col(2);
  return sorted;
}

}  // namespace

OrientedBox principal_box(std::span<const Eigen::Vector3f> points) {
  check(!points.empty(), "principal_box: at least one point");
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& x : points) mean += x.cast<double>();
  mean /= static_cast<double>(points.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3f& x : points) {
    const Eigen::Vector3d d = x.cast<double>() - mean;
    covariance += d * d.transpose();
  }
  const Eigen::Matrix3d axes =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors();  // ascending
  std::vector<Eigen::Vector3f> along;
  along.reserve(points.size());
  for (const Eigen::Vector3f& x : points) {
    along.push_back((axes.transpose() * (x.cast<double>() - mean)).cast<float>());
  }
  const double percents[] = {kLowPercent, kHighPercent};
  const Eigen::Matrix3Xd range = percentiles(along, percents);
  const Eigen::Vector3d center = mean + axes * (0.5 * (range.col(0) + range.col(1)));
  const Eigen::Vector3d size = range.col(1) - range.col(0);
  OrientedBox box = largest_first({center, axes.rowwise().reverse(), size.reverse()});
  box.size = box.size.cwiseMax(kMinRelativeEdge * box.size[0]);
  return box;
}

std::vector<PosedView> posed_views(const Reconstruction& epoch, const Sim3& t2_from_epoch) {
  std::vector<PosedView> views;
  for (int frame = 0; frame < epoch.num_frames(); ++frame) {
    const View& view = epoch.views[static_cast<size_t>(frame)];
    views.push_back({camera_from_new_world(view.camera_from_world, t2_from_epoch), view.pinhole,
                     t2_from_epoch.scale, epoch.frame_depth(frame), epoch.frame_sky(frame)});
  }
  return views;
}

OwnTestimony own_testimony(std::span<const SeenPoint> points, std::span<const PosedView> views,
                           const PixelVerdict& changed) {
  Share through, called;
  for (const SeenPoint& point : points) {
    for (size_t k = 0; k < views.size(); ++k) {
      if (k == point.view) continue;
      const PosedView& view = views[k];
      const Eigen::Vector3d x = view.camera_from_t2 * point.x_in_t2.cast<double>();
      if (!(x.z() > 0)) continue;
      const Eigen::Vector2d uv = view.pinhole.project(x);
      const int width = view.pinhole.width;
      const int u = static_cast<int>(std::lround(uv.x())),
                v = static_cast<int>(std::lround(uv.y()));
      if (u < 1 || v < 1 || u >= width - 1 || v >= view.pinhole.height - 1) continue;
      const auto [near, far] = window_of(view, u, v);
      const double tolerance = kOtherSurface * x.z();
      if (x.z() - far <= tolerance) through.add(near - x.z() > tolerance);  // else hidden
      const double depth = depth_at(view, u, v);
      if (!(depth > 0) || std::abs(depth - x.z()) > tolerance) continue;
      const auto verdict = changed(k, static_cast<size_t>(v * width + u));
      if (verdict) called.add(*verdict);
    }
  }
  return {through.value(), called.value()};
}

ChangedSpace changed_space(const OrientedBox& box, std::span<const PosedView> own,
                           std::span<const PosedView> other, double margin_u, int cells_across) {
  if (!(box.size[0] > 0)) return {0, box};
  const Eigen::Vector3d size = box.size + 2 * (box.size[1] - box.size.array()).max(0.0).matrix();
  const Eigen::Array3i cells =
      (size.array() * (cells_across / box.size[0])).round().max(1.0).cast<int>();
  const Eigen::Vector3d step = size.array() / cells.cast<double>();
  std::array<std::vector<int64_t>, 3> layers;  // changed cells of each layer across an axis
  for (int axis = 0; axis < 3; ++axis)
    layers[static_cast<size_t>(axis)].resize(static_cast<size_t>(cells[axis]));
  int64_t solid = 0;
  for (int i = 0; i < cells[0]; ++i) {
    for (int j = 0; j < cells[1]; ++j) {
      for (int k = 0; k < cells[2]; ++k) {
        const Eigen::Vector3d in_box =
            step.cwiseProduct(Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5)) - 0.5 * size;
        const Eigen::Vector3d x = box.center + box.rotation * in_box;
        if (seen_through(own, x, margin_u)) continue;
        if (!other.empty() && !seen_through(other, x, margin_u)) continue;
        ++solid;
        ++layers[0][static_cast<size_t>(i)];
        ++layers[1][static_cast<size_t>(j)];
        ++layers[2][static_cast<size_t>(k)];
      }
    }
  }
  if (solid == 0) return {0, box};
  Eigen::Vector3d low = -0.5 * box.size, high = 0.5 * box.size;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [first, last] = without_strays(layers[static_cast<size_t>(axis)], solid);
    low[axis] = std::min(low[axis], first * step[axis] - 0.5 * size[axis]);
    high[axis] = std::max(high[axis], last * step[axis] - 0.5 * size[axis]);
  }
  OrientedBox grown = box;
  grown.center += box.rotation * (0.5 * (low + high));
  grown.size = high - low;
  return {static_cast<double>(solid) * step.prod(), largest_first(grown)};
}

SeenSurface seen_surface(std::span<const SeenPixel> sample, double weight,
                         std::span<const PosedView> views,
                         const std::function<bool(size_t view, size_t pixel)>& is_member) {
  double total = 0;
  std::vector<double> lost(views.size());  // by leaving a view out
  std::vector<bool> shows(views.size());   // any of the sample
  std::vector<double> sight(views.size());
  for (const SeenPixel& point : sample) {
    const PosedView& own = views[point.view];
    const Eigen::Vector3d element = surface_element(own, point.u_px, point.v_px);
    const Eigen::Vector3d x = point.x_in_t2.cast<double>();
    const Eigen::Vector3d normal = own.camera_from_t2.rotation.transpose() * element.normalized();
    const double cosine = normal.dot((camera_center(own.camera_from_t2) - x).normalized());
    double sum = 0;
    for (size_t k = 0; k < views.size(); ++k) {
      sight[k] = k == point.view ? std::max(kMinSight, cosine * cosine)
                                 : sight_of(views[k], k, x, normal, is_member);
      sum += sight[k];
    }
    const double area = weight * element.norm() * sight[point.view];
    total += area / sum;
    shows[point.view] = true;
    for (size_t k = 0; k < views.size(); ++k) {
      if (k == point.view) {
        lost[k] += area / sum;
      } else if (sight[k] > 0) {
        lost[k] += area / sum - area / (sum - sight[k]);
      }
    }
  }
  if (sample.empty()) return {};
  const auto count = static_cast<double>(std::ranges::count(shows, true));
  double sum = 0, squares = 0;
  for (size_t k = 0; k < views.size(); ++k) {
    if (!shows[k]) continue;
    sum += lost[k];
    squares += lost[k] * lost[k];
  }
  const double jackknife = (count - 1) / count * (squares - sum * sum / count);
  // Half a step along the outline, 2 sqrt(pi m) pixels long where a photo shows m.
  const double pixels = weight * static_cast<double>(sample.size()) / count;
  const double outline = total * std::sqrt(M_PI / pixels) * photo_step(views[sample[0].view]);
  return {total, std::sqrt(std::max(0.0, jackknife) + outline * outline)};
}

double pixel_area(const PosedView& view, int u_px, int v_px) {
  return surface_element(view, u_px, v_px).norm();
}

void ColorSum::add(const uint8_t* rgb, const Eigen::Vector3f& mean_rgb) {
  std::array<size_t, 3> low{};
  std::array<float, 3> above{};  // share that goes to bin low + 1
  for (size_t c = 0; c < 3; ++c) {
    const float relative =
        static_cast<float>(rgb[c]) / (kBrightest * mean_rgb[static_cast<int>(c)]);
    const float position = std::min(relative, 1.0f) * (kColorBins - 1);
    low[c] = std::min<size_t>(static_cast<size_t>(position), kColorBins - 2);
    above[c] = position - static_cast<float>(low[c]);
  }
  for (size_t corner = 0; corner < 8; ++corner) {
    size_t bin = 0;
    float weight = 1;
    for (size_t c = 0; c < 3; ++c) {
      const size_t step = corner >> c & 1;
      bin = kColorBins * bin + low[c] + step;
      weight *= step == 1 ? above[c] : 1 - above[c];
    }
    bins[bin] += static_cast<double>(weight);
  }
  ++count;
}

ColorHistogram ColorSum::normalized() const {
  ColorHistogram histogram{};
  if (count == 0) return histogram;
  for (size_t i = 0; i < bins.size(); ++i) {
    histogram[i] = static_cast<float>(bins[i] / static_cast<double>(count));
  }
  return histogram;
}

Eigen::Vector3f mean_color(const Reconstruction& epoch) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int64_t count = 0;
  for (size_t pixel = 0; pixel < epoch.num_pixels(); pixel += kColorStride) {
    for (int c = 0; c < 3; ++c) {
      sum[c] += static_cast<double>(epoch.color[3 * pixel + static_cast<size_t>(c)]);
    }
    ++count;
  }
  return (sum / static_cast<double>(std::max<int64_t>(1, count))).cwiseMax(1.0).cast<float>();
}

double histogram_intersection(const ColorHistogram& a, const ColorHistogram& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += static_cast<double>(std::min(a[i], b[i]));
  return sum;
}

}  // namespace vggtcd
