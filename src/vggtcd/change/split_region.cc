// SPDX-License-Identifier: Apache-2.0
// Splitting a region at its thin places: dense voxels, their components, and the rest to the
// nearest.
#include "vggtcd/change/split_region.h"

#include <algorithm>
#include <iterator>

#include "vggtcd/geometry/nearest_neighbors.h"
#include "vggtcd/geometry/order_statistics.h"
#include "vggtcd/geometry/voxel_components.h"

namespace vggtcd {
namespace {

RegionPoints in_order_of_voxels(RegionPoints points, std::span<const uint32_t> voxel) {
  std::ranges::stable_sort(points, {}, [&](uint32_t i) { return voxel[i]; });
  return points;
}

// Calls use(first, last) with the points of each voxel, of points in the order of their voxels.
template <typename Use>
void for_voxels(const RegionPoints& order, std::span<const uint32_t> voxel, const Use& use) {
  for (auto first = order.begin(); first != order.end();) {
    const auto last =
        std::find_if(first, order.end(), [&](uint32_t i) { return voxel[i] != voxel[*first]; });
    use(first, last);
    first = last;
  }
}

std::vector<RegionPoints> pieces_of(const RegionPoints& points,
                                    std::span<const Eigen::Vector3f> positions, double voxel_size) {
  std::vector<Eigen::Vector3f> own;
  for (const uint32_t i : points) own.push_back(positions[i]);
  const VoxelComponents components = connected_components(own, voxel_size, 1);
  std::vector<RegionPoints> pieces(static_cast<size_t>(components.num_components));
  for (size_t k = 0; k < points.size(); ++k) {
    pieces[static_cast<size_t>(components.component[k])].push_back(points[k]);
  }
  return pieces;
}

// Adds each point of the region that is in no core to the nearest one.
void add_rest(const RegionPoints& region, std::span<const Eigen::Vector3f> positions,
              std::span<const uint32_t> voxel, std::vector<RegionPoints>& cores) {
  RegionPoints taken, rest;
  std::vector<Eigen::Vector3f> targets, queries;
  std::vector<size_t> core_of_target;
  for (size_t core = 0; core < cores.size(); ++core) {
    taken.insert(taken.end(), cores[core].begin(), cores[core].end());
    const std::vector<Eigen::Vector3f> means = voxel_means(cores[core], positions, voxel);
    targets.insert(targets.end(), means.begin(), means.end());
    core_of_target.resize(targets.size(), core);
  }
  std::ranges::sort(taken);
  std::ranges::set_difference(region, taken, std::back_inserter(rest));
  for (const uint32_t i : rest) queries.push_back(positions[i]);
  const NearestNeighbors nearest = NearestNeighborIndex(targets).query(queries);
  for (size_t k = 0; k < rest.size(); ++k) {
    cores[core_of_target[static_cast<size_t>(nearest.index[k])]].push_back(rest[k]);
  }
  for (RegionPoints& core : cores) std::ranges::sort(core);
  std::ranges::sort(cores, {}, [](const RegionPoints& core) { return core.front(); });
}

}  // namespace

RegionPoints dense_points(const RegionPoints& region, std::span<const uint32_t> voxel,
                          double min_density) {
  const RegionPoints order = in_order_of_voxels(region, voxel);
  std::vector<double> counts;
  for_voxels(order, voxel,
             [&](auto first, auto last) { counts.push_back(static_cast<double>(last - first)); });
  const double least = min_density * middle_of(std::move(counts));
  RegionPoints dense;
  for_voxels(order, voxel, [&](auto first, auto last) {
    if (static_cast<double>(last - first) >= least) dense.insert(dense.end(), first, last);
  });
  std::ranges::sort(dense);
  return dense;
}

std::vector<Eigen::Vector3f> voxel_means(const RegionPoints& points,
                                         std::span<const Eigen::Vector3f> positions,
                                         std::span<const uint32_t> voxel) {
  std::vector<Eigen::Vector3f> means;
  for_voxels(in_order_of_voxels(points, voxel), voxel, [&](auto first, auto last) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (auto i = first; i != last; ++i) sum += positions[*i].template cast<double>();
    means.push_back((sum / static_cast<double>(last - first)).template cast<float>());
  });
  return means;
}

std::vector<RegionPoints> split_region(
    const RegionPoints& region, std::span<const Eigen::Vector3f> positions,
    std::span<const uint32_t> voxel, double voxel_size, double min_density,
    const std::function<bool(const RegionPoints&)>& stands_alone) {
  if (region.empty()) return {};
  std::vector<RegionPoints> cores =
      pieces_of(dense_points(region, voxel, min_density), positions, voxel_size);
  if (cores.size() < 2) return {region};
  std::erase_if(cores, [&](const RegionPoints& core) { return !stands_alone(core); });
  if (cores.size() < 2) return {region};
  add_rest(region, positions, voxel, cores);
  return cores;
}

}  // namespace vggtcd
