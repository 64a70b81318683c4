// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/registration/camera_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <vector>

namespace vggtcd {
namespace {

const Eigen::Vector3d kPivot(0.3, -0.2, 1.0);

// Cameras on an arc, each looking at a place of its own four units ahead.
struct Walk {
  std::vector<Eigen::Vector3d> cameras, shown;
  explicit Walk(double offset) {
    for (int k = 0; k < 12; ++k) {
      const double angle = 0.15 * k + offset;
      cameras.push_back({3 * std::cos(angle), 3 * std::sin(angle), 0.1 * k});
      shown.push_back(cameras.back() + Eigen::Vector3d(-4 * std::cos(angle), 0.5, 0.3));
    }
  }
};

// What the photos would be said to err: `of_t1`, given about the pivot, for all of T1's.
PhotoErrors photos_of(const Walk& t1, const Walk& t2, const Vector7& of_t1, double sigma) {
  PhotoErrors photos;
  photos.centers = t1.shown;
  photos.centers.insert(photos.centers.end(), t2.shown.begin(), t2.shown.end());
  photos.groups = PhotoGroups(
      {static_cast<int32_t>(t1.cameras.size()), static_cast<int32_t>(t2.cameras.size())});
  photos.known.assign(photos.centers.size(), true);
  const Eigen::Index size = 7 * static_cast<Eigen::Index>(photos.centers.size());
  photos.mean = Eigen::VectorXd::Zero(size);
  for (size_t k = 0; k < t1.shown.size(); ++k) {
    photos.mean.segment<7>(7 * static_cast<Eigen::Index>(k)) =
        pivot_change(t1.shown[k] - kPivot) * of_t1;
  }
  photos.response = Eigen::MatrixXd::Zero(size, 7);
  photos.covariance = sigma * sigma * Eigen::MatrixXd::Identity(size, size);
  return photos;
}

const Vector7 kCommon = (Vector7() << 1, -2, 3, 4, -5, 6, 7).finished() * 1e-3;

TEST(FitCameras, WhatAllPhotosOfAnEpochErrAlikeIsTheEpochs) {
  const Walk t1(0), t2(0.4);
  const CameraFit fit = fit_cameras(photos_of(t1, t2, kCommon, 0), t1.cameras, t2.cameras, kPivot,
                                    Matrix7::Zero(), {});
  EXPECT_LT((fit.step - kCommon).norm(), 1e-12);
  // The same error of T2's photos is the opposite correction.
  PhotoErrors of_t2 = photos_of(t1, t2, Vector7::Zero(), 0);
  for (size_t k = 0; k < 12; ++k) {
    of_t2.mean.segment<7>(7 * static_cast<Eigen::Index>(12 + k)) =
        pivot_change(t2.shown[k] - kPivot) * kCommon;
  }
  const CameraFit opposite =
      fit_cameras(of_t2, t1.cameras, t2.cameras, kPivot, Matrix7::Zero(), {});
  EXPECT_LT((opposite.step + kCommon).norm(), 1e-12);
}

TEST(FitCameras, CarriesTheCamerasWhereTheirPhotosPutThem) {
  // Photos that turn about what they show: the surfaces stay, the cameras move. The fit must bring
  // the cameras at least three times nearer to where they belong than the surfaces' answer (zero).
  const Walk t1(0), t2(0.4);
  PhotoErrors photos = photos_of(t1, t2, Vector7::Zero(), 0);
  const Vector7 turn = (Vector7() << 0, 0, 0.01, 0, 0, 0, 0).finished();
  for (Eigen::Index k = 0; k < 12; ++k) photos.mean.segment<7>(7 * k) = turn;
  const CameraFit fit = fit_cameras(photos, t1.cameras, t2.cameras, kPivot, Matrix7::Zero(), {});
  double before = 0, after = 0;
  for (size_t k = 0; k < 12; ++k) {
    const Eigen::Vector3d belongs = small_similarity(turn, t1.shown[k]) * t1.cameras[k];
    before += (belongs - t1.cameras[k]).squaredNorm();
    after += (belongs - small_similarity(fit.step, kPivot) * t1.cameras[k]).squaredNorm();
  }
  EXPECT_LT(std::sqrt(after), std::sqrt(before) / 3);
}

TEST(FitCameras, AStraightWalkLeavesNoRotationOpen) {
  // Cameras on a line say nothing about turning around it; what the photos show does.
  Walk t1(0), t2(0);
  for (size_t k = 0; k < 12; ++k) {
    t1.cameras[k] = t2.cameras[k] = {0.2 * static_cast<double>(k), 0, 0};
    t1.shown[k] = t2.shown[k] = t1.cameras[k] + Eigen::Vector3d(0, 4, 0);
  }
  const CameraFit fit = fit_cameras(photos_of(t1, t2, kCommon, 0), t1.cameras, t2.cameras, kPivot,
                                    Matrix7::Zero(), {});
  EXPECT_LT((fit.step - kCommon).norm(), 1e-12);
}

TEST(FitCameras, WhatAllErrAlikeIsNoBend) {
  const Walk t1(0), t2(0.4);
  const CameraFit fit = fit_cameras(photos_of(t1, t2, kCommon, 0), t1.cameras, t2.cameras, kPivot,
                                    Matrix7::Zero(), {});
  EXPECT_LT(fit.bend.norm(), 1e-20);
}

TEST(FitCameras, BendIsTheScatterOfTheCamerasAsTwoSamplesOfEachEpoch) {
  // Photos of T1 displaced sideways, one up and one down: a scatter of kShift that no fit takes up.
  constexpr double kShift = 0.1;
  const Walk t1(0), t2(0.4);
  PhotoErrors photos = photos_of(t1, t2, Vector7::Zero(), 0);
  for (Eigen::Index k = 0; k < 12; ++k) photos.mean[7 * k + 5] = k % 2 == 0 ? kShift : -kShift;
  const CameraFit fit = fit_cameras(photos, t1.cameras, t2.cameras, kPivot, Matrix7::Zero(), {});
  // How far it lets T1's cameras go, on average: kShift^2 over two samples, for seven parameters
  // instead of the three of a mean.
  double predicted = 0;
  for (const Eigen::Vector3d& camera : t1.cameras) {
    const Matrix3x7 jacobian = point_jacobian(camera - kPivot);
    predicted += (jacobian * fit.bend * jacobian.transpose()).trace() / 12;
  }
  EXPECT_GT(predicted, 0.5 * kShift * kShift / 2);
  EXPECT_LT(predicted, 7.0 / 3 * kShift * kShift / 2);
}

TEST(FitCameras, TwoPhotosBendAsMuchAsAPhotoIsKnownToErr) {
  Walk t1(0), t2(0.4);
  for (std::vector<Eigen::Vector3d>* list : {&t1.cameras, &t1.shown, &t2.cameras, &t2.shown}) {
    list->resize(2);
  }
  PhotoErrors photos;
  photos.centers = t1.shown;
  photos.centers.insert(photos.centers.end(), t2.shown.begin(), t2.shown.end());
  photos.groups = PhotoGroups({2, 2});
  photos.known.assign(4, true);
  photos.mean = Eigen::VectorXd::Zero(28);
  photos.response = Eigen::MatrixXd::Zero(28, 7);
  photos.covariance = Eigen::MatrixXd::Zero(28, 28);
  const auto bend = [&](double sigma) {
    return fit_cameras(photos, t1.cameras, t2.cameras, kPivot, Matrix7::Zero(), {0, sigma, 0}).bend;
  };
  EXPECT_GT(bend(0.1).ldlt().vectorD().minCoeff(), 0);
  EXPECT_LT((bend(0.1) - 100 * bend(0.01)).norm(), 1e-12 * bend(0.1).norm());
}

TEST(FitCameras, CovarianceIsTheSpreadOfWhatComesOut) {
  // Monte Carlo over photos and the surfaces' similarity, with a response of the photos to it.
  const Walk t1(0), t2(0.4);
  constexpr double kSigma = 0.01, kSurfaceSigma = 0.02, kResponse = -0.3;
  PhotoErrors photos = photos_of(t1, t2, kCommon, kSigma);
  for (Eigen::Index k = 0; k < 24; ++k) {
    photos.response.block<7, 7>(7 * k, 0) = kResponse * Matrix7::Identity();
  }
  const Matrix7 surface = kSurfaceSigma * kSurfaceSigma * Matrix7::Identity();
  const CameraFit expected = fit_cameras(photos, t1.cameras, t2.cameras, kPivot, surface, {});
  std::mt19937 engine(3);
  std::normal_distribution<double> normal;
  constexpr int kDraws = 4000;
  Matrix7 scatter = Matrix7::Zero();
  for (int draw = 0; draw < kDraws; ++draw) {
    const Vector7 theta = kSurfaceSigma * Vector7::NullaryExpr([&] { return normal(engine); });
    PhotoErrors drawn = photos;
    drawn.mean += photos.response * theta +
                  kSigma * Eigen::VectorXd::NullaryExpr(
                               drawn.mean.size(), [&](Eigen::Index) { return normal(engine); });
    const Vector7 error = theta +
                          fit_cameras(drawn, t1.cameras, t2.cameras, kPivot, surface, {}).step -
                          expected.step;
    scatter += error * error.transpose() / kDraws;
  }
  // 4000 draws give a variance to 2.2 %; the tolerance is four of these.
  for (int i = 0; i < 7; ++i) {
    EXPECT_NEAR(scatter(i, i) / expected.covariance(i, i), 1, 0.09) << i;
  }
}

}  // namespace
}  // namespace vggtcd
