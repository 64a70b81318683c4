// SPDX-License-Identifier: Apache-2.0
// torch_checkpoint: the tensors of a file written by torch.save: the zip container of PyTorch 1.6
// and later, and the older one ("legacy").
// Source: torch.serialization; tests/golden/torch_checkpoint holds files that PyTorch wrote.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "vggtcd/io/weight_file.h"

namespace vggtcd {

// Whether the bytes start as torch.save's files do.
bool is_torch_checkpoint(std::span<const std::byte> bytes);

// The state dict of the file: the pickled dict itself if it has tensors, else the dict with tensors
// under its key "model" or "state_dict", else the only such dict it holds. Entries that are not
// tensors are left out. Tensors in C order at an aligned address are views into `bytes`, which must
// outlive the result; others are copied (in all no more than the file's size).
// Throws Error{kWeights}; `name` stands for the file.
WeightFile parse_torch_checkpoint(std::span<const std::byte> bytes, const std::string& name);

}  // namespace vggtcd
