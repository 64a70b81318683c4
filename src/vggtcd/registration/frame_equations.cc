// SPDX-License-Identifier: Apache-2.0
// Normal equations of surface pairs and tie points whose errors are common to whole photos.
#include "vggtcd/registration/frame_equations.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

constexpr double kSigmaFromMad = 1.4826;  // of a normal distribution
constexpr double kTukeyTuning = 4.685;    // 95 % efficiency under a normal distribution
constexpr double kPairShare = 0.5;        // found from both sides
// Depth errs in patches of about a fifth of the photo's side, so what lies next to each other in it
// tells the same: a photo's pairs count as this many.
constexpr double kPatchesOfAPhoto = 20;
constexpr int32_t kMaxWitnesses = 48;  // groups of an epoch

double relative_sigma_of(const std::vector<SurfacePair>& pairs, double min_relative_sigma) {
  const double mad = median_over(pairs, [](const SurfacePair& pair) {
    return std::abs(pair.plane_residual()) / pair.depth_u;
  });
  return std::max(min_relative_sigma, kSigmaFromMad * mad);
}

PhotoNumber t1_photo(const SurfacePair& pair) { return {true, pair.frame_t1}; }
PhotoNumber t2_photo(const SurfacePair& pair) { return {false, pair.frame_t2}; }

// The centres of what the groups show, near points counting more; of groups without surface pairs
// those of their points.
void find_centers(const std::vector<SurfacePair>& pairs, std::span<const PointPair> points,
                  PhotoErrors& photos) {
  using Sums = std::vector<Eigen::Vector4d>;  // of weighted points and weights, by group
  const Sums none(photos.groups.count(), Eigen::Vector4d::Zero());
  const auto add = [&](Sums& sums, PhotoNumber photo, const Eigen::Vector3d& x, double weight) {
    sums[photos.groups.of(photo)] += weight * x.homogeneous();
  };
  constexpr int64_t kGrain = 1 << 14;
  const auto size = static_cast<int64_t>(pairs.size());
  std::vector<Sums> chunks(static_cast<size_t>(num_chunks(size, kGrain)), none);
  parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
    Sums& sums = chunks[static_cast<size_t>(begin / kGrain)];
    for (int64_t i = begin; i < end; ++i) {
      const SurfacePair& pair = pairs[static_cast<size_t>(i)];
      const double weight = 1 / (pair.depth_u * pair.depth_u);
      add(sums, t1_photo(pair), pair.moving, weight);
      add(sums, t2_photo(pair), pair.fixed, weight);
    }
  });
  Sums of_pairs = none, of_points = none;
  for (const Sums& chunk : chunks) {
    for (size_t k = 0; k < chunk.size(); ++k) of_pairs[k] += chunk[k];
  }
  for (const PointPair& point : points) {
    if (point.information.isZero(0)) continue;
    add(of_points, point.first_photo, point.first, 1);
    add(of_points, point.second_photo, point.second, 1);
  }
  for (size_t k = 0; k < none.size(); ++k) {
    const Eigen::Vector4d& sum = of_pairs[k][3] > 0 ? of_pairs[k] : of_points[k];
    photos.known.push_back(sum[3] > 0);
    photos.centers.push_back(sum[3] > 0 ? Eigen::Vector3d(sum.hnormalized())
                                        : Eigen::Vector3d(Eigen::Vector3d::Zero()));
  }
}

struct Block {
  bool empty = true;
  Matrix7 information = Matrix7::Zero();
  Vector7 gradient = Vector7::Zero();

  void add(const PointPair& point, const Eigen::Vector3d& pivot) {
    // The two are one place: their arms differ by less than what is linearised away.
    const Matrix3x7 jacobian = point_jacobian(point.first - pivot);
    const Eigen::Matrix<double, 7, 3> weighted = jacobian.transpose() * point.information;
    information += weighted * jacobian;
    gradient += weighted * (point.first - point.second);
    empty = false;
  }
};

