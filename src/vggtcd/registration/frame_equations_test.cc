// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/registration/frame_equations.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace vggtcd {
namespace {

const Eigen::Vector3d kPivot(0.5, -1, 2);
constexpr FrameSpread kSpread{0.02, 0.05, 0.03};

std::vector<SurfacePair> random_pairs(int frames, int per_pair_of_frames) {
  std::mt19937 engine(5);
  std::normal_distribution<double> normal;
  const auto vector = [&] {
    return Eigen::Vector3d(normal(engine), normal(engine), normal(engine));
  };
  std::vector<SurfacePair> pairs;
  for (int i = 0; i < frames; ++i) {
    for (int j = 0; j < frames; ++j) {
      for (int k = 0; k < per_pair_of_frames; ++k) {
        SurfacePair pair;
        pair.fixed = 2 * vector();
        pair.moving = pair.fixed + 0.01 * vector();
        pair.normal = vector().normalized();
        pair.frame_t1 = i;
        pair.frame_t2 = j;
        pairs.push_back(pair);
      }
    }
  }
  return pairs;
}

Vector7 jacobian_of(const SurfacePair& pair) {
  const Eigen::Vector3d arm = pair.moving - kPivot;
  Vector7 jacobian;
  jacobian << arm.cross(pair.normal), pair.normal, pair.normal.dot(arm);
  return jacobian;
}

TEST(SurfaceEquations, MarginalisedPhotosEqualTheDenseCovariance) {
  // Oracle: r = J theta + e with cov(e) = noise + sum over photos of their own similarity;
  // information J^T cov^-1 J, built dense over all pairs.
  const std::vector<SurfacePair> pairs = random_pairs(3, 8);
  const SurfaceEquations actual = surface_equations(pairs, {}, kPivot, &kSpread, 1e-6);
  const Eigen::Index n = static_cast<Eigen::Index>(pairs.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n), jacobian(n, 7);
  Eigen::VectorXd residual(n);
  std::vector<Eigen::Vector3d> center1(3, Eigen::Vector3d::Zero()), center2 = center1;
  for (const SurfacePair& pair : pairs) {
    center1[static_cast<size_t>(pair.frame_t1)] += pair.moving / 24;
    center2[static_cast<size_t>(pair.frame_t2)] += pair.fixed / 24;
  }
  std::vector<Eigen::Index> kept;
  for (Eigen::Index a = 0; a < n; ++a) {
    const SurfacePair& p = pairs[static_cast<size_t>(a)];
    const double weight = tukey_weight(p.plane_residual(), actual.relative_sigma);
    if (weight > 0) kept.push_back(a);
    jacobian.row(a) = jacobian_of(p).transpose();
    residual[a] = p.plane_residual();
    covariance(a, a) +=
        actual.relative_sigma * actual.relative_sigma / (0.5 * std::max(weight, 1e-30));
    for (Eigen::Index b = 0; b < n; ++b) {
      const SurfacePair& q = pairs[static_cast<size_t>(b)];
      const auto shared = [&](const Eigen::Vector3d& center) {
        const Matrix7 change = pivot_change(kPivot - center);
        return jacobian_of(p).dot(change * kSpread.covariance() * change.transpose() *
                                  jacobian_of(q));
      };
      if (p.frame_t1 == q.frame_t1) {
        covariance(a, b) += shared(center1[static_cast<size_t>(p.frame_t1)]);
      }
      if (p.frame_t2 == q.frame_t2) {
        covariance(a, b) += shared(center2[static_cast<size_t>(p.frame_t2)]);
      }
    }
  }
  const Eigen::MatrixXd c = covariance(kept, kept), j = jacobian(kept, Eigen::all);
  const Eigen::MatrixXd solved = c.ldlt().solve(j);
  const Matrix7 information = j.transpose() * solved;
  const Vector7 gradient = solved.transpose() * residual(kept);
  EXPECT_LT((actual.information - information).norm(), 1e-8 * information.norm());
  EXPECT_LT((actual.gradient - gradient).norm(), 1e-8 * gradient.norm());
}

TEST(SurfaceEquations, APhotoIsOneWitnessHoweverManyPointsItHas) {
  std::vector<SurfacePair> pairs = random_pairs(3, 200);
  const Matrix7 once = surface_equations(pairs, {}, kPivot, &kSpread, 1e-6).information;
  const Matrix7 once_free = surface_equations(pairs, {}, kPivot, nullptr, 1e-6).information;
  const std::vector<SurfacePair> copy = pairs;
  for (int k = 1; k < 10; ++k) pairs.insert(pairs.end(), copy.begin(), copy.end());
  const Matrix7 tenfold = surface_equations(pairs, {}, kPivot, &kSpread, 1e-6).information;
  const Matrix7 tenfold_free = surface_equations(pairs, {}, kPivot, nullptr, 1e-6).information;
  EXPECT_NEAR(tenfold_free.trace() / once_free.trace(), 10, 1e-6);
  EXPECT_LT(tenfold(3, 3) / once(3, 3), 1.1);
  EXPECT_LT(once(3, 3), once_free(3, 3));
}

TEST(SurfaceEquations, APhotosPairsCountAsItsPatches) {
  std::vector<SurfacePair> pairs = random_pairs(3, 200);
  constexpr FrameSpread kNothing{1e-9, 1e-9, 1e-9};
  const Matrix7 sure = surface_equations(pairs, {}, kPivot, &kNothing, 1e-6).information;
  const Matrix7 free = surface_equations(pairs, {}, kPivot, nullptr, 1e-6).information;
  const double share = 20.0 / 600;  // a photo has 600 of the 1800 pairs
  EXPECT_LT((sure - share / 0.5 * free).norm(), 1e-6 * sure.norm());
}

std::vector<PointPair> random_points(int frames, int per_pair_of_frames) {
  std::mt19937 engine(9);
  std::normal_distribution<double> normal;
  std::vector<PointPair> points;
  for (const SurfacePair& pair : random_pairs(frames, per_pair_of_frames)) {
    PointPair& point = points.emplace_back();
    point.moving = pair.moving;
    point.fixed = pair.fixed;
    point.frame_t1 = pair.frame_t1;
    point.frame_t2 = pair.frame_t2;
    const Eigen::Matrix3d root = Eigen::Matrix3d::NullaryExpr([&] { return normal(engine); });
    point.information = 1e4 * (root * root.transpose() + 0.1 * Eigen::Matrix3d::Identity());
  }
  return points;
}

TEST(SurfaceEquations, PointsEqualTheDenseCovarianceToo) {
  // Oracle as above, three rows a point.
  const std::vector<PointPair> points = random_points(3, 3);  // 9 of a photo: each counts itself
  const SurfaceEquations actual = surface_equations({}, points, kPivot, &kSpread, 1e-6);
  const auto n = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(3 * n, 3 * n), jacobian(3 * n, 7);
  Eigen::VectorXd residual(3 * n);
  std::vector<Eigen::Vector3d> center1(3, Eigen::Vector3d::Zero()), center2 = center1;
  for (const PointPair& point : points) {
    center1[static_cast<size_t>(point.frame_t1)] += point.moving / 9;
    center2[static_cast<size_t>(point.frame_t2)] += point.fixed / 9;
  }
  for (Eigen::Index a = 0; a < n; ++a) {
    const PointPair& p = points[static_cast<size_t>(a)];
    jacobian.middleRows<3>(3 * a) = point_jacobian(p.moving - kPivot);
    residual.segment<3>(3 * a) = p.moving - p.fixed;
    covariance.block<3, 3>(3 * a, 3 * a) += p.information.inverse();
  }
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = 0; b < n; ++b) {
      const PointPair &p = points[static_cast<size_t>(a)], &q = points[static_cast<size_t>(b)];
      const auto shared = [&](const Eigen::Vector3d& center) -> Eigen::Matrix3d {
        const Matrix7 change = pivot_change(kPivot - center);
        return jacobian.middleRows<3>(3 * a) * change * kSpread.covariance() * change.transpose() *
               jacobian.middleRows<3>(3 * b).transpose();
      };
      if (p.frame_t1 == q.frame_t1) {
        covariance.block<3, 3>(3 * a, 3 * b) += shared(center1[static_cast<size_t>(p.frame_t1)]);
      }
      if (p.frame_t2 == q.frame_t2) {
        covariance.block<3, 3>(3 * a, 3 * b) += shared(center2[static_cast<size_t>(p.frame_t2)]);
      }
    }
  }
  const Eigen::MatrixXd solved = covariance.ldlt().solve(jacobian);
  const Matrix7 information = jacobian.transpose() * solved;
  const Vector7 gradient = solved.transpose() * residual;
  EXPECT_LT((actual.information - information).norm(), 1e-8 * information.norm());
  EXPECT_LT((actual.gradient - gradient).norm(), 1e-8 * gradient.norm());
}

