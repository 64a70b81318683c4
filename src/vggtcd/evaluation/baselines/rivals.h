// SPDX-License-Identifier: Apache-2.0
// The classical rivals of the VGGT-CD paper, run by an optional plugin on Open3D, with the
// parameters the paper's authors used.
#pragma once

#include <string>

#include "vggtcd/evaluation/registration_methods.h"

namespace vggtcd {

// Points are those of both epochs above their median confidence, with colours; no cap on their
// number.
//
// fgr: fast global registration. Voxel v = 1 % of the diagonal of the target's bounding box;
// normals within 2 v (30 neighbours), FPFH within 5 v (100); correspondence distance 1.5 v, 128
// iterations, 2000 tuples. Then coloured ICP on clouds of voxel size 2 v, v, v / 2 (distance 0.4 of
// the size, 100 iterations, lambda 0.968) and point-to-plane ICP at 0.2 v on the finest of them.
//
// ransac_icp: voxel v = 2 %, the same features; RANSAC on 3 points, edge lengths within 0.9,
// distance 1.5 v, 100 000 iterations at 0.999 confidence; point-to-plane ICP at 0.4 v, 2000
// iterations.
//
// scale_icp: T1 is first scaled by the ratio of the bounding boxes' diagonals, target / source;
// then as ransac_icp with 500 iterations of ICP.
//
// Throws Error{kUnavailable} if the plugin cannot be loaded, Error{kDegenerate} if the rival has no
// answer.
Sim3 align_by_rival(const std::string& rival, const RegistrationProblem& problem);

// Whether this build has the plugin; does not load it.
bool rivals_available();
// Loads it now (a tenth of a second), so that no rival's time includes it.
void load_rivals();

}  // namespace vggtcd
