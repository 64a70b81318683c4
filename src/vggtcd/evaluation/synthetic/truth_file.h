// SPDX-License-Identifier: Apache-2.0
// truth.npz and truth.json of a generated scene (docs/formats.md).
#pragma once

#include <filesystem>

#include "vggtcd/evaluation/synthetic/dataset.h"

namespace vggtcd {

void write_truth(const std::filesystem::path& directory, const SyntheticScene& scene,
                 const SceneTruth& truth, const SynthesizeOptions& options,
                 const SimulatedPredictions& predictions);

}  // namespace vggtcd