// What pairs say about the parameters, summed up by block in the order of the pairs: the same bits
// for any number of threads. block_of(pair) is below num_blocks.
template <typename BlockOf>
std::vector<Block> sum_by_block(const std::vector<SurfacePair>& pairs, size_t num_blocks,
                                const BlockOf& block_of, const Eigen::Vector3d& pivot,
                                double relative_sigma, double share) {
  // The pairs in the order of their blocks, by counting.
  std::vector<uint32_t> blocks_of(pairs.size());
  constexpr int64_t kPairGrain = 1 << 14;
  parallel_for(static_cast<int64_t>(pairs.size()), kPairGrain, [&](int64_t begin, int64_t end) {
    for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      blocks_of[i] = static_cast<uint32_t>(block_of(pairs[i]));
    }
  });
  std::vector<size_t> starts(num_blocks + 1, 0);
  for (const uint32_t block : blocks_of) ++starts[block + 1];
  std::partial_sum(starts.begin(), starts.end(), starts.begin());
  std::vector<uint32_t> order(pairs.size());
  std::vector<size_t> next(starts.begin(), starts.end() - 1);
  for (size_t i = 0; i < pairs.size(); ++i) {
    order[next[blocks_of[i]]++] = static_cast<uint32_t>(i);
  }
  std::vector<Block> blocks(num_blocks);
  const auto add = [&](const SurfacePair& pair, Block& block) {
    const double residual = pair.plane_residual();
    const double sigma = relative_sigma * pair.depth_u;
    const double weight = share * tukey_weight(residual, sigma) / (sigma * sigma);
    if (weight == 0) return;
    const Vector7 jacobian = plane_jacobian(pair.moving - pivot, pair.normal);
    block.information += weight * jacobian * jacobian.transpose();
    block.gradient += weight * residual * jacobian;
    block.empty = false;
  };
  constexpr int64_t kGrain = 16;
  parallel_for(static_cast<int64_t>(num_blocks), kGrain, [&](int64_t begin, int64_t end) {
    for (size_t b = static_cast<size_t>(begin); b < static_cast<size_t>(end); ++b) {
      for (size_t i = starts[b]; i < starts[b + 1]; ++i) add(pairs[order[i]], blocks[b]);
    }
  });
  return blocks;
}

// What each pair counts so that those of a photo count kPatchesOfAPhoto together, on average.
double patch_share(const std::vector<SurfacePair>& pairs) {
  if (pairs.empty()) return 1;
  std::vector<bool> of_t1, of_t2;  // photos that have any
  const auto mark = [](std::vector<bool>& photos, int32_t frame) {
    const auto number = static_cast<size_t>(frame);
    if (photos.size() <= number) photos.resize(number + 1);
    photos[number] = true;
  };
  for (const SurfacePair& pair : pairs) {
    mark(of_t1, pair.frame_t1);
    mark(of_t2, pair.frame_t2);
  }
  const auto photos =
      std::count(of_t1.begin(), of_t1.end(), true) + std::count(of_t2.begin(), of_t2.end(), true);
  // Every pair is one of two photos.
  return kPatchesOfAPhoto * static_cast<double>(photos) / (2 * static_cast<double>(pairs.size()));
}

// The normal equations of all unknowns: theta and the photos' own similarities.
struct PhotoSystem {
  PhotoErrors errors;  // groups and centres
  Matrix7 information = Matrix7::Zero();
  Vector7 gradient = Vector7::Zero();
  Eigen::MatrixXd photos;    // the photos' block, their prior included
  Eigen::MatrixXd coupling;  // of the photos with theta
  Eigen::VectorXd photo_gradient;
  double relative_sigma = 0;
};

PhotoSystem assemble(const std::vector<SurfacePair>& pairs, std::span<const PointPair> points,
                     PhotoCounts photos, const Eigen::Vector3d& pivot, const FrameSpread& spread,
                     double min_relative_sigma) {
  PhotoSystem system;
  system.errors.groups = PhotoGroups(photos);
  find_centers(pairs, points, system.errors);
  system.relative_sigma = relative_sigma_of(pairs, min_relative_sigma);
  const PhotoGroups& groups = system.errors.groups;
  const size_t total = groups.count();
  // Block i * total + j holds the pairs of groups i and j.
  const auto block_of = [&](PhotoNumber first, PhotoNumber second) {
    return groups.of(first) * total + groups.of(second);
  };
  std::vector<Block> blocks = sum_by_block(
      pairs, total * total,
      [&](const SurfacePair& pair) { return block_of(t1_photo(pair), t2_photo(pair)); }, pivot,
      system.relative_sigma, std::min(kPairShare, patch_share(pairs)));
  for (const PointPair& point : points) {
    blocks[block_of(point.first_photo, point.second_photo)].add(point, pivot);
  }

  const auto size = static_cast<Eigen::Index>(7 * total);
  system.photos = Eigen::MatrixXd::Zero(size, size);
  system.coupling = Eigen::MatrixXd::Zero(size, 7);
  system.photo_gradient = Eigen::VectorXd::Zero(size);
  const Matrix7 prior = spread.covariance().inverse();
  for (Eigen::Index k = 0; k < size; k += 7) system.photos.block<7, 7>(k, k) = prior;
  // A photo's similarity about its own centre, as parameters about the pivot.
  std::vector<Matrix7> about_pivot;
  for (const auto& center : system.errors.centers)
    about_pivot.push_back(pivot_change(pivot - center));
  for (size_t k = 0; k < blocks.size(); ++k) {
    const Block& block = blocks[k];
    const size_t first = k / total, second = k % total;
    if (block.empty || first == second) continue;
    const auto i = static_cast<Eigen::Index>(7 * first), j = static_cast<Eigen::Index>(7 * second);
    const Matrix7 &a = about_pivot[first], &b = about_pivot[second];
    const Matrix7 ha = block.information * a, hb = block.information * b;
    system.photos.block<7, 7>(i, i) += a.transpose() * ha;
    system.photos.block<7, 7>(j, j) += b.transpose() * hb;
    system.photos.block<7, 7>(i, j) -= a.transpose() * hb;
    system.photos.block<7, 7>(j, i) -= b.transpose() * ha;
    system.photo_gradient.segment<7>(i) += a.transpose() * block.gradient;
    system.photo_gradient.segment<7>(j) -= b.transpose() * block.gradient;
    const bool across = first < groups.of_t1() && second >= groups.of_t1();
    if (!across) continue;  // theta moves both photos alike
    system.information += block.information;
    system.gradient += block.gradient;
    system.coupling.block<7, 7>(i, 0) += ha.transpose();
    system.coupling.block<7, 7>(j, 0) -= hb.transpose();
  }
  return system;
}

