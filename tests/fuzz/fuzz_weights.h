// SPDX-License-Identifier: Apache-2.0
// What every fuzz target of a weights reader demands: it throws Error with one line, or hands over
// tensors whose bytes can be read and have the size that type and shape say.
#pragma once

#include <cstdint>
#include <vector>

#include "tests/fuzz/fuzz_files.h"
#include "vggtcd/core/error.h"
#include "vggtcd/io/weight_file.h"

namespace vggtcd::fuzz {

inline void check_error(const Error& error) {
  require(error.code() == ErrorCode::kWeights);
  check_sentence(error);
}

template <typename Parse>
void check_reader(const uint8_t* data, size_t size, const Parse& parse) {
  // A copy of exactly this size, so that a read beyond it is seen.
  const std::vector<std::byte> bytes(reinterpret_cast<const std::byte*>(data),
                                     reinterpret_cast<const std::byte*>(data) + size);
  try {
    const WeightFile file = parse(bytes);
    unsigned sum = 0;
    for (const TensorView& tensor : file.tensors) {
      require(tensor.data.size() == static_cast<size_t>(tensor.numel()) * dtype_size(tensor.dtype));
      require(reinterpret_cast<uintptr_t>(tensor.data.data()) % dtype_size(tensor.dtype) == 0 ||
              tensor.data.empty());
      for (const std::byte byte : tensor.data) sum += static_cast<unsigned>(byte);
    }
    volatile unsigned keep = sum;
    static_cast<void>(keep);
  } catch (const Error& error) {
    check_error(error);
  }
}

}  // namespace vggtcd::fuzz