TEST(SurfaceEquations, PointsAddToPairs) {
  const std::vector<SurfacePair> pairs = random_pairs(3, 8);
  const std::vector<PointPair> points = random_points(3, 3);
  const Matrix7 both = surface_equations(pairs, points, kPivot, &kSpread, 1e-6).information;
  const Matrix7 alone = surface_equations(pairs, {}, kPivot, &kSpread, 1e-6).information;
  EXPECT_GT((both - alone).ldlt().vectorD().minCoeff(), 0);
  const Matrix7 independent = surface_equations(pairs, points, kPivot, nullptr, 1e-6).information;
  Matrix7 sum = surface_equations(pairs, {}, kPivot, nullptr, 1e-6).information;
  for (const PointPair& point : points) {
    const Matrix3x7 jacobian = point_jacobian(point.moving - kPivot);
    sum += jacobian.transpose() * point.information * jacobian;
  }
  EXPECT_LT((independent - sum).norm(), 1e-12 * sum.norm());
}

TEST(PhotoErrors, DisplacementIsWhatBothPhotosErr) {
  const std::vector<PointPair> points = random_points(2, 5);
  const SurfaceEquations equations = surface_equations({}, points, kPivot, &kSpread, 1e-6);
  ASSERT_TRUE(equations.photos);
  const PhotoErrors& photos = *equations.photos;
  const Vector7 theta = 0.01 * Vector7::Ones();
  const PointPair& point = points[13];
  const Eigen::VectorXd b = photos.mean + photos.response * theta;
  const Eigen::Index i = point.frame_t1, j = 2 + point.frame_t2;
  const Eigen::Vector3d expected =
      small_similarity(b.segment<7>(7 * i), photos.centers[static_cast<size_t>(i)]) * point.moving -
      point.moving -
      (small_similarity(b.segment<7>(7 * j), photos.centers[static_cast<size_t>(j)]) * point.fixed -
       point.fixed);
  EXPECT_LT((photos.displacement(point, theta) - expected).norm(), 0.1 * expected.norm());
}

TEST(SurfaceEquations, ManyPhotosAreGatheredIntoNeighbours) {
  std::vector<SurfacePair> pairs = random_pairs(2, 500);
  for (size_t i = 0; i < pairs.size(); ++i) {
    pairs[i].frame_t1 = static_cast<int32_t>(i % 200);
    pairs[i].frame_t2 = static_cast<int32_t>((i / 3) % 200);
  }
  const SurfaceEquations result = surface_equations(pairs, {}, kPivot, &kSpread, 1e-6);
  EXPECT_GT(result.information.ldlt().vectorD().minCoeff(), 0);
}

}  // namespace
}  // namespace vggtcd
