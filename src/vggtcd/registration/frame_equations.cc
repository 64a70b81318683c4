// SPDX-License-Identifier: Apache-2.0
// Normal equations of surface pairs whose errors are common to whole photos.
#include "vggtcd/registration/frame_equations.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "vggtcd/core/parallel.h"
#include "vggtcd/geometry/order_statistics.h"

namespace vggtcd {
namespace {

constexpr double kSigmaFromMad = 1.4826;  // of a normal distribution
constexpr double kTukeyTuning = 4.685;    // 95 % efficiency under a normal distribution
constexpr double kPairShare = 0.5;        // found from both sides
// Photos next to each other in the list err alike anyway; this bounds the linear system.
constexpr int kMaxWitnesses = 48;

double residual_sigma(const std::vector<SurfacePair>& pairs, double min_sigma_u) {
  std::vector<float> residuals(pairs.size());
  constexpr int64_t kGrain = 1 << 14;
  parallel_for(static_cast<int64_t>(pairs.size()), kGrain, [&](int64_t begin, int64_t end) {
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      residuals[i] = static_cast<float>(std::abs(pairs[i].plane_residual()));
    }
  });
  if (residuals.empty()) return min_sigma_u;
  return std::max(min_sigma_u, kSigmaFromMad * static_cast<double>(median(residuals)));
}

// One side's photos, gathered into at most kMaxWitnesses groups of neighbours.
class Witnesses {
 public:
  Witnesses(const std::vector<SurfacePair>& pairs, int32_t SurfacePair::*frame,
            Eigen::Vector3d SurfacePair::*point) {
    for (const SurfacePair& pair : pairs) frames_ = std::max(frames_, pair.*frame + 1);
    centers_.resize(static_cast<size_t>(count()), Eigen::Vector3d::Zero());
    std::vector<double> sizes(centers_.size(), 0);
    for (const SurfacePair& pair : pairs) {
      const size_t witness = static_cast<size_t>(of(pair.*frame));
      centers_[witness] += pair.*point;
      ++sizes[witness];
    }
    for (size_t k = 0; k < centers_.size(); ++k) centers_[k] /= std::max(1.0, sizes[k]);
  }
  int count() const { return std::min(frames_, kMaxWitnesses); }
  int of(int32_t frame) const {
    return frames_ <= kMaxWitnesses ? frame
                                    : static_cast<int>(int64_t{frame} * kMaxWitnesses / frames_);
  }
  const Eigen::Vector3d& center(int witness) const {
    return centers_[static_cast<size_t>(witness)];
  }

