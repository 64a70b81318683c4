// SPDX-License-Identifier: Apache-2.0
// The matches stage of a classical reconstruction as a file, so that it is made once.
#pragma once

#include <filesystem>
#include <vector>

#include "vggtcd/features/features.h"

namespace vggtcd {

struct SparseMatches {
  std::vector<Features> features;  // one for each photo; read back without descriptors
  std::vector<PhotoPair> pairs;
};

// An .npz, complete or not there: points_per_photo [S], points [n, 4] f32 (u, v, scale, angle),
// pairs [P, 3] (first, second, homography inliers), matches_per_pair [P], matches [m, 2].
void write_matches(const std::filesystem::path& path, const SparseMatches& matches);

// Throws Error{kInput} naming the file if the numbers contradict each other.
SparseMatches read_matches(const std::filesystem::path& path);

}  // namespace vggtcd
