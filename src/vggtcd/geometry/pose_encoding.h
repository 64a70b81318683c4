// SPDX-License-Identifier: Apache-2.0
// The pose encoding of the network, 9 numbers per photo, and the camera it stands for; upstream
// pose_encoding_to_extri_intri ("absT_quaR_FoV").
#pragma once

#include <span>

#include "vggtcd/geometry/pinhole.h"
#include "vggtcd/geometry/rigid3.h"

namespace vggtcd {

// The rotation of a quaternion x, y, z, w of any length but zero: 2 / |q|^2 takes the place of a
// normalisation. A zero quaternion gives a matrix that is not finite.
Eigen::Matrix3d rotation_from_quaternion(const Eigen::Vector4d& xyzw);

// encoding: translation x, y, z of camera-from-world (model units); quaternion x, y, z, w;
// vertical, horizontal field of view (rad).
Rigid3 camera_from_world_of(std::span<const float, 9> encoding);

// fx = (width / 2) / tan(horizontal / 2), fy alike; the principal point is the centre. A field of
// view of 0 gives an infinite focal length.
Pinhole pinhole_of(std::span<const float, 9> encoding, int height, int width);

}  // namespace vggtcd
