// SPDX-License-Identifier: Apache-2.0
// Normal equations of surface pairs whose errors are common to whole photos.
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
// Photos next to each other in the list err alike anyway; this bounds the linear system.
constexpr int kMaxWitnesses = 48;

double relative_sigma_of(const std::vector<SurfacePair>& pairs, double min_relative_sigma) {
  const double mad = median_over(pairs, [](const SurfacePair& pair) {
    return std::abs(pair.plane_residual()) / pair.depth_u;
  });
  return std::max(min_relative_sigma, kSigmaFromMad * mad);
}

int group_of(int32_t frame, int32_t frames) {
  return frames <= kMaxWitnesses ? frame
                                 : static_cast<int>(int64_t{frame} * kMaxWitnesses / frames);
}

// One side's photos, gathered into at most kMaxWitnesses groups of neighbours.
class Witnesses {
 public:
  Witnesses(const std::vector<SurfacePair>& pairs, int32_t SurfacePair::*frame,
            Eigen::Vector3d SurfacePair::*point, std::span<const PointPair> points,
            int32_t PointPair::*frame_of_point, Eigen::Vector3d PointPair::*place) {
    for (const PointPair& tie : points) frames_ = std::max(frames_, tie.*frame_of_point + 1);
    const auto size = static_cast<int64_t>(pairs.size());
    std::vector<Sums> chunks(static_cast<size_t>(num_chunks(size, kGrain)));
    parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) {
        const SurfacePair& pair = pairs[static_cast<size_t>(i)];
        Sums& sums = chunks[static_cast<size_t>(begin / kGrain)];
        const auto number = static_cast<size_t>(pair.*frame);
        if (sums.size() <= number) sums.resize(number + 1, Eigen::Vector4d::Zero());
        const Eigen::Vector3d& x = pair.*point;
        sums[number] += Eigen::Vector4d(x.x(), x.y(), x.z(), 1) / (pair.depth_u * pair.depth_u);
      }
    });
    for (const Sums& sums : chunks) frames_ = std::max(frames_, static_cast<int32_t>(sums.size()));
    Sums groups(static_cast<size_t>(count()), Eigen::Vector4d::Zero());
    for (const Sums& sums : chunks) {
      for (size_t k = 0; k < sums.size(); ++k) {
        groups[static_cast<size_t>(of(static_cast<int32_t>(k)))] += sums[k];
      }
    }
    // Photos without surface pairs.
    Sums lonely(groups.size(), Eigen::Vector4d::Zero());
    for (const PointPair& tie : points) {
      const auto group = static_cast<size_t>(of(tie.*frame_of_point));
      if (groups[group][3] > 0) continue;
      const Eigen::Vector3d& x = tie.*place;
      lonely[group] += Eigen::Vector4d(x.x(), x.y(), x.z(), 1);
    }
    for (size_t k = 0; k < groups.size(); ++k) groups[k] += lonely[k];
    for (const Eigen::Vector4d& group : groups) {
      centers_.push_back(group.head<3>() / (group[3] > 0 ? group[3] : 1));
    }
  }
  int frames() const { return frames_; }
  int count() const { return std::min(frames_, kMaxWitnesses); }
  int of(int32_t frame) const { return group_of(frame, frames_); }
  const Eigen::Vector3d& center(int witness) const {
    return centers_[static_cast<size_t>(witness)];
  }

 private:
  using Sums = std::vector<Eigen::Vector4d>;  // of weighted points and weights, by frame or group
  static constexpr int64_t kGrain = 1 << 14;
  int32_t frames_ = 0;
  std::vector<Eigen::Vector3d> centers_;
};

struct Block {
  bool empty = true;
  Matrix7 information = Matrix7::Zero();
  Vector7 gradient = Vector7::Zero();

