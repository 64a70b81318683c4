// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/geometry/umeyama.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Points points_from_json(const nlohmann::json& rows) {
  Points points;
  for (const auto& row : rows) points.emplace_back(row.at(0), row.at(1), row.at(2));
  return points;
}

Points random_points(size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Points points(count);
  for (auto& x : points) x = {normal(random), normal(random), normal(random)};
  return points;
}

Points map(const Points& points, const Sim3& sim3) {
  Points mapped;
  for (const auto& x : points) mapped.push_back(sim3 * x);
  return mapped;
}

const Sim3 kTruth{
    1.7,
    Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix(),
    {3, -1, 20}};

TEST(Umeyama, MatchesTheReferenceImplementation) {
  std::ifstream file(VGGTCD_SOURCE_DIR "/tests/golden/umeyama/umeyama.json");
  const auto cases = nlohmann::json::parse(file);
  ASSERT_EQ(cases.size(), 11u);
  for (const auto& [name, problem] : cases.items()) {
    SCOPED_TRACE(name);
    UmeyamaOptions options;
    options.with_scale = problem.at("with_scale");
    std::vector<double> weights;
    if (problem.contains("weights")) weights = problem.at("weights").get<std::vector<double>>();
    const UmeyamaResult result = umeyama(points_from_json(problem.at("X")),
                                         points_from_json(problem.at("Y")), weights, options);
    // As the reference states: for points in a plane the smallest singular vectors are noise.
    const double tolerance = name == "planar" || name == "three_points" ? 1e-8 : 1e-9;
    EXPECT_TRUE(result.determined()) << describe(result.status);
    EXPECT_NEAR(result.y_from_x.scale, problem.at("s").get<double>(), tolerance);
    const auto t = problem.at("t").get<std::vector<double>>();
    for (int row = 0; row < 3; ++row) {
      EXPECT_NEAR(result.y_from_x.translation(row), t[static_cast<size_t>(row)], tolerance);
      for (int column = 0; column < 3; ++column) {
        EXPECT_NEAR(result.y_from_x.rotation(row, column),
                    problem.at("R").at(static_cast<size_t>(row)).at(static_cast<size_t>(column)),
                    tolerance);
      }
    }
  }
}

TEST(Umeyama, RecoversASimilarityFarFromTheOrigin) {
  Points x = random_points(50, 1);
  for (auto& p : x) p += Eigen::Vector3d(1000, -500, 2000);
  const UmeyamaResult result = umeyama(x, map(x, kTruth));
  ASSERT_TRUE(result.determined());
  EXPECT_NEAR(result.y_from_x.scale, kTruth.scale, 1e-11);
  EXPECT_LT((result.y_from_x.rotation - kTruth.rotation).norm(), 1e-11);
  // The rotation's error times the distance from the origin.
  EXPECT_LT((result.y_from_x.translation - kTruth.translation).norm(), 1e-8);
  EXPECT_EQ(result.rank, 3);
  EXPECT_LT(result.rms, 1e-10);
}

TEST(Umeyama, TheUnitOfThePointsDoesNotMatter) {
  Points x = random_points(50, 21);
  Points y = map(x, kTruth);
  const Points noise = random_points(50, 22);
  std::vector<double> weights(50);
  for (size_t i = 0; i < y.size(); ++i) {
    y[i] += 0.1 * noise[i];
    weights[i] = 0.1 + std::abs(noise[i].x());
  }
  const Sim3 expected = umeyama(x, y, weights).y_from_x;
  for (const double unit : {1e-12, 1e-6, 1e9}) {
    Points scaled_x = x, scaled_y = y;
    for (auto* points : {&scaled_x, &scaled_y}) {
      for (auto& p : *points) p *= unit;
    }
    std::vector<double> by_depth = weights;  // as 1 / depth^2
    for (double& weight : by_depth) weight /= unit * unit;
    const UmeyamaResult found = umeyama(scaled_x, scaled_y, by_depth);
    ASSERT_TRUE(found.determined()) << unit;
    EXPECT_NEAR(found.y_from_x.scale / expected.scale, 1, 2e-9) << unit;
    EXPECT_LT((found.y_from_x.rotation - expected.rotation).norm(), 1e-12) << unit;
    EXPECT_LT((found.y_from_x.translation / unit - expected.translation).norm(), 1e-8) << unit;
  }
}