 private:
  int32_t frames_ = 0;
  std::vector<Eigen::Vector3d> centers_;
};

struct Block {
  bool empty = true;
  Matrix7 information = Matrix7::Zero();
  Vector7 gradient = Vector7::Zero();
};

// What pairs say about the parameters, summed up by block in the order of the pairs: the same bits
// for any number of threads. block_of(pair) is below num_blocks.
template <typename BlockOf>
std::vector<Block> sum_by_block(const std::vector<SurfacePair>& pairs, size_t num_blocks,
                                const BlockOf& block_of, const Eigen::Vector3d& pivot,
                                double sigma) {
  // The pairs in the order of their blocks, by counting.
  std::vector<size_t> starts(num_blocks + 1, 0);
  for (const SurfacePair& pair : pairs) ++starts[block_of(pair) + 1];
  std::partial_sum(starts.begin(), starts.end(), starts.begin());
  std::vector<uint32_t> order(pairs.size());
  std::vector<size_t> next(starts.begin(), starts.end() - 1);
  for (size_t i = 0; i < pairs.size(); ++i) {
    order[next[block_of(pairs[i])]++] = static_cast<uint32_t>(i);
  }
  std::vector<Block> blocks(num_blocks);
  const auto add = [&](const SurfacePair& pair, Block& block) {
    const double residual = pair.plane_residual();
    const double weight = kPairShare * tukey_weight(residual, sigma) / (sigma * sigma);
    if (weight == 0) return;
    const Eigen::Vector3d arm = pair.moving - pivot;
    Vector7 jacobian;
    jacobian << arm.cross(pair.normal), pair.normal, pair.normal.dot(arm);
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

Eigen::Index at(int block) { return 7 * Eigen::Index{block}; }

// Unknowns: theta, the photos of T1, the photos of T2; all but theta are eliminated. Block
// i * (photos of T2) + j holds the pairs of photos i and j.
SurfaceEquations marginalise(const std::vector<Block>& blocks, const Witnesses& of_t1,
                             const Witnesses& of_t2, const Eigen::Vector3d& pivot,
                             const FrameSpread& spread) {
  const int n1 = of_t1.count(), total = n1 + of_t2.count();
  Eigen::MatrixXd photos = Eigen::MatrixXd::Zero(at(total), at(total));
  Eigen::MatrixXd coupling = Eigen::MatrixXd::Zero(at(total), 7);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(at(total));
  const Matrix7 prior = spread.covariance().inverse();
  for (int k = 0; k < total; ++k) photos.block<7, 7>(at(k), at(k)) = prior;
  SurfaceEquations result;
  for (size_t k = 0; k < blocks.size(); ++k) {
    const Block& block = blocks[k];
    if (block.empty) continue;
    const int photo1 = static_cast<int>(k) / of_t2.count();
    const int photo2 = static_cast<int>(k) % of_t2.count();
    const Eigen::Index i = at(photo1), j = at(n1 + photo2);
    // A photo's similarity about its own centre, as parameters about the pivot.
    const Matrix7 a = pivot_change(pivot - of_t1.center(photo1));
    const Matrix7 b = pivot_change(pivot - of_t2.center(photo2));
    const Matrix7 ha = block.information * a, hb = block.information * b;
    result.information += block.information;
    result.gradient += block.gradient;
    photos.block<7, 7>(i, i) += a.transpose() * ha;
    photos.block<7, 7>(j, j) += b.transpose() * hb;
    photos.block<7, 7>(i, j) -= a.transpose() * hb;
    photos.block<7, 7>(j, i) -= b.transpose() * ha;
    coupling.block<7, 7>(i, 0) += ha.transpose();
    coupling.block<7, 7>(j, 0) -= hb.transpose();
    gradient.segment<7>(i) += a.transpose() * block.gradient;
    gradient.segment<7>(j) -= b.transpose() * block.gradient;
  }
  const Eigen::LLT<Eigen::MatrixXd> solver(photos);
  result.gradient -= coupling.transpose() * solver.solve(gradient);
  result.information -= coupling.transpose() * solver.solve(coupling);
  result.information = 0.5 * (result.information + result.information.transpose()).eval();
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
                                   const Eigen::Vector3d& pivot, const FrameSpread* frame_spread,
                                   double min_sigma_u) {
  const double sigma = residual_sigma(pairs, min_sigma_u);
  SurfaceEquations result;
  if (frame_spread) {
    std::optional<Witnesses> sides[2];  // at the same time
    parallel_for(2, 1, [&](int64_t side, int64_t) {
      if (side == 0) sides[0].emplace(pairs, &SurfacePair::frame_t1, &SurfacePair::moving);
      if (side == 1) sides[1].emplace(pairs, &SurfacePair::frame_t2, &SurfacePair::fixed);
    });
    const Witnesses &of_t1 = *sides[0], &of_t2 = *sides[1];
    const int n1 = of_t1.count(), n2 = of_t2.count();
    const auto block_of = [&](const SurfacePair& pair) {
      return static_cast<size_t>(of_t1.of(pair.frame_t1) * n2 + of_t2.of(pair.frame_t2));
    };
    const std::vector<Block> blocks =
        sum_by_block(pairs, static_cast<size_t>(n1 * n2), block_of, pivot, sigma);
    result = marginalise(blocks, of_t1, of_t2, pivot, *frame_spread);
  } else {
    const Block independent = sum_by_block(
        pairs, 1, [](const SurfacePair&) { return size_t{0}; }, pivot, sigma)[0];
    result.information = independent.information;
    result.gradient = independent.gradient;
  }
  result.sigma_u = sigma;
  return result;
}

}  // namespace vggtcd
