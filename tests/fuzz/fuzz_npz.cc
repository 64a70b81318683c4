// SPDX-License-Identifier: Apache-2.0
// Fuzz target: any bytes as an .npz; every array that is offered must read or throw one line.
#include "tests/fuzz/fuzz_files.h"
#include "vggtcd/io/npz.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using vggtcd::fuzz::require;
  const std::vector<std::byte> bytes(reinterpret_cast<const std::byte*>(data),
                                     reinterpret_cast<const std::byte*>(data) + size);
  try {
    const vggtcd::NpzReader npz(bytes, "fuzz");
    for (const std::string& key : npz.keys()) {
      try {
        constexpr int64_t kMany = 1 << 24;  // a deflated array may honestly be large
        const int64_t count = npz.header(key).numel();
        if (count <= kMany) require(std::ssize(npz.read<float>(key)) == count);
      } catch (const vggtcd::Error& error) {
        vggtcd::fuzz::check_refusal(error);
      }
    }
  } catch (const vggtcd::Error& error) {
    vggtcd::fuzz::check_refusal(error);
  }
  return 0;
}
