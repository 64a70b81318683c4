// SPDX-License-Identifier: Apache-2.0
// Fuzz target: any bytes as the pickle of a PyTorch checkpoint.
#include "tests/fuzz/fuzz_weights.h"
#include "vggtcd/io/torch_pickle.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::vector<std::byte> bytes(reinterpret_cast<const std::byte*>(data),
                                     reinterpret_cast<const std::byte*>(data) + size);
  try {
    const vggtcd::Pickle pickle = vggtcd::read_torch_pickle(bytes, "fuzz");
    vggtcd::fuzz::require(pickle.root != nullptr && pickle.size <= size);
  } catch (const vggtcd::Error& error) {
    vggtcd::fuzz::check_error(error);
  }
  return 0;
}
