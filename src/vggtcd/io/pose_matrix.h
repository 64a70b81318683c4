// SPDX-License-Identifier: Apache-2.0
// Poses as matrices in files: checked, and made exact.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "vggtcd/geometry/rigid3.h"

namespace vggtcd::internal {

// The nearest rotation to a matrix that is one within 1e-2: files keep 16 or 32 bits (half
// precision has 5e-4 per entry), and Rigid3 relies on R^-1 = R^T. Throws Error{kInput} otherwise,
// a reflection included; `where` names file and array.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix, const std::string& where);

// [R | t] of 3 x 4 or 4 x 4 numbers in row order. Throws Error{kInput} naming `where`.
Rigid3 pose_from_matrix(std::span<const double> values, const std::string& where);

}  // namespace vggtcd::internal
