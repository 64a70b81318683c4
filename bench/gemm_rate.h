// SPDX-License-Identifier: Apache-2.0
// The yardstick of the network's benchmarks: the rate of oneDNN's matrix product, weights packed,
// on the shapes of VGGT-1B's linear layers, with as many threads as the machine has processors, at
// the instruction set of VGGTCD_ISA.
#pragma once

#include <cstdint>
#include <vector>

namespace vggtcd::bench {

struct GemmRate {
  int64_t rows, in, out;  // [rows, in] x [in, out]
  double gflops;          // 1e9 operations a second, best of several runs
};

// (1024, 3072), (1024, 1024), (1024, 4096), (4096, 1024) with rows = 10 views of 1041 tokens.
std::vector<GemmRate> measure_gemm_rates(bool bf16);

// The best of them.
double best_gflops(const std::vector<GemmRate>& rates);

}  // namespace vggtcd::bench
