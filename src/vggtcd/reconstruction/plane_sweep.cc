// SPDX-License-Identifier: Apache-2.0
// Plane sweep: every plane warps every source view once; all loops run along rows.
#include "vggtcd/reconstruction/plane_sweep.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

constexpr int kGroup = 16;   // planes that are scattered into the volume together
constexpr int kMaxBest = 3;  // best_views is at most this
constexpr float kNoScore = -2.0f;
// Below 1.5 grey levels a window has noise, not texture: the variance that is added to both.
constexpr float kNoiseVariance = 2.25f;

using Plane = std::vector<float>;

// Sums over windows of (2 r + 1)^2 px, cut at the border. Separable, running sums along columns.
class BoxSum {
 public:
  BoxSum(int width, int height, int radius)
      : width_(width),
        height_(height),
        radius_(radius),
        rows_(size()),
        column_(static_cast<size_t>(width)) {}

  void run(const Plane& in, Plane& out) {
    for (int y = 0; y < height_; ++y) sum_row(in.data() + at(y), rows_.data() + at(y));
    std::fill(column_.begin(), column_.end(), 0.0f);
    for (int y = 0; y < std::min(radius_, height_); ++y) add(y, 1.0f);
    for (int y = 0; y < height_; ++y) {
      if (y + radius_ < height_) add(y + radius_, 1.0f);
      if (y - radius_ - 1 >= 0) add(y - radius_ - 1, -1.0f);
      std::copy(column_.begin(), column_.end(), out.begin() + static_cast<std::ptrdiff_t>(at(y)));
    }
  }

 private:
  size_t size() const { return static_cast<size_t>(width_) * static_cast<size_t>(height_); }
  size_t at(int y) const { return static_cast<size_t>(y) * static_cast<size_t>(width_); }
  void add(int y, float sign) {
    const float* row = rows_.data() + at(y);
    for (int x = 0; x < width_; ++x) column_[static_cast<size_t>(x)] += sign * row[x];
  }
  void sum_row(const float* in, float* out) const {
    for (int x = 0; x < width_; ++x) out[x] = in[x];
    for (int shift = 1; shift <= radius_; ++shift) {
      for (int x = 0; x < width_ - shift; ++x) out[x] += in[x + shift];
      for (int x = shift; x < width_; ++x) out[x] += in[x - shift];
    }
  }
  int width_, height_, radius_;
  Plane rows_, column_;
};

// Pixel of a source view of the plane's point at reference pixel (u, v): (a + w b) projected, with
// a = K_s R K_r^-1 (u, v, 1) and b = K_s t, w inverse depth.
struct Warp {
  Eigen::Matrix3d a_from_pixel;
  Eigen::Vector3d b;
};

Warp warp_of(const GrayView& reference, const GrayView& source) {
  const Rigid3 source_from_reference =
      source.camera_from_world * reference.camera_from_world.inverse();
  return {source.pinhole.matrix() * source_from_reference.rotation *
              reference.pinhole.matrix().inverse(),
          source.pinhole.matrix() * source_from_reference.translation};
}

// The source's brightness (less `offset`) on the plane, 0 with mask 0 where it is not seen.
void warp_plane(const GrayView& source, const Warp& warp, double inverse_depth, float offset,
                int width, int height, Plane& out, Plane& mask) {
  const int source_width = source.pinhole.width, source_height = source.pinhole.height;
  const Eigen::Vector3f step = warp.a_from_pixel.col(0).cast<float>();
  for (int v = 0; v < height; ++v) {
    const Eigen::Vector3f row =
        (warp.a_from_pixel * Eigen::Vector3d(0, v, 1) + inverse_depth * warp.b).cast<float>();
    for (int u = 0; u < width; ++u) {
      const auto i = static_cast<size_t>(v) * static_cast<size_t>(width) + static_cast<size_t>(u);
      const Eigen::Vector3f x = row + static_cast<float>(u) * step;
      out[i] = 0;
      mask[i] = 0;
      if (x.z() <= 1e-9f) continue;
      const float su = x.x() / x.z(), sv = x.y() / x.z();
      if (!(su >= 0 && sv >= 0 && su < static_cast<float>(source_width - 1) &&
            sv < static_cast<float>(source_height - 1))) {
        continue;
      }
      const int iu = static_cast<int>(su), iv = static_cast<int>(sv);
      const float fu = su - static_cast<float>(iu), fv = sv - static_cast<float>(iv);
      const size_t j =
          static_cast<size_t>(iv) * static_cast<size_t>(source_width) + static_cast<size_t>(iu);
      if (!source.valid[j]) continue;
      const float* p = source.gray.data() + j;
      const float* q = p + source_width;
      const float top = p[0] + fu * (p[1] - p[0]), bottom = q[0] + fu * (q[1] - q[0]);
      out[i] = top + fv * (bottom - top) - offset;
      mask[i] = 1;
    }
  }
}