TEST(Umeyama, NoNearbySimilarityFitsNoisyPointsBetter) {
  const Points x = random_points(40, 2), noise = random_points(40, 3);
  Points y = map(x, kTruth);
  for (size_t i = 0; i < y.size(); ++i) y[i] += 0.1 * noise[i];
  const std::vector<double> weights(40, 1.0);
  const Sim3 best = umeyama(x, y, weights).y_from_x;
  const auto cost = [&](const Sim3& sim3) {
    double sum = 0;
    for (size_t i = 0; i < x.size(); ++i) sum += (y[i] - sim3 * x[i]).squaredNorm();
    return sum;
  };
  std::mt19937 random(4);
  std::normal_distribution<double> normal(0, 1e-3);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Vector3d turn(normal(random), normal(random), normal(random));
    const Sim3 other{best.scale * (1 + normal(random)),
                     Eigen::AngleAxisd(turn.norm(), turn.normalized()) * best.rotation,
                     best.translation + Eigen::Vector3d(normal(random), normal(random), 0)};
    EXPECT_GT(cost(other), cost(best));
  }
}

TEST(Umeyama, NeverReturnsAMirroring) {
  const Points x = random_points(30, 5);
  Points y = x;
  for (auto& p : y) p.z() = -p.z();
  const UmeyamaResult result = umeyama(x, y);
  EXPECT_TRUE(result.reflected);
  EXPECT_NEAR(result.y_from_x.rotation.determinant(), 1, 1e-12);
}

TEST(Umeyama, ReportsPointsOnALine) {
  Points x;
  for (int i = 0; i < 20; ++i) x.push_back(Eigen::Vector3d(1, 2, 3) * i + Eigen::Vector3d(5, 0, 1));
  const UmeyamaResult result = umeyama(x, map(x, kTruth));
  EXPECT_EQ(result.status, UmeyamaStatus::kCollinear);
  EXPECT_EQ(result.rank, 1);
  EXPECT_FALSE(result.determined());
  // One of the equally good solutions: it maps the line onto the line.
  EXPECT_LT(result.rms, 1e-10);
}

TEST(Umeyama, AcceptsAPlane) {
  Points x = random_points(20, 6);
  for (auto& p : x) p.z() = 4;
  const UmeyamaResult result = umeyama(x, map(x, kTruth));
  ASSERT_TRUE(result.determined());
  EXPECT_EQ(result.rank, 2);
  EXPECT_LT((result.y_from_x.rotation - kTruth.rotation).norm(), 1e-11);
}

TEST(Umeyama, ReportsCoincidentAndTooFewPoints) {
  const Points same(10, Eigen::Vector3d(1e6, 0.1, 7)), spread = random_points(10, 7);
  EXPECT_EQ(umeyama(same, spread).status, UmeyamaStatus::kCoincident);
  EXPECT_EQ(umeyama(spread, same).status, UmeyamaStatus::kCoincident);
  EXPECT_EQ(umeyama({}, {}).status, UmeyamaStatus::kTooFewPoints);
  EXPECT_EQ(umeyama(std::span(spread).first(2), std::span(spread).first(2)).status,
            UmeyamaStatus::kTooFewPoints);
}

TEST(Umeyama, ReportsAMirrorThatCouldBeUndoneInTwoWays) {
  // The corners of a cube, turned inside out: every rotation by pi fits equally well.
  Points x, y;
  for (int corner = 0; corner < 8; ++corner) {
    x.emplace_back(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    y.push_back(-x.back());
  }
  EXPECT_EQ(umeyama(x, y).status, UmeyamaStatus::kAmbiguousMirror);
}

TEST(Umeyama, PointsOfWeightZeroDoNotCount) {
  const Points x = random_points(30, 8);
  Points y = map(x, kTruth);
  std::vector<double> weights(30, 2.0);
  for (size_t i = 0; i < 10; ++i) {
    y[i] += Eigen::Vector3d(5, 5, 5);
    weights[i] = 0;
  }
  const UmeyamaResult result = umeyama(x, y, weights);
  // The floor of 1e-12 lets 10 outliers of size 9 in with a share of 1e-12 / 2 each.
  EXPECT_LT((result.y_from_x.translation - kTruth.translation).norm(), 1e-10);
}

TEST(Umeyama, RefusesNonsense) {
  const Points x = random_points(5, 9);
  Points bad = x;
  bad[2].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(umeyama(x, bad), Error);
  EXPECT_THROW(umeyama(x, std::span(x).first(4)), Error);
  EXPECT_THROW(umeyama(x, x, std::vector<double>{1, 1, 1, 1, -1}), Error);
  EXPECT_THROW(umeyama(x, x, std::vector<double>{1, 1}), Error);
}

}  // namespace
}  // namespace vggtcd
