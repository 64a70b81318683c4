// SPDX-License-Identifier: Apache-2.0
// Dense depth: from aggregated costs to a plane, and from planes to what the photos agree on.
#include "vggtcd/reconstruction/dense_depth.h"

#include <algorithm>
#include <cmath>

#include "vggtcd/core/parallel.h"
#include "vggtcd/scene/pixel_patch.h"

namespace vggtcd {
namespace {

struct PlaneChoice {
  double plane = 0;
  float distinctness = 0;  // 1 - best / best elsewhere
};

PlaneChoice choose_plane(const uint16_t* sums, int planes) {
  int best = 0;
  for (int d = 1; d < planes; ++d) {
    if (sums[d] < sums[best]) best = d;
  }
  uint16_t elsewhere = 0xffff;
  for (int d = 0; d < planes; ++d) {
    if (std::abs(d - best) > 2) elsewhere = std::min(elsewhere, sums[d]);
  }
  PlaneChoice choice;
  choice.plane = best;
  choice.distinctness =
      1.0f - static_cast<float>(sums[best]) / std::max(1.0f, static_cast<float>(elsewhere));
  if (best > 0 && best < planes - 1) {
    const double below = sums[best - 1], here = sums[best], above = sums[best + 1];
    const double curvature = below - 2 * here + above;
    if (curvature > 0) choice.plane += 0.5 * (below - above) / curvature;
  }
  return choice;
}

}  // namespace

DepthMap sweep_depth(const GrayView& reference, const std::vector<const GrayView*>& sources,
                     const InverseDepthRange& range, const DenseDepthOptions& options) {
  const size_t pixels = reference.gray.size();
  DepthMap map{std::vector<float>(pixels), std::vector<float>(pixels)};
  std::vector<uint8_t> costs = sweep_planes(reference, sources, range, options.sweep);
  const std::vector<uint16_t> sums =
      aggregate_semi_global(costs, reference.pinhole.width, reference.pinhole.height,
                            range.num_planes, reference.gray, options.semi_global);
  const auto planes = static_cast<size_t>(range.num_planes);
  for (size_t i = 0; i < pixels; ++i) {
    if (!reference.valid[i]) continue;
    const PlaneChoice choice = choose_plane(sums.data() + i * planes, range.num_planes);
    // At the ends of the range the surface may lie beyond it.
    if (choice.plane < 0.5 || choice.plane > range.num_planes - 1.5) continue;
    if (costs[i * planes + static_cast<size_t>(choice.plane + 0.5)] >= kUnknownCost) continue;
    map.depth[i] = static_cast<float>(1.0 / range.inverse_depth(choice.plane));
    map.confidence[i] = choice.distinctness;
  }
  return map;
}

DepthMap agreed_depth(size_t view, const std::vector<GrayView>& views,
                      const std::vector<DepthMap>& swept, const std::vector<DepthTask>& tasks,
                      const DenseDepthOptions& options) {
  const GrayView& reference = views[view];
  const DepthTask& task = tasks[view];
  const Pinhole& camera = reference.pinhole;
  DepthMap out{std::vector<float>(reference.gray.size()),
               std::vector<float>(reference.gray.size())};
  const int needed = task.sources.size() <= 2 ? 1 : options.min_agreeing_views;
  const double plane_step =
      (task.range.nearest_inverse - task.range.farthest_inverse) / (options.sweep.num_planes - 1);
  std::vector<Rigid3> source_from_reference;
  for (const int s : task.sources) {
    source_from_reference.push_back(views[static_cast<size_t>(s)].camera_from_world *
                                    reference.camera_from_world.inverse());
  }
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const size_t i =
          static_cast<size_t>(v) * static_cast<size_t>(camera.width) + static_cast<size_t>(u);
      const double depth = swept[view].depth[i];
      if (!(depth > 0)) continue;
      const Eigen::Vector3d x = camera.unproject(u, v, depth);
      const double tolerance = std::max(options.max_relative_difference / depth,
                                        options.max_difference_planes * plane_step);
      double inverse_sum = 1.0 / depth;
      int agreeing = 0;
      float least_distinct = swept[view].confidence[i];
      for (size_t k = 0; k < task.sources.size(); ++k) {
        const auto s = static_cast<size_t>(task.sources[k]);
        const Eigen::Vector3d x_in_source = source_from_reference[k] * x;
        if (x_in_source.z() <= 0) continue;
        const Pinhole& other = views[s].pinhole;
        const Eigen::Vector2d pixel = other.project(x_in_source);
        if (!other.contains(pixel.x(), pixel.y())) continue;
        const auto j = static_cast<size_t>(pixel.y() + 0.5) * static_cast<size_t>(other.width) +
                       static_cast<size_t>(pixel.x() + 0.5);
        const double other_depth = swept[s].depth[j];
        if (!(other_depth > 0)) continue;
        // The other photo's depth at that pixel, as inverse depth here: to first order the depths
        // differ by as much in both cameras.
        const double difference = (other_depth - x_in_source.z()) / x_in_source.z();
        if (std::abs(difference) / depth > tolerance) continue;
        inverse_sum += 1.0 / (depth * (1.0 + difference));
        least_distinct = std::min(least_distinct, swept[s].confidence[j]);
        ++agreeing;
      }
      if (agreeing < needed) continue;
      if (agreeing == 1 && least_distinct < options.min_lone_distinctness) continue;
      out.depth[i] = static_cast<float>((agreeing + 1) / inverse_sum);
      out.confidence[i] =
          static_cast<float>(agreeing) + std::min(0.999f, swept[view].confidence[i]);
    }
  }
  return out;
}

