// SPDX-License-Identifier: Apache-2.0
// WeightFile: the tensors of a weights file, whichever of the accepted formats it has
// (docs/formats.md, "Weights"). Nothing of an untrusted file is ever executed.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/core/tensor_view.h"

namespace vggtcd {

enum class WeightFormat { kSafetensors, kTorchZip, kTorchLegacy };

std::string_view weight_format_name(WeightFormat format);  // "safetensors", ...

struct WeightFile {
  WeightFormat format = WeightFormat::kSafetensors;
  std::vector<TensorView> tensors;              // in file order, names unique
  std::map<std::string, std::string> metadata;  // safetensors only; UTF-8
  std::shared_ptr<const void> storage;          // keeps the memory of the tensors alive
  // What wrappers of PyTorch had put before every name ("module." of DistributedDataParallel,
  // "_orig_mod." of torch.compile, "model." of Lightning) and is not in the names any more.
  std::string removed_prefix;

  const TensorView* find(std::string_view name) const;  // null: no such tensor
};

// Opens a file by its content, not its name. The tensors are views of the mapped file; what cannot
// be viewed (elements not in C order, deflated members) is copied. A checkpoint in shards is named
// by its index (model.safetensors.index.json) or its folder and opened as one (weight_shards.h).
// Throws Error{kInput} if a file cannot be read, Error{kWeights} if it is not sound weights, naming
// the file and what is wrong.
WeightFile open_weight_file(const std::filesystem::path& path);

// The same for bytes in memory that outlive the result; `name` stands for the file in errors.
WeightFile parse_weight_file(std::span<const std::byte> bytes, const std::string& name);

}  // namespace vggtcd
