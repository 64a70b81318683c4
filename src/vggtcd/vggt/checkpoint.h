// SPDX-License-Identifier: Apache-2.0
// checkpoint: VGGT weight files without the network: their sizes, and converting them.
#pragma once

#include <filesystem>

#include "vggtcd/core/options.h"
#include "vggtcd/core/progress.h"
#include "vggtcd/vggt/config.h"

namespace vggtcd {

// The sizes of the network in a file, without reading its tensors. Throws as Vggt::load.
VggtConfig read_checkpoint_config(const std::filesystem::path& path);

enum class WeightPrecision { kF32, kF16, kBF16 };
std::span<const EnumName<WeightPrecision>> enum_names(WeightPrecision);

struct ConvertOptions {
  WeightPrecision precision = WeightPrecision::kBF16;
  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("precision", self.precision, "type of the matrices in the new file");
  };
};

// Writes the tensors and metadata of `from` as safetensors to `to`. Matrices and convolutions
// (names ending in .weight, two axes or more) get the precision asked for, by rounding to nearest
// even; norms, biases, scales and tokens, which are few, become f32; integers stay. Throws
// Error{kWeights} for a value that is finite but too large for f16, Error{kOutput}.
void convert_weights(const std::filesystem::path& from, const std::filesystem::path& to,
                     const ConvertOptions& options, ProgressSink& progress = silent_progress());

}  // namespace vggtcd
