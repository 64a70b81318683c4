// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/registration/frame_equations.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace vggtcd {
namespace {

const Eigen::Vector3d kPivot(0.5, -1, 2);
constexpr FrameSpread kSpread{0.02, 0.05, 0.03};
constexpr PhotoCounts kPhotos{3, 3};

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

std::vector<PointPair> random_points(int frames, int per_pair_of_frames) {
  std::mt19937 engine(9);
  std::normal_distribution<double> normal;
  std::vector<PointPair> points;
  for (const SurfacePair& pair : random_pairs(frames, per_pair_of_frames)) {
    PointPair& point = points.emplace_back();
    point.first = pair.moving;
    point.second = pair.fixed;
    point.first_photo = {true, pair.frame_t1};
    point.second_photo = {false, pair.frame_t2};
    const Eigen::Matrix3d root = Eigen::Matrix3d::NullaryExpr([&] { return normal(engine); });
    point.information = 1e4 * (root * root.transpose() + 0.1 * Eigen::Matrix3d::Identity());
  }
  return points;
}

Vector7 jacobian_of(const SurfacePair& pair) {
  const Eigen::Vector3d arm = pair.moving - kPivot;
  Vector7 jacobian;
  jacobian << arm.cross(pair.normal), pair.normal, pair.normal.dot(arm);
  return jacobian;
}

TEST(FrameEquations, MarginalisedPhotosEqualTheDenseCovariance) {
  // Oracle: r = J theta + e with cov(e) = noise + sum over photos of their own similarity;
  // information J^T cov^-1 J, built dense over all pairs.
  const std::vector<SurfacePair> pairs = random_pairs(3, 8);
  const FrameEquations actual = frame_equations(pairs, {}, kPhotos, kPivot, &kSpread, 1e-6);
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

TEST(FrameEquations, APhotoIsOneWitnessHoweverManyPointsItHas) {
  std::vector<PointPair> points = random_points(3, 200);
  const Matrix7 once = frame_equations({}, points, kPhotos, kPivot, &kSpread, 1e-6).information;
  const Matrix7 once_free = frame_equations({}, points, kPhotos, kPivot, nullptr, 1e-6).information;
  const std::vector<PointPair> copy = points;
  for (int k = 1; k < 10; ++k) points.insert(points.end(), copy.begin(), copy.end());
  const Matrix7 tenfold = frame_equations({}, points, kPhotos, kPivot, &kSpread, 1e-6).information;
  const Matrix7 tenfold_free =
      frame_equations({}, points, kPhotos, kPivot, nullptr, 1e-6).information;
  EXPECT_NEAR(tenfold_free.trace() / once_free.trace(), 10, 1e-6);
  EXPECT_GT(tenfold(3, 3) / once(3, 3), 1);
  EXPECT_LT(tenfold(3, 3) / once(3, 3), 1.1);
}

TEST(FrameEquations, APhotosPairsCountAsItsPatches) {
  std::vector<SurfacePair> pairs = random_pairs(3, 200);
  constexpr FrameSpread kNothing{1e-9, 1e-9, 1e-9};
  const Matrix7 sure = frame_equations(pairs, {}, kPhotos, kPivot, &kNothing, 1e-6).information;
  const Matrix7 free = frame_equations(pairs, {}, kPhotos, kPivot, nullptr, 1e-6).information;
  const double share = 20.0 / 600;  // a photo has 600 of the 1800 pairs
  EXPECT_LT((sure - share / 0.5 * free).norm(), 1e-6 * sure.norm());
}

TEST(FrameEquations, PointsEqualTheDenseCovarianceToo) {
  // Oracle as above, three rows a point.
  const std::vector<PointPair> points = random_points(3, 3);  // 9 of a photo: each counts itself
  const FrameEquations actual = frame_equations({}, points, kPhotos, kPivot, &kSpread, 1e-6);
  const auto n = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(3 * n, 3 * n), jacobian(3 * n, 7);
  Eigen::VectorXd residual(3 * n);
  std::vector<Eigen::Vector3d> center1(3, Eigen::Vector3d::Zero()), center2 = center1;
  for (const PointPair& point : points) {
    center1[static_cast<size_t>(point.first_photo.frame)] += point.first / 9;
    center2[static_cast<size_t>(point.second_photo.frame)] += point.second / 9;
  }
  for (Eigen::Index a = 0; a < n; ++a) {
    const PointPair& p = points[static_cast<size_t>(a)];
    jacobian.middleRows<3>(3 * a) = point_jacobian(p.first - kPivot);
    residual.segment<3>(3 * a) = p.first - p.second;
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
      if (p.first_photo.frame == q.first_photo.frame) {
        covariance.block<3, 3>(3 * a, 3 * b) +=
            shared(center1[static_cast<size_t>(p.first_photo.frame)]);
      }
      if (p.second_photo.frame == q.second_photo.frame) {
        covariance.block<3, 3>(3 * a, 3 * b) +=
            shared(center2[static_cast<size_t>(p.second_photo.frame)]);
      }
    }
  }
  const Eigen::MatrixXd solved = covariance.ldlt().solve(jacobian);
  const Matrix7 information = jacobian.transpose() * solved;
  const Vector7 gradient = solved.transpose() * residual;
  EXPECT_LT((actual.information - information).norm(), 1e-8 * information.norm());
  EXPECT_LT((actual.gradient - gradient).norm(), 1e-8 * gradient.norm());
}

TEST(FrameEquations, PointsAddToPairs) {
  const std::vector<SurfacePair> pairs = random_pairs(3, 8);
  const std::vector<PointPair> points = random_points(3, 3);
  const Matrix7 both = frame_equations(pairs, points, kPhotos, kPivot, &kSpread, 1e-6).information;
  const Matrix7 alone = frame_equations(pairs, {}, kPhotos, kPivot, &kSpread, 1e-6).information;
  EXPECT_GT((both - alone).ldlt().vectorD().minCoeff(), 0);
  const Matrix7 independent =
      frame_equations(pairs, points, kPhotos, kPivot, nullptr, 1e-6).information;
  Matrix7 sum = frame_equations(pairs, {}, kPhotos, kPivot, nullptr, 1e-6).information;
  for (const PointPair& point : points) {
    const Matrix3x7 jacobian = point_jacobian(point.first - kPivot);
    sum += jacobian.transpose() * point.information * jacobian;
  }
  EXPECT_LT((independent - sum).norm(), 1e-12 * sum.norm());
}

TEST(PhotoErrors, DisplacementIsWhatBothPhotosErr) {
  const std::vector<PointPair> points = random_points(2, 5);
  const FrameEquations equations = frame_equations({}, points, kPhotos, kPivot, &kSpread, 1e-6);
  ASSERT_TRUE(equations.photos);
  const PhotoErrors& photos = *equations.photos;
  const Vector7 theta = 0.01 * Vector7::Ones();
  const PointPair& point = points[13];
  const Eigen::VectorXd b = photos.mean + photos.response * theta;
  const Eigen::Index i = point.first_photo.frame, j = 3 + point.second_photo.frame;
  const Eigen::Vector3d expected =
      point_jacobian(point.first - photos.centers[static_cast<size_t>(i)]) * b.segment<7>(7 * i) -
      point_jacobian(point.second - photos.centers[static_cast<size_t>(j)]) * b.segment<7>(7 * j);
  EXPECT_GT(expected.norm(), 1e-4);
  EXPECT_LT((photos.displacement(point, theta) - expected).norm(), 1e-12);
}

TEST(PhotoErrors, TiesOfOneEpochTellWhichOfItsPhotosErrs) {
  // Photo 0 of T1 shows all its places 0.02 too far along x, against 1 and 2 of T1 as against T2.
  std::vector<PointPair> points;
  const Eigen::Vector3d off(0.02, 0, 0);
  for (const PointPair& pattern : random_points(3, 30)) {
    PointPair point = pattern;
    point.information = 1e8 * Eigen::Matrix3d::Identity();
    point.second = point.first;
    if (point.first_photo.frame == 0) point.first += off;
    points.push_back(point);
    // And the same place between two photos of T1.
    point.second_photo = {true, (point.first_photo.frame + 1) % 3};
    point.first = point.second = pattern.first;
    if (point.first_photo.frame == 0) point.first += off;
    if (point.second_photo.frame == 0) point.second += off;
    points.push_back(point);
  }
  const auto error_of = [&](const std::vector<PointPair>& ties, Eigen::Index photo) {
    const PhotoErrors errors = photo_errors({}, ties, kPhotos, kPivot, kSpread, 1e-6);
    return Eigen::Vector3d(errors.mean.segment<3>(7 * photo + 3));
  };
  const Eigen::Vector3d first = error_of(points, 0), second = error_of(points, 1);
  // theta is free here, so it is the difference between the photos that is known.
  EXPECT_LT((first - second + off).norm(), 1e-3);
  // They add nothing about theta.
  std::vector<PointPair> within;
  for (const PointPair& point : points) {
    if (point.second_photo.of_t1) within.push_back(point);
  }
  EXPECT_EQ(frame_equations({}, within, kPhotos, kPivot, &kSpread, 1e-6).information.norm(), 0);
  EXPECT_EQ(frame_equations({}, within, kPhotos, kPivot, nullptr, 1e-6).information.norm(), 0);
}

TEST(PhotoErrors, KnowWhichPhotosNothingWasSaidAbout) {
  std::vector<PointPair> points = random_points(2, 5);
  const PhotoErrors errors = photo_errors({}, points, kPhotos, kPivot, kSpread, 1e-6);
  EXPECT_EQ(errors.known, (std::vector<bool>{true, true, false, true, true, false}));
}

TEST(PhotoGroups, NeighboursShareAGroup) {
  const PhotoGroups groups({200, 10});
  EXPECT_EQ(groups.count(), 58u);
  EXPECT_EQ(groups.of({true, 0}), 0u);
  EXPECT_EQ(groups.of({true, 1}), 0u);
  EXPECT_EQ(groups.of({true, 199}), 47u);
  EXPECT_EQ(groups.of({false, 0}), 48u);
  EXPECT_EQ(groups.of({false, 9}), 57u);
}

TEST(FrameEquations, ManyPhotosAreGatheredIntoNeighbours) {
  std::vector<SurfacePair> pairs = random_pairs(2, 500);
  for (size_t i = 0; i < pairs.size(); ++i) {
    pairs[i].frame_t1 = static_cast<int32_t>(i % 200);
    pairs[i].frame_t2 = static_cast<int32_t>((i / 3) % 200);
  }
  const FrameEquations result = frame_equations(pairs, {}, {200, 200}, kPivot, &kSpread, 1e-6);
  EXPECT_GT(result.information.ldlt().vectorD().minCoeff(), 0);
}

}  // namespace
}  // namespace vggtcd