// Without the covariance, which costs more than the rest.
PhotoErrors solve(const PhotoSystem& system, const Eigen::LLT<Eigen::MatrixXd>& solver) {
  PhotoErrors result = system.errors;
  result.mean = -solver.solve(system.photo_gradient);
  result.response = -solver.solve(system.coupling);
  return result;
}

}  // namespace

size_t PhotoGroups::groups_of(int32_t photos) {
  return static_cast<size_t>(std::min(photos, kMaxWitnesses));
}

size_t PhotoGroups::of(PhotoNumber photo) const {
  const int32_t photos = photo.of_t1 ? photos_.t1 : photos_.t2;
  const auto group = photos <= kMaxWitnesses
                         ? static_cast<size_t>(photo.frame)
                         : static_cast<size_t>(int64_t{photo.frame} * kMaxWitnesses / photos);
  return photo.of_t1 ? group : of_t1() + group;
}

double tukey_weight(double residual, double sigma) {
  const double x = residual / (kTukeyTuning * sigma);
  return x * x < 1 ? (1 - x * x) * (1 - x * x) : 0;
}

double tukey_loss(double residual, double sigma) {
  const double x = residual / (kTukeyTuning * sigma);
  const double rest = 1 - x * x;
  return x * x < 1 ? 1 - rest * rest * rest : 1;
}

FrameEquations frame_equations(const std::vector<SurfacePair>& pairs,
                               std::span<const PointPair> points, PhotoCounts photos,
                               const Eigen::Vector3d& pivot, const FrameSpread* frame_spread,
                               double min_relative_sigma) {
  FrameEquations result;
  if (frame_spread) {
    const PhotoSystem system =
        assemble(pairs, points, photos, pivot, *frame_spread, min_relative_sigma);
    const Eigen::LLT<Eigen::MatrixXd> solver(system.photos);
    result.relative_sigma = system.relative_sigma;
    result.photos = solve(system, solver);
    result.gradient = system.gradient + system.coupling.transpose() * result.photos->mean;
    result.information = system.information + system.coupling.transpose() * result.photos->response;
    result.information = 0.5 * (result.information + result.information.transpose()).eval();
  } else {
    result.relative_sigma = relative_sigma_of(pairs, min_relative_sigma);
    Block independent = sum_by_block(
        pairs, 1, [](const SurfacePair&) { return size_t{0}; }, pivot, result.relative_sigma,
        kPairShare)[0];
    for (const PointPair& point : points) {
      if (point.first_photo.of_t1 != point.second_photo.of_t1) independent.add(point, pivot);
    }
    result.information = independent.information;
    result.gradient = independent.gradient;
  }
  return result;
}

PhotoErrors photo_errors(const std::vector<SurfacePair>& pairs, std::span<const PointPair> points,
                         PhotoCounts photos, const Eigen::Vector3d& pivot,
                         const FrameSpread& frame_spread, double min_relative_sigma) {
  const PhotoSystem system =
      assemble(pairs, points, photos, pivot, frame_spread, min_relative_sigma);
  const Eigen::LLT<Eigen::MatrixXd> solver(system.photos);
  PhotoErrors result = solve(system, solver);
  const Eigen::Index size = system.photos.rows();
  result.covariance = solver.solve(Eigen::MatrixXd::Identity(size, size));
  return result;
}

Eigen::Vector3d PhotoErrors::displacement(const PointPair& pair, const Vector7& theta) const {
  const auto moved_by = [&](PhotoNumber photo, const Eigen::Vector3d& x) -> Eigen::Vector3d {
    const size_t group = groups.of(photo);
    const auto rows = Eigen::seqN(7 * static_cast<Eigen::Index>(group), 7);
    const Vector7 b = mean(rows) + response(rows, Eigen::all) * theta;
    return point_jacobian(x - centers[group]) * b;
  };
  return moved_by(pair.first_photo, pair.first) - moved_by(pair.second_photo, pair.second);
}

}  // namespace vggtcd
