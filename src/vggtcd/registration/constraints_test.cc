// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/registration/constraints.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <random>

#include "vggtcd/registration/robust.h"

namespace vggtcd {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::MatchesRegex;
using testing::StartsWith;

// Surfaces made of points on them, one to a square of 0.05, with the normals that photos would
// give: off by normal_sigma_rad. Two samples of a surface share no point.
class Surface {
 public:
  explicit Surface(unsigned seed, double normal_sigma_rad = 0.03)
      : random_(seed), noise_(0, normal_sigma_rad) {
    points_.voxel_size_u = 0.05;
    points_.cameras.assign(12, {0, 0, 0});
  }
  void add(const Eigen::Vector3d& x, const Eigen::Vector3d& normal) {
    const Eigen::Vector3d tilt(noise_(random_), noise_(random_), noise_(random_));
    points_.positions.push_back(x.cast<float>());
    points_.normals.push_back((normal + tilt).normalized().cast<float>());
    points_.frames.push_back(static_cast<int32_t>(points_.frames.size() * 7 % 12));
  }
  // The rectangle at `corner` with these edges; the normal is u x v.
  void add_wall(const Eigen::Vector3d& corner, const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    std::uniform_real_distribution<double> in(0, 1);
    const int count = static_cast<int>(u.norm() * v.norm() / (0.05 * 0.05));
    for (int i = 0; i < count; ++i) {
      add(corner + in(random_)*u + in(random_)*v, u.cross(v).normalized());
    }
  }
  // The part of a sphere that is above the plane z = center.z + bottom.
  void add_dome(const Eigen::Vector3d& center, double radius, double bottom) {
    std::uniform_real_distribution<double> height(bottom / radius, 1), around(0, 2 * M_PI);
    const int count = static_cast<int>(2 * M_PI * radius * (radius - bottom) / (0.05 * 0.05));
    for (int i = 0; i < count; ++i) {
      const double z = height(random_), angle = around(random_), r = std::sqrt(1 - z * z);
      const Eigen::Vector3d outward(r * std::cos(angle), r * std::sin(angle), z);
      add(center + radius * outward, -outward);
    }
  }
  const OrientedPoints& points() const { return points_; }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> noise_;
  OrientedPoints points_;
};

// What robust registration says about two samples of one surface, half a standard deviation apart.
template <typename Build>
RobustResult align(const Build& build) {
  Surface t1(1), t2(2);
  build(t1);
  build(t2);
  Vector7 error;
  error << 0.01, -0.01, 0.01, 0.02, -0.02, 0.02, 0.01;
  return align_robust(t1.points(), t2.points(), {}, small_similarity(error, {0, 0, 0}), {}, {});
}

const Eigen::Vector3d kX = Eigen::Vector3d::UnitX(), kY = Eigen::Vector3d::UnitY(),
                      kZ = Eigen::Vector3d::UnitZ();

TEST(Constraints, ASinglePlaneLeavesSlidingTurningAndGrowth) {
  const RobustResult result = align([](Surface& s) { s.add_wall({-2, -2, 1}, 4 * kX, 4 * kY); });
  EXPECT_EQ(result.open_degrees_of_freedom, 4);
  EXPECT_THAT(result.open_motions,
              ElementsAre(StartsWith("sliding across (0.00, 0.00, 1.00)"),
                          StartsWith("turning about (0.00, 0.00, 1.00) through"),
                          StartsWith("growing or shrinking about")));
  EXPECT_THAT(result.explanation, HasSubstr("Held by the initial alignment only"));
}

// Two walls that face each other, without ends: only their distance and parallelism hold.
TEST(Constraints, TwoParallelWallsLeaveSlidingAlongThem) {
  const RobustResult result = align([](Surface& s) {
    s.add_wall({-3, -1, -1}, 6 * kX, 2 * kZ);
    s.add_wall({-3, 1, -1}, 6 * kX, 2 * kZ);
  });
  EXPECT_EQ(result.open_degrees_of_freedom, 3);
  EXPECT_THAT(result.open_motions,
              ElementsAre(StartsWith("sliding across (0.00, 1.00, 0.00)"),
                          StartsWith("turning about (0.00, 1.00, 0.00) through")));
}

TEST(Constraints, ACorridorOfFourWallsLeavesSlidingAlongItsAxis) {
  // Not along an axis of the frame: 30 degrees about z.
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(M_PI / 6, kZ).toRotationMatrix();
  const RobustResult result = align([&](Surface& s) {
    const Eigen::Vector3d along = turn * kX, across = turn * kY;
    const Eigen::Vector3d start = -3 * along - across - 1.2 * kZ;
    s.add_wall(start, 6 * along, 2 * across);
    s.add_wall(start + 2.4 * kZ, 6 * along, 2 * across);
    s.add_wall(start, 6 * along, 2.4 * kZ);
    s.add_wall(start + 2 * across, 6 * along, 2.4 * kZ);
  });
  EXPECT_EQ(result.open_degrees_of_freedom, 1);
  ASSERT_EQ(result.open_motions.size(), 1u);
  double x = 0, y = 0, z = 0;
  ASSERT_EQ(
      std::sscanf(result.open_motions[0].c_str(), "sliding along (%lf, %lf, %lf)", &x, &y, &z), 3)
      << result.open_motions[0];
  // Within two degrees.
  EXPECT_GT(Eigen::Vector3d(x, y, z).normalized().dot(turn * kX), std::cos(2 * M_PI / 180));
  // What the walls leave open stays as it was given: the error of 0.022 along the corridor.
  const Eigen::Vector3d left = result.t2_from_t1 * Eigen::Vector3d(0, 0, 0);
  EXPECT_LT(std::abs(left.dot(turn * kY)), 0.004);
  EXPECT_NEAR(left.dot(turn * kX), (turn * kX).dot(Eigen::Vector3d(0.02, -0.02, 0.02)), 0.004);
}

TEST(Constraints, ACorridorWithAnEndIsHeld) {
  const RobustResult result = align([](Surface& s) {
    s.add_wall({-3, -1, -1.2}, 6 * kX, 2 * kY);
    s.add_wall({-3, -1, -1.2}, 6 * kX, 2.4 * kZ);
    s.add_wall({-3, 1, -1.2}, 6 * kX, 2.4 * kZ);
    s.add_wall({3, -1, -1.2}, 2 * kY, 2.4 * kZ);
  });
  EXPECT_THAT(result.open_motions, IsEmpty());
  EXPECT_THAT(result.explanation, Not(HasSubstr("Held by")));
}

TEST(Constraints, ATexturelessDomeLeavesTurningAboutItsCentre) {
  const RobustResult result = align([](Surface& s) { s.add_dome({0.5, 0, 1}, 2, -0.5); });
  EXPECT_EQ(result.open_degrees_of_freedom, 3);
  ASSERT_EQ(result.open_motions.size(), 1u);
  double x = 0, y = 0, z = 0;
  ASSERT_EQ(std::sscanf(result.open_motions[0].c_str(),
                        "turning in any direction about (%lf, %lf, %lf)", &x, &y, &z),
            3)
      << result.open_motions[0];
  // The mean of the points is 0.75 above it; a tenth of the radius is what the words are good for.
  EXPECT_LT((Eigen::Vector3d(x, y, z) - Eigen::Vector3d(0.5, 0, 1)).norm(), 0.2);
}

// The law itself, without surfaces: information about everything but some motions.
TEST(ConstraintsOf, NamesWhatTheInformationLeavesOut) {
  const Matrix7 prior = FrameSpread{0.02, 0.1, 0.02}.covariance();
  const auto open = [&](const std::vector<Vector7>& motions) {
    Eigen::Matrix<double, 7, Eigen::Dynamic> basis(7, static_cast<Eigen::Index>(motions.size()));
    for (size_t k = 0; k < motions.size(); ++k) {
      basis.col(static_cast<Eigen::Index>(k)) =
          motions[k].cwiseQuotient(prior.diagonal().cwiseSqrt());
    }
    const Eigen::MatrixXd q = Eigen::HouseholderQR<Eigen::MatrixXd>(basis).householderQ() *
                              Eigen::MatrixXd::Identity(7, basis.cols());
    const Matrix7 held = Matrix7::Identity() - Matrix7(q * q.transpose());
    const Matrix7 scale = prior.diagonal().cwiseSqrt().cwiseInverse().asDiagonal();
    return constraints_of(1e4 * scale * held * scale, prior, {1, 2, 3});
  };
  EXPECT_THAT(open({}).open_motions, IsEmpty());
  EXPECT_GT(open({}).constrained_share.minCoeff(), 0.99);
  EXPECT_THAT(open({Vector7::Unit(4)}).open_motions,
              ElementsAre("sliding along (0.00, 1.00, 0.00)"));
  EXPECT_LT(open({Vector7::Unit(4)}).constrained_share[4], 0.01);
  EXPECT_THAT(open({Vector7::Unit(3), Vector7::Unit(4), Vector7::Unit(5)}).open_motions,
              ElementsAre("sliding in any direction"));
  EXPECT_THAT(open({Vector7::Unit(6)}).open_motions,
              ElementsAre("growing or shrinking about (1, 2, 3)"));
  // Turning about the z axis through (0, 2, 0): the pivot, 1 beside it, moves by 1 along y.
  Vector7 turn = Vector7::Unit(2);
  turn[4] = 1;
  EXPECT_THAT(
      open({turn}).open_motions,
      ElementsAre(MatchesRegex("turning about .0.00, 0.00, 1.00. through .[0-9.e-]+, 2, 3.")));
}

}  // namespace
}  // namespace vggtcd
