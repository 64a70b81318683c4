// SPDX-License-Identifier: Apache-2.0
// How well what is static holds each degree of freedom, in words.
#include "vggtcd/registration/constraints.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>

namespace vggtcd {
namespace {

constexpr double kOpenShare = 0.5;
constexpr double kNoiseShare = 0.1;    // of geometry, in a direction that only seems to be held
constexpr size_t kMaxPairs = 1 << 17;  // that are looked at: the shares need no more
constexpr double kPure = 0.9;  // cosine from which a motion counts as a slide, turn or growth

// Motions as columns, each parameter in standard deviations of its prior so that turns, slides and
// growth compare; orthonormal.
using Motions = Eigen::Matrix<double, 7, Eigen::Dynamic>;

std::string in_words(const Eigen::Vector3d& v, const char* format) {
  // + 0.0: no minus before a zero.
  const auto number = [&](double x) { return fmt::format(fmt::runtime(format), x + 0.0); };
  return fmt::format("({}, {}, {})", number(v.x()), number(v.y()), number(v.z()));
}

// A direction without sense: its largest component is positive.
std::string axis_in_words(Eigen::Vector3d axis) {
  axis.normalize();
  Eigen::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  if (axis[largest] < 0) axis = -axis;
  return in_words((axis.array() * 100).round() / 100, "{:.2f}");
}

Motions orthonormal(const Motions& motions) {
  if (motions.cols() == 0) return motions;
  const Eigen::MatrixXd q = Eigen::HouseholderQR<Eigen::MatrixXd>(motions).householderQ() *
                            Eigen::MatrixXd::Identity(7, motions.cols());
  return q;
}

// Takes the motions out of `motions` that are almost only in the rows [first, first + 3): returns
// their directions there, as columns, in standard deviations.
Eigen::Matrix3Xd take_pure(Motions& motions, Eigen::Index first) {
  if (motions.cols() == 0) return Eigen::Matrix3Xd(3, 0);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(motions.middleRows(first, 3),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Index pure = (svd.singularValues().array() > kPure).count();
  const Eigen::Matrix3Xd directions = svd.matrixU().leftCols(pure);
  motions = (motions * svd.matrixV().rightCols(motions.cols() - pure)).eval();
  return directions;
}

// The centre that makes the motions pure turns and growth: for each, the pivot moves by
// t = w x (pivot - centre) + s (pivot - centre), but for the slides, which are free anyway.
Eigen::Vector3d common_center(const Motions& motions, const Vector7& sigma,
                              const Eigen::Matrix3Xd& slides, const Eigen::Vector3d& pivot) {
  Eigen::Matrix3d across = Eigen::Matrix3d::Identity();
  if (slides.cols() > 0) {
    const Eigen::MatrixXd q = Eigen::HouseholderQR<Eigen::MatrixXd>(slides).householderQ() *
                              Eigen::MatrixXd::Identity(3, slides.cols());
    across -= q * q.transpose();
  }
  constexpr double kStay = 1e-6;  // where nothing says otherwise the centre is the pivot
  Eigen::Matrix3d normal = kStay * Eigen::Matrix3d::Identity();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (Eigen::Index k = 0; k < motions.cols(); ++k) {
    const Vector7 motion = motions.col(k).cwiseProduct(sigma) / sigma.segment<3>(0).norm();
    Eigen::Matrix3d lever;
    lever << 0, -motion[2], motion[1], motion[2], 0, -motion[0], -motion[1], motion[0], 0;
    lever += motion[6] * Eigen::Matrix3d::Identity();
    lever = (across * lever).eval();
    normal += lever.transpose() * lever;
    right += lever.transpose() * motion.segment<3>(3);
  }
  return pivot - normal.ldlt().solve(right);
}

std::string slide_in_words(const Eigen::Matrix3Xd& directions) {
  if (directions.cols() == 3) return "sliding in any direction";
  if (directions.cols() == 1) return "sliding along " + axis_in_words(directions.col(0));
  return "sliding across " +
         axis_in_words(
             Eigen::Vector3d(directions.col(0)).cross(Eigen::Vector3d(directions.col(1))));
}

std::string turn_in_words(const Eigen::Matrix3Xd& axes, const std::string& center) {
  if (axes.cols() == 3) return "turning in any direction about " + center;
  const std::string about = axis_in_words(axes.col(0));
  if (axes.cols() == 1) return fmt::format("turning about {} through {}", about, center);
  return fmt::format("turning about {} and {} through {}", about, axis_in_words(axes.col(1)),
                     center);
}

// What is neither: its largest parts.
std::string mixture_in_words(const Vector7& motion) {
  constexpr double kNoticeable = 0.4;
  std::vector<std::string> parts;
  const Eigen::Vector3d turn = motion.segment<3>(0), slide = motion.segment<3>(3);
  if (turn.norm() > kNoticeable) parts.push_back("turning about " + axis_in_words(turn));
  if (slide.norm() > kNoticeable) parts.push_back("sliding along " + axis_in_words(slide));
  if (std::abs(motion[6]) > kNoticeable) parts.push_back("growing");
  return fmt::format("{}", fmt::join(parts, " with "));
}

std::vector<std::string> describe(Motions motions, const Vector7& sigma,
                                  const Eigen::Vector3d& pivot,
                                  const Eigen::Vector3d& origin_in_world) {
  std::vector<std::string> texts;
  Eigen::Matrix3Xd slides = take_pure(motions, 3);
  for (Eigen::Index k = 0; k < slides.cols(); ++k) {
    slides.col(k) = slides.col(k).cwiseProduct(sigma.segment<3>(3)).normalized();
  }
  if (slides.cols() > 0) texts.push_back(slide_in_words(slides));
  const Eigen::Vector3d center = common_center(motions, sigma, slides, pivot);
  const Matrix7 to_center = sigma.cwiseInverse().asDiagonal() * pivot_change(center - pivot) *
                            Matrix7(sigma.asDiagonal());
  motions = orthonormal(to_center * motions);
  const std::string where = origin_in_world.isZero(0)
                                ? in_words(center, "{:.3g}")
                                : in_words(origin_in_world + center, "{:.9g}");
  const Eigen::Matrix3Xd turns = take_pure(motions, 0);
  if (turns.cols() > 0) texts.push_back(turn_in_words(turns, where));
  for (Eigen::Index k = 0; k < motions.cols(); ++k) {
    const Vector7 motion = motions.col(k).normalized();
    texts.push_back(std::abs(motion[6]) > kPure ? "growing or shrinking about " + where
                                                : mixture_in_words(motion));
  }
  return texts;
}

}  // namespace

Matrix7 without_normal_noise(const Matrix7& surface_information,
                             const std::vector<SurfacePair>& pairs, const Eigen::Vector3d& pivot) {
  Matrix7 apparent = Matrix7::Zero(), common = Matrix7::Zero();
  const size_t stride = pairs.size() / kMaxPairs + 1;
  for (size_t i = 0; i < pairs.size(); i += stride) {
    const Eigen::Vector3d arm = pairs[i].moving - pivot;
    const Vector7 a = plane_jacobian(arm, pairs[i].normal);
    const Vector7 b = plane_jacobian(arm, pairs[i].own_normal.cast<double>());
    apparent += 0.5 * (a * a.transpose() + b * b.transpose());
    common += 0.5 * (a * b.transpose() + b * a.transpose());
  }
  constexpr double kRegular = 1e-12;  // surfaces without any noise leave directions at zero
  apparent += kRegular * apparent.diagonal().asDiagonal();
  const Eigen::LLT<Matrix7> whitening(apparent);
  if (whitening.info() != Eigen::Success) return surface_information;
  const Matrix7 half = whitening.matrixL().solve(common);
  const Eigen::SelfAdjointEigenSolver<Matrix7> shares(whitening.matrixL().solve(half.transpose()));
  const Vector7 kept = ((shares.eigenvalues().array() - kNoiseShare) / (1 - kNoiseShare))
                           .cwiseMax(0.0)
                           .cwiseMin(1.0);
  const Matrix7 lower = whitening.matrixL();
  const Matrix7 reduce = lower * shares.eigenvectors() * kept.cwiseSqrt().asDiagonal() *
                         shares.eigenvectors().transpose() * lower.inverse();
  return reduce * surface_information * reduce.transpose();
}

Constraints constraints_of(const Matrix7& surface_information, const Matrix7& prior_covariance,
                           const Eigen::Vector3d& pivot, const Eigen::Vector3d& origin_in_world) {
  Constraints result;
  result.covariance = (surface_information + Matrix7(prior_covariance.inverse())).inverse();
  result.constrained_share =
      (Vector7::Ones() - result.covariance.diagonal().cwiseQuotient(prior_covariance.diagonal()))
          .cwiseMax(0.0)
          .cwiseMin(1.0);
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix7> eigen(result.covariance,
                                                                prior_covariance);
  const Vector7 sigma = prior_covariance.diagonal().cwiseSqrt();
  Motions motions(7, 7);
  for (int i = 6; i >= 0 && 1 - eigen.eigenvalues()[i] < kOpenShare; --i) {
    // An eigenvector is of the dual space; the motion it stands for is the prior's answer to it.
    motions.col(result.open_degrees_of_freedom++) =
        (prior_covariance * eigen.eigenvectors().col(i)).cwiseQuotient(sigma);
  }
  motions.conservativeResize(7, result.open_degrees_of_freedom);
  if (motions.cols() > 0)
    result.open_motions = describe(orthonormal(motions), sigma, pivot, origin_in_world);
  return result;
}

}  // namespace vggtcd
