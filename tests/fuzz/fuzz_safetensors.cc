// SPDX-License-Identifier: Apache-2.0
// Fuzz target: any bytes as a safetensors file.
#include "tests/fuzz/fuzz_weights.h"
#include "vggtcd/io/safetensors.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  vggtcd::fuzz::check_reader(
      data, size, [](const auto& bytes) { return vggtcd::parse_safetensors(bytes, "fuzz"); });
  return 0;
}