// Everything one sweep needs; windows where a source is not seen throughout are not scored.
class Sweep {
 public:
  Sweep(const GrayView& reference, const SweepOptions& options)
      : options_(options),
        width_(reference.pinhole.width),
        height_(reference.pinhole.height),
        box_(width_, height_, options.window_radius_px) {
    const size_t pixels = reference.gray.size();
    for (Plane* plane : {&mean_, &deviation_, &warped_, &mask_, &product_, &sum_, &sum_square_,
                         &sum_product_, &sum_mask_, &centered_}) {
      plane->resize(pixels);
    }
    // Brightness relative to its mean: sums of squares keep their digits.
    for (size_t i = 0; i < pixels; ++i) centered_[i] = reference.gray[i] - kMiddle;
    for (size_t i = 0; i < pixels; ++i) product_[i] = centered_[i] * centered_[i];
    box_.run(centered_, mean_);
    box_.run(product_, deviation_);
    const float n = window();
    for (size_t i = 0; i < pixels; ++i) {
      mean_[i] /= n;
      deviation_[i] =
          std::sqrt(std::max(0.0f, deviation_[i] / n - mean_[i] * mean_[i]) + kNoiseVariance);
    }
  }

  void score(const GrayView& source, const Warp& warp, double inverse_depth,
             std::array<Plane, kMaxBest>& best) {
    warp_plane(source, warp, inverse_depth, kMiddle, width_, height_, warped_, mask_);
    const size_t pixels = warped_.size();
    box_.run(mask_, sum_mask_);
    box_.run(warped_, sum_);
    for (size_t i = 0; i < pixels; ++i) product_[i] = warped_[i] * warped_[i];
    box_.run(product_, sum_square_);
    for (size_t i = 0; i < pixels; ++i) product_[i] = warped_[i] * centered_[i];
    box_.run(product_, sum_product_);
    const float n = window(), inverse_n = 1.0f / n;
    for (size_t i = 0; i < pixels; ++i) {
      const float mean = sum_[i] * inverse_n;
      const float variance = std::max(0.0f, sum_square_[i] * inverse_n - mean * mean);
      const float covariance = sum_product_[i] * inverse_n - mean * mean_[i];
      float zncc = covariance / (std::sqrt(variance + kNoiseVariance) * deviation_[i]);
      zncc = sum_mask_[i] > n - 0.5f ? zncc : kNoScore;
      // Keeps the largest three, in order.
      for (Plane& kept : best) {
        const float larger = std::max(kept[i], zncc);
        zncc = std::min(kept[i], zncc);
        kept[i] = larger;
      }
    }
  }

 private:
  static constexpr float kMiddle = 128.0f;
  float window() const {
    const int side = 2 * options_.window_radius_px + 1;
    return static_cast<float>(side * side);
  }
  const SweepOptions& options_;
  int width_, height_;
  BoxSum box_;
  Plane mean_, deviation_, warped_, mask_, product_, sum_, sum_square_, sum_product_, sum_mask_,
      centered_;
};

// The mean of the best scores there are, as a cost.
uint8_t cost_of(const std::array<Plane, kMaxBest>& best, size_t i, int count) {
  float sum = 0;
  int seen = 0;
  for (int k = 0; k < count && best[static_cast<size_t>(k)][i] > -1.5f; ++k) {
    sum += best[static_cast<size_t>(k)][i];
    ++seen;
  }
  if (seen == 0) return kUnknownCost;
  const float score = std::clamp(sum / static_cast<float>(seen), -1.0f, 1.0f);
  return static_cast<uint8_t>(63.5f * (1 - score) + 0.5f);
}

}  // namespace

std::vector<uint8_t> sweep_planes(const GrayView& reference,
                                  const std::vector<const GrayView*>& sources,
                                  const InverseDepthRange& range, const SweepOptions& options) {
  check(range.num_planes == options.num_planes && range.num_planes % kGroup == 0,
        "sweep_planes: planes in groups of 16");
  check(options.best_views >= 1 && options.best_views <= kMaxBest, "sweep_planes: best_views");
  const size_t pixels = reference.gray.size();
  const auto planes = static_cast<size_t>(range.num_planes);
  std::vector<uint8_t> volume(pixels * planes);
  std::vector<Warp> warps;
  for (const GrayView* source : sources) warps.push_back(warp_of(reference, *source));
  Sweep sweep(reference, options);
  std::array<Plane, kMaxBest> best;
  for (Plane& plane : best) plane.resize(pixels);
  std::vector<uint8_t> group(pixels * kGroup);
  for (size_t first = 0; first < planes; first += kGroup) {
    for (size_t k = 0; k < kGroup; ++k) {
      for (Plane& plane : best) std::fill(plane.begin(), plane.end(), kNoScore);
      const double inverse_depth = range.inverse_depth(static_cast<double>(first + k));
      for (size_t s = 0; s < sources.size(); ++s) {
        sweep.score(*sources[s], warps[s], inverse_depth, best);
      }
      for (size_t i = 0; i < pixels; ++i)
        group[i * kGroup + k] = cost_of(best, i, options.best_views);
    }
    for (size_t i = 0; i < pixels; ++i) {
      std::copy_n(group.data() + i * kGroup, kGroup, volume.data() + i * planes + first);
    }
  }
  return volume;
}

}  // namespace vggtcd
