// SPDX-License-Identifier: Apache-2.0
// Poses as matrices in files.
#include "vggtcd/io/pose_matrix.h"

#include <Eigen/LU>
#include <Eigen/SVD>

#include "vggtcd/core/error.h"
#include "vggtcd/io/coordinate.h"

namespace vggtcd::internal {

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix, const std::string& where) {
  const double error =
      (matrix.transpose() * matrix - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= 1e-2) || matrix.determinant() < 0) {
    throw_error(ErrorCode::kInput,
                "{}: expected a rotation, found |R^T R - I| = {:.2g} and determinant {:.2g}", where,
                error, matrix.determinant());
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

Rigid3 pose_from_matrix(std::span<const double> values, const std::string& where) {
  check(values.size() == 12 || values.size() == 16, "pose_from_matrix: 3 x 4 or 4 x 4");
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> top(values.data());
  if (!top.allFinite()) throw_error(ErrorCode::kInput, "{}: expected finite numbers", where);
  if (!are_coordinates(top.col(3))) {
    throw_error(ErrorCode::kInput, "{}: expected {}, found {:g} {:g} {:g}", where, kCoordinateRange,
                top(0, 3), top(1, 3), top(2, 3));
  }
  if (values.size() == 16) {
    const Eigen::Map<const Eigen::RowVector4d> last(values.data() + 12);
    if (!last.isApprox(Eigen::RowVector4d(0, 0, 0, 1), 1e-3)) {
      throw_error(ErrorCode::kInput, "{}: expected the last row 0 0 0 1, found {} {} {} {}", where,
                  last[0], last[1], last[2], last[3]);
    }
  }
  return {nearest_rotation(top.leftCols<3>(), where), top.col(3)};
}

}  // namespace vggtcd::internal