void remove_small_patches(int width, int height, int min_patch_px, DepthMap& map) {
  constexpr float kConnected = 0.03f;
  std::vector<uint8_t> visited(map.depth.size());
  std::vector<size_t> patch;
  for (size_t seed = 0; seed < map.depth.size(); ++seed) {
    if (visited[seed] || !(map.depth[seed] > 0)) continue;
    grow_patch(seed, width, height, visited, patch, [&](size_t from, size_t to) {
      return map.depth[to] > 0 &&
             !(std::abs(map.depth[to] - map.depth[from]) > kConnected * map.depth[from]);
    });
    if (patch.size() >= static_cast<size_t>(min_patch_px)) continue;
    for (const size_t i : patch) map.depth[i] = map.confidence[i] = 0;
  }
}

std::vector<DepthMap> dense_depth(const std::vector<GrayView>& views,
                                  const std::vector<DepthTask>& tasks,
                                  const DenseDepthOptions& options, ProgressStage& stage) {
  std::vector<DepthMap> swept(views.size());
  const auto count = static_cast<int64_t>(views.size());
  const int64_t slab = num_threads();
  for (int64_t first = 0; first < count; first += slab) {
    parallel_for(std::min(slab, count - first), 1, [&](int64_t from, int64_t to) {
      for (auto i = static_cast<size_t>(first + from); i < static_cast<size_t>(first + to); ++i) {
        const size_t pixels = views[i].gray.size();
        swept[i] = {std::vector<float>(pixels), std::vector<float>(pixels)};
        if (tasks[i].sources.empty()) continue;
        std::vector<const GrayView*> sources;
        for (const int s : tasks[i].sources) sources.push_back(&views[static_cast<size_t>(s)]);
        InverseDepthRange range = tasks[i].range;
        range.num_planes = options.sweep.num_planes;
        swept[i] = sweep_depth(views[i], sources, range, options);
      }
    });
    constexpr double kSweepsShare = 0.95;  // of the time; the rest is agreement
    stage.advance(kSweepsShare * static_cast<double>(first + slab) / static_cast<double>(count));
  }
  std::vector<DepthMap> agreed(views.size());
  parallel_for(count, 1, [&](int64_t from, int64_t to) {
    for (auto i = static_cast<size_t>(from); i < static_cast<size_t>(to); ++i) {
      agreed[i] = agreed_depth(i, views, swept, tasks, options);
      const Pinhole& camera = views[i].pinhole;
      remove_small_patches(camera.width, camera.height, options.min_patch_px, agreed[i]);
    }
  });
  return agreed;
}

}  // namespace vggtcd
