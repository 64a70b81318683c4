// SPDX-License-Identifier: Apache-2.0
// The classical rivals of the VGGT-CD paper on Open3D, with the parameters its authors used.
#pragma once

#include "vggtcd/evaluation/registration_methods.h"

namespace vggtcd {

// Points of both epochs above their median confidence, with colours. No cap on their number.
//
// Fast global registration: voxel v = 1 % of the diagonal of the target's bounding box; normals
// within 2 v (30 neighbours), FPFH within 5 v (100); correspondence distance 1.5 v, 128 iterations,
// 2000 tuples. Then coloured ICP on clouds of voxel size 2 v, v, v / 2 (distance 0.4 of the size,
// 100 iterations, lambda 0.968) and point-to-plane ICP at 0.2 v on the finest of them.
Sim3 align_fgr(const RegistrationProblem& problem);

// Voxel v = 2 %, the same features; RANSAC on 3 points, edge lengths within 0.9, distance 1.5 v,
// 100 000 iterations at 0.999 confidence; point-to-plane ICP at 0.4 v, 2000 iterations.
Sim3 align_ransac_icp(const RegistrationProblem& problem);

// T1 is first scaled by the ratio of the bounding boxes' diagonals, target / source; then as
// align_ransac_icp with 500 iterations of ICP.
Sim3 align_scale_icp(const RegistrationProblem& problem);

}  // namespace vggtcd
