// SPDX-License-Identifier: Apache-2.0
// Light: what colour a ray sees, and how a camera turns it into 8 bits.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "vggtcd/evaluation/synthetic/ray_caster.h"

namespace vggtcd {

// Linear radiance of a surface (Lambert, a Blinn-Phong highlight, hard shadows) or of the sky.
// `footprint_m` is the width of the pixel at the hit, across the ray.
Eigen::Vector3f radiance(const SyntheticScene& scene, const Lighting& lighting,
                         const RayCaster& caster, const Eigen::Vector3d& origin,
                         const Eigen::Vector3d& direction, const std::optional<RayHit>& hit,
                         float footprint_m);

// Exposure, white balance, a filmic shoulder, sRGB and sensor noise drawn from `noise_key`.
void develop(const Lighting& lighting, const Eigen::Vector3f& radiance, uint64_t noise_key,
             uint8_t* rgb);

}  // namespace vggtcd
