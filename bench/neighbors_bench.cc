// SPDX-License-Identifier: Apache-2.0
// Nearest neighbours of full-size clouds and the fine stage, against nanoflann here and against
// scipy and numpy in bench/peers/neighbors_peer.py, which reads what this writes. Run by
// bench/run_neighbors.
// Usage: neighbors_bench SCENE DIRECTORY      SCENE holds t1.npz, t2.npz and joint.npz
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <nanoflann.hpp>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "vggtcd/core/cpu_features.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/core/timer.h"
#include "vggtcd/geometry/nearest_neighbors.h"
#include "vggtcd/geometry/order_statistics.h"
#include "vggtcd/geometry/robust_extent.h"
#include "vggtcd/io/predictions.h"
#include "vggtcd/registration/coarse.h"
#include "vggtcd/registration/fine.h"
#include "vggtcd/scene/confidence.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd::bench {
namespace {

using Points = std::span<const Eigen::Vector3f>;

template <typename Values>
void write(const std::filesystem::path& path, const Values& values) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(values.data()),
             static_cast<std::streamsize>(values.size() * sizeof(*values.data())));
  if (!file) throw_error(ErrorCode::kOutput, "{}: cannot be written", path.string());
}

// Wall-clock and processor seconds; the second hardly depends on what else the machine is doing.
struct Cost {
  double wall_s = 0, cpu_s = 0;
};

class Stopwatch {
 public:
  Cost cost() const { return {timer_.seconds(), cpu_seconds() - cpu_started_s_}; }

 private:
  static double cpu_seconds() {
    return static_cast<double>(std::clock()) / static_cast<double>(CLOCKS_PER_SEC);
  }
  Timer timer_;
  double cpu_started_s_ = cpu_seconds();
};

void to_json(nlohmann::json& json, const Cost& cost) {
  json = {{"wall_s", cost.wall_s}, {"cpu_s", cost.cpu_s}};
}

struct Directions {
  std::vector<float> distance_t1, distance_t2;  // T1 -> T2, T2 -> T1
  Cost build, query;
  double cpu_s() const { return build.cpu_s + query.cpu_s; }
};

Directions ours(Points t1, Points t2, float bound) {
  Directions result;
  result.distance_t1.resize(t1.size());
  result.distance_t2.resize(t2.size());
  const Stopwatch build;
  const NearestNeighborIndex index_t1(t1), index_t2(t2);
  result.build = build.cost();
  const Stopwatch query;
  index_t2.query(index_t1, bound, result.distance_t1);
  index_t1.query(index_t2, bound, result.distance_t2);
  result.query = query.cost();
  return result;
}

