// SPDX-License-Identifier: Apache-2.0
// Attention on VGGT-1B's shapes, as a share of oneDNN's matrix product measured in the same run.
// Usage: attention_bench [f32|bf16]... [--tokens N]; --tokens: the longest sequence (default 45000;
// 84 views are 87444 tokens and take half a minute a run). VGGTCD_ISA chooses the instruction set.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "bench/gemm_rate.h"
#include "vggtcd/core/cpu_features.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/core/tensor_view.h"
#include "vggtcd/core/timer.h"
#include "vggtcd/nn/attention.h"

namespace vggtcd::bench {
namespace {

struct Case {
  const char* name;
  AttentionShape shape;
};

constexpr Case kCases[] = {{"frame, 10 views", {10, 1041, 16, 64}},
                           {"global, 10 views", {1, 10410, 16, 64}},
                           {"global, 40 views, 2 heads", {1, 41640, 2, 64}},
                           {"global, 84 views, 1 head", {1, 87444, 1, 64}},
                           {"camera head, 84 views", {1, 84, 16, 128}}};

template <typename T>
double seconds(const AttentionShape& shape) {
  const int64_t channels = shape.heads * shape.head_dim;
  const int64_t rows = shape.sequences * shape.tokens;
  std::mt19937 generator(1);
  std::normal_distribution<float> normal;
  std::vector<T> qkv(static_cast<size_t>(rows * 3 * channels));
  for (T& value : qkv) {
    if constexpr (sizeof(T) == 2) {
      value = bfloat16_from_float(normal(generator));
    } else {
      value = normal(generator);
    }
  }
  std::vector<T> out(static_cast<size_t>(rows * channels));
  AttentionWorkspace workspace;
  const T* q = qkv.data();
  double best_s = 1e30;
  const Timer all;
  for (int run = 0; run < 5 && (run < 2 || all.seconds() < 5); ++run) {
    const Timer timer;
    const float scale = 1.0f / std::sqrt(static_cast<float>(shape.head_dim));
    if constexpr (sizeof(T) == 2) {
      attention_bf16(shape, q, q + channels, q + 2 * channels, 3 * channels, out.data(), channels,
                     scale, workspace);
    } else {
      attention_f32(shape, q, q + channels, q + 2 * channels, 3 * channels, out.data(), channels,
                    scale, workspace);
    }
    best_s = std::min(best_s, timer.seconds());
  }
  return best_s;
}

void run(bool bf16, int64_t longest) {
  const std::vector<GemmRate> rates = measure_gemm_rates(bf16);
  fmt::print("\n{}\n{:34s} {:>8s}\n", bf16 ? "bf16" : "f32", "oneDNN matrix product", "GFLOP/s");
  for (const GemmRate& rate : rates) {
    fmt::print("  [{}, {}] x [{}, {}]{:8s} {:>8.0f}\n", rate.rows, rate.in, rate.in, rate.out, "",
               rate.gflops);
  }
  const double peer = best_gflops(rates);
  fmt::print("{:34s} {:>8s} {:>8s} {:>8s} {:>8s}\n", "attention", "GFLOP", "s", "GFLOP/s", "share");
  for (const Case& entry : kCases) {
    const AttentionShape& shape = entry.shape;
    if (shape.tokens > longest) continue;
    const double s = bf16 ? seconds<uint16_t>(shape) : seconds<float>(shape);
    // Two products of 2 tokens^2 head_dim operations each; the softmax is not counted.
    const double gflop = 4e-9 *
                         static_cast<double>(shape.sequences * shape.heads * shape.head_dim) *
                         static_cast<double>(shape.tokens * shape.tokens);
    fmt::print("  {:32s} {:8.1f} {:8.4f} {:8.0f} {:8.2f}\n", entry.name, gflop, s, gflop / s,
               gflop / s / peer);
  }
}

}  // namespace
}  // namespace vggtcd::bench

int main(int argc, char** argv) {
  using namespace vggtcd;
  bool f32 = false, bf16 = false;
  int64_t longest = 45000;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "f32") f32 = true;
    if (argument == "bf16") bf16 = true;
    if (argument == "--tokens" && i + 1 < argc) longest = std::stoll(argv[++i]);
  }
  if (!f32 && !bf16) f32 = bf16 = true;
  fmt::print("{} threads, instruction set {}\n", num_threads(), enum_to_string(cpu_level()));
  if (f32) bench::run(false, longest);
  if (bf16) bench::run(true, longest);
  return 0;
}