  void add(const PointPair& point, const Eigen::Vector3d& pivot) {
    const Matrix3x7 jacobian = point_jacobian(point.moving - pivot);
    const Eigen::Matrix<double, 7, 3> weighted = jacobian.transpose() * point.information;
    information += weighted * jacobian;
    gradient += weighted * (point.moving - point.fixed);
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

Eigen::Index at(int block) { return 7 * Eigen::Index{block}; }

// The normal equations of all unknowns: theta, the photos of T1, the photos of T2.
struct PhotoSystem {
  Witnesses of_t1, of_t2;
  Matrix7 information = Matrix7::Zero();
  Vector7 gradient = Vector7::Zero();
  Eigen::MatrixXd photos = {};    // the photos' block, their prior included
  Eigen::MatrixXd coupling = {};  // of the photos with theta
  Eigen::VectorXd photo_gradient = {};
  double relative_sigma = 0;
};

PhotoSystem assemble(const std::vector<SurfacePair>& pairs, std::span<const PointPair> points,
                     const Eigen::Vector3d& pivot, const FrameSpread& spread,
                     double min_relative_sigma) {
  PhotoSystem system{.of_t1 = {pairs, &SurfacePair::frame_t1, &SurfacePair::moving, points,
                               &PointPair::frame_t1, &PointPair::moving},
                     .of_t2 = {pairs, &SurfacePair::frame_t2, &SurfacePair::fixed, points,
                               &PointPair::frame_t2, &PointPair::fixed}};
  system.relative_sigma = relative_sigma_of(pairs, min_relative_sigma);
  const Witnesses &of_t1 = system.of_t1, &of_t2 = system.of_t2;
  const int n1 = of_t1.count(), n2 = of_t2.count(), total = n1 + n2;
  // Block i * n2 + j holds the pairs of photos i and j.
  const auto block_of = [&](const SurfacePair& pair) {
    return static_cast<size_t>(of_t1.of(pair.frame_t1) * n2 + of_t2.of(pair.frame_t2));
  };
  std::vector<Block> blocks =
      sum_by_block(pairs, static_cast<size_t>(n1 * n2), block_of, pivot, system.relative_sigma,
                   std::min(kPairShare, patch_share(pairs)));
  for (const PointPair& point : points) {
    blocks[static_cast<size_t>(of_t1.of(point.frame_t1) * n2 + of_t2.of(point.frame_t2))].add(
        point, pivot);
  }

  system.photos = Eigen::MatrixXd::Zero(at(total), at(total));
  system.coupling = Eigen::MatrixXd::Zero(at(total), 7);
  system.photo_gradient = Eigen::VectorXd::Zero(at(total));
  const Matrix7 prior = spread.covariance().inverse();
  for (int k = 0; k < total; ++k) system.photos.block<7, 7>(at(k), at(k)) = prior;
  for (size_t k = 0; k < blocks.size(); ++k) {
    const Block& block = blocks[k];
    if (block.empty) continue;
    const int photo1 = static_cast<int>(k) / n2;
    const int photo2 = static_cast<int>(k) % n2;
    const Eigen::Index i = at(photo1), j = at(n1 + photo2);
    // A photo's similarity about its own centre, as parameters about the pivot.
    const Matrix7 a = pivot_change(pivot - of_t1.center(photo1));
    const Matrix7 b = pivot_change(pivot - of_t2.center(photo2));
    const Matrix7 ha = block.information * a, hb = block.information * b;
    system.information += block.information;
    system.gradient += block.gradient;
    system.photos.block<7, 7>(i, i) += a.transpose() * ha;
    system.photos.block<7, 7>(j, j) += b.transpose() * hb;
    system.photos.block<7, 7>(i, j) -= a.transpose() * hb;
    system.photos.block<7, 7>(j, i) -= b.transpose() * ha;
    system.coupling.block<7, 7>(i, 0) += ha.transpose();
    system.coupling.block<7, 7>(j, 0) -= hb.transpose();
    system.photo_gradient.segment<7>(i) += a.transpose() * block.gradient;
    system.photo_gradient.segment<7>(j) -= b.transpose() * block.gradient;
  }
  return system;
}

// Without the covariance, which costs more than the rest.
PhotoErrors errors_of(const PhotoSystem& system, const Eigen::LLT<Eigen::MatrixXd>& solver) {
  const int n1 = system.of_t1.count(), total = n1 + system.of_t2.count();
  PhotoErrors result;
  result.groups_t1 = n1;
  result.frames_t1 = system.of_t1.frames();
  result.frames_t2 = system.of_t2.frames();
  for (int k = 0; k < total; ++k) {
    result.centers.push_back(k < n1 ? system.of_t1.center(k) : system.of_t2.center(k - n1));
  }
  result.mean = -solver.solve(system.photo_gradient);
  result.response = -solver.solve(system.coupling);
  return result;
}

}  // namespace

double tukey_weight(double residual, double sigma) {
  const double x = residual / (kTukeyTuning * sigma);
  return x * x < 1 ? (1 - x * x) * (1 - x * x) : 0;
}

double tukey_loss(double residual, double sigma) {
  const double x = residual / (kTukeyTuning * sigma);
  const double rest = 1 - x * x;
  return x * x < 1 ? 1 - rest * rest * rest : 1;
}

SurfaceEquations surface_equations(const std::vector<SurfacePair>& pairs,
                                   std::span<const PointPair> points, const Eigen::Vector3d& pivot,
                                   const FrameSpread* frame_spread, double min_relative_sigma) {
  SurfaceEquations result;
  if (frame_spread) {
    const PhotoSystem system = assemble(pairs, points, pivot, *frame_spread, min_relative_sigma);
    const Eigen::LLT<Eigen::MatrixXd> solver(system.photos);
    result.relative_sigma = system.relative_sigma;
    result.photos = errors_of(system, solver);
    const PhotoErrors& photos = *result.photos;
    result.gradient = system.gradient + system.coupling.transpose() * photos.mean;
    result.information = system.information + system.coupling.transpose() * photos.response;
    result.information = 0.5 * (result.information + result.information.transpose()).eval();
  } else {
    result.relative_sigma = relative_sigma_of(pairs, min_relative_sigma);
    Block independent = sum_by_block(
        pairs, 1, [](const SurfacePair&) { return size_t{0}; }, pivot, result.relative_sigma,
        kPairShare)[0];
    for (const PointPair& point : points) independent.add(point, pivot);
    result.information = independent.information;
    result.gradient = independent.gradient;
  }
  return result;
}

PhotoErrors photo_errors(const std::vector<SurfacePair>& pairs, std::span<const PointPair> points,
                         const Eigen::Vector3d& pivot, const FrameSpread& frame_spread,
                         double min_relative_sigma) {
  const PhotoSystem system = assemble(pairs, points, pivot, frame_spread, min_relative_sigma);
  const Eigen::LLT<Eigen::MatrixXd> solver(system.photos);
  PhotoErrors result = errors_of(system, solver);
  const Eigen::Index size = system.photos.rows();
  result.covariance = solver.solve(Eigen::MatrixXd::Identity(size, size));
  return result;
}

Eigen::Vector3d PhotoErrors::displacement(const PointPair& pair, const Vector7& theta) const {
  const auto moved_by = [&](size_t group, const Eigen::Vector3d& x) -> Eigen::Vector3d {
    const auto rows = Eigen::seqN(7 * static_cast<Eigen::Index>(group), 7);
    const Vector7 b = mean(rows) + response(rows, Eigen::all) * theta;
    return point_jacobian(x - centers[group]) * b;
  };
  return moved_by(group_of_t1(static_cast<size_t>(pair.frame_t1)), pair.moving) -
         moved_by(group_of_t2(static_cast<size_t>(pair.frame_t2)), pair.fixed);
}

size_t PhotoErrors::group_of_t1(size_t frame) const {
  return static_cast<size_t>(group_of(static_cast<int32_t>(frame), frames_t1));
}

size_t PhotoErrors::group_of_t2(size_t frame) const {
  return static_cast<size_t>(groups_t1 + group_of(static_cast<int32_t>(frame), frames_t2));
}

}  // namespace vggtcd
