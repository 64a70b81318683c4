// SPDX-License-Identifier: Apache-2.0
// Fuzz target: any bytes as a weights file of any format: dispatch, zip and legacy containers.
#include "tests/fuzz/fuzz_weights.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  vggtcd::fuzz::check_reader(
      data, size, [](const auto& bytes) { return vggtcd::parse_weight_file(bytes, "fuzz"); });
  return 0;
}
