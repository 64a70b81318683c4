// SPDX-License-Identifier: Apache-2.0
// safetensors: 8 bytes length, a JSON header, then the tensors without gaps.
// Source: the format description of the safetensors project.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "vggtcd/io/weight_file.h"

namespace vggtcd {

// Views into `bytes`, which must outlive the result. Every statement of the header is checked:
// sizes agree with shapes and types, and the tensors cover the data exactly, without overlap or
// gap. Throws Error{kWeights}; `name` stands for the file.
WeightFile parse_safetensors(std::span<const std::byte> bytes, const std::string& name);

struct TensorInfo {
  std::string name;
  DType dtype = DType::kF32;
  std::vector<int64_t> shape;
};

// Writes the tensors in the given order but wider types first, so that all are aligned.
// fill(i, data) is called once per tensor, in the order of the file, and writes tensor i; so only
// one tensor has to be in memory. Throws Error{kOutput}, Error{kWeights} for a name that is not
// UTF-8, and what fill throws; then nothing is left behind.
void write_safetensors(const std::filesystem::path& path, std::span<const TensorInfo> tensors,
                       const std::map<std::string, std::string>& metadata,
                       const std::function<void(size_t, std::span<std::byte>)>& fill);

}  // namespace vggtcd
