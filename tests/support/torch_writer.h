// SPDX-License-Identifier: Apache-2.0
// Writes files as torch.save does, so that tests of the reader need no large files: the pickle of a
// state dict has the very bytes that Python's pickler gives (its test compares a checksum).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "vggtcd/core/tensor_view.h"

namespace vggtcd::testing {

// A zip of stored members whose data starts at multiples of 64 bytes.
std::string stored_zip(std::span<const std::pair<std::string, std::string>> members);

// data.pkl of an OrderedDict of tensors, tensor i in storage "i". All of one type (f16, bf16, f32).
std::string state_dict_pickle(std::span<const TensorView> tensors);

// The whole file: NAME/data.pkl, NAME/data/0, ..., NAME/version.
std::string torch_zip_file(const std::string& archive_name, std::span<const TensorView> tensors);

}  // namespace vggtcd::testing