// nanoflann at its best: float, compile-time dimension, the two trees built at the same time, a
// result set that starts at the bound and keeps one neighbour, queries in the order of the pixels
// (which are neighbours).
struct NanoflannCloud {
  Points points;
  size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(size_t i, size_t axis) const {
    return points[i][static_cast<Eigen::Index>(axis)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

struct OneNeighbor {
  using DistanceType = float;
  float squared;
  size_t size() const { return 1; }
  bool full() const { return true; }
  bool addPoint(float candidate, uint32_t) {
    squared = std::min(squared, candidate);
    return true;
  }
  float worstDist() const { return squared; }
};

using NanoflannTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, NanoflannCloud>,
                                        NanoflannCloud, 3, uint32_t>;

void query_nanoflann(const NanoflannTree& tree, Points queries, float bound,
                     std::vector<float>& distance) {
  distance.resize(queries.size());
  parallel_for(static_cast<int64_t>(queries.size()), 4096, [&](int64_t begin, int64_t end) {
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      OneNeighbor nearest{bound * bound};
      tree.findNeighbors(nearest, queries[i].data(), nanoflann::SearchParams());
      distance[i] = std::min(bound, std::sqrt(nearest.squared));
    }
  });
}

Directions with_nanoflann(Points t1, Points t2, float bound, size_t leaf_size) {
  Directions result;
  const NanoflannCloud cloud_t1{t1}, cloud_t2{t2};
  const nanoflann::KDTreeSingleIndexAdaptorParams params(leaf_size);
  const Stopwatch build;
  std::unique_ptr<NanoflannTree> tree_t1, tree_t2;
  std::thread other([&] { tree_t1 = std::make_unique<NanoflannTree>(3, cloud_t1, params); });
  tree_t2 = std::make_unique<NanoflannTree>(3, cloud_t2, params);
  other.join();
  result.build = build.cost();
  const Stopwatch query;
  query_nanoflann(*tree_t2, t1, bound, result.distance_t1);
  query_nanoflann(*tree_t1, t2, bound, result.distance_t2);
  result.query = query.cost();
  return result;
}

// Distances by definition, for a random sample.
int64_t differing_from_brute_force(Points queries, Points targets, float bound,
                                   const std::vector<float>& distance) {
  constexpr int64_t kSamples = 400;
  std::vector<int> differs(kSamples, 0);
  parallel_for(kSamples, 10, [&](int64_t begin, int64_t end) {
    std::mt19937_64 random(static_cast<uint64_t>(begin) + 1);
    for (int64_t i = begin; i < end; ++i) {
      const size_t sample = random() % queries.size();
      float best = std::numeric_limits<float>::infinity();
      for (const Eigen::Vector3f& target : targets) {
        const Eigen::Vector3f d = target - queries[sample];
        best = std::min(best, (d.x() * d.x() + d.y() * d.y()) + d.z() * d.z());
      }
      differs[static_cast<size_t>(i)] = std::min(bound, std::sqrt(best)) != distance[sample];
    }
  });
  return std::count(differs.begin(), differs.end(), 1);
}

// Everything the peer needs to do the same and to compare.
void write_for_peer(const std::filesystem::path& directory, const Reconstruction& before,
                    const Reconstruction& after, Points t1, Points t2, const Directions& found) {
  const float everything = -std::numeric_limits<float>::infinity();
  const PointCloud all_t1 = unproject(before, everything);
  const PointCloud all_t2 = unproject(after, everything);
  write(directory / "all_t1.f32", all_t1.positions);
  write(directory / "all_t2.f32", all_t2.positions);
  write(directory / "confidence_t1.f32", all_t1.confidence);
  write(directory / "confidence_t2.f32", all_t2.confidence);
  write(directory / "filtered_t1.f32", t1);
  write(directory / "filtered_t2.f32", t2);
  write(directory / "distance_t1.f32", found.distance_t1);
  write(directory / "distance_t2.f32", found.distance_t2);
}

int64_t count_different(const std::vector<float>& a, const std::vector<float>& b) {
  int64_t count = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    // nanoflann adds the squares in another order and sees the bound as a square.
    count += std::abs(a[i] - b[i]) > 1e-6f * (std::abs(a[i]) + 1e-3f) ? 1 : 0;
  }
  return count;
}

int run(int argc, char** argv) {
  if (argc != 3) throw_error(ErrorCode::kUsage, "usage: neighbors_bench SCENE DIRECTORY");
  const std::filesystem::path scene = argv[1], directory = argv[2];
  ProgressSink& silent = silent_progress();
  const Reconstruction before = read_reconstruction(scene / "t1.npz", silent);
  const Reconstruction after = read_reconstruction(scene / "t2.npz", silent);
  const Sim3 aligned =
      align_coarse(before, after, read_joint(scene / "joint.npz", before, after, silent), {})
          .t2_from_t1;
  const PointCloud cloud_t1 = unproject(before, confidence_threshold(before), aligned);
  const PointCloud cloud_t2 = unproject(after, confidence_threshold(after));
  const Points t1 = cloud_t1.positions, t2 = cloud_t2.positions;
  const double extent = robust_extent(t2);
  const float bound = static_cast<float>(0.02 * extent);

  nlohmann::json report;
  report["isa"] = enum_to_string(cpu_level());
  report["threads"] = num_threads();
  report["frames"] = {before.num_frames(), after.num_frames()};
  report["points"] = {t1.size(), t2.size()};
  report["bound"] = bound;

  const Directions first = ours(t1, t2, bound), second = ours(t1, t2, bound);
  const Directions& mine = first.cpu_s() < second.cpu_s() ? first : second;
  report["ours"] = {{"build", mine.build}, {"query", mine.query}};
  Directions peer;
  for (const size_t leaf_size : {10, 16, 32}) {
    Directions tried = with_nanoflann(t1, t2, bound, leaf_size);
    if (peer.distance_t1.empty() || tried.cpu_s() < peer.cpu_s()) {
      peer = std::move(tried);
      report["nanoflann"] = {
          {"build", peer.build}, {"query", peer.query}, {"leaf_size", leaf_size}};
    }
  }
  report["differ_from_nanoflann"] = count_different(mine.distance_t1, peer.distance_t1) +
                                    count_different(mine.distance_t2, peer.distance_t2);
  report["differ_from_brute_force"] = differing_from_brute_force(t1, t2, bound, mine.distance_t1) +
                                      differing_from_brute_force(t2, t1, bound, mine.distance_t2);
  report["beyond_bound"] = std::count(mine.distance_t1.begin(), mine.distance_t1.end(), bound) +
                           std::count(mine.distance_t2.begin(), mine.distance_t2.end(), bound);
  for (const auto* distance : {&mine.distance_t1, &mine.distance_t2}) {
    report["median_of_extent"].push_back(median(*distance) / extent);
  }

  Cost fine_cost{0, std::numeric_limits<double>::max()};
  FineResult fine;
  for (int repeat = 0; repeat < 3; ++repeat) {
    const Stopwatch stopwatch;
    fine = align_fine(before, after, aligned, FineOptions{});
    if (const Cost cost = stopwatch.cost(); cost.cpu_s < fine_cost.cpu_s) fine_cost = cost;
  }
  const Eigen::Vector3d& t = fine.t2_from_t1.translation;
  report["fine"] = {{"cost", fine_cost},
                    {"points", {fine.points_t1, fine.points_t2}},
                    {"static_points", fine.static_points},
                    {"translation", {t.x(), t.y(), t.z()}}};
  std::vector<double> matrix;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      matrix.push_back(aligned.scale * aligned.rotation(row, column));
    }
  }
  report["coarse"] = {
      {"scaled_rotation", matrix},
      {"translation", {aligned.translation.x(), aligned.translation.y(), aligned.translation.z()}}};
  write_for_peer(directory, before, after, t1, t2, mine);
  std::ofstream(directory / "ours.json") << report.dump(1) << '\n';
  return 0;
}

}  // namespace
}  // namespace vggtcd::bench

int main(int argc, char** argv) {
  try {
    return vggtcd::bench::run(argc, argv);
  } catch (const vggtcd::Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return static_cast<int>(error.code());
  }
}
