// SPDX-License-Identifier: Apache-2.0
// oneDNN's matrix product on the network's shapes.
#include "bench/gemm_rate.h"

#include <algorithm>
#include <oneapi/dnnl/dnnl.hpp>

#include "vggtcd/core/timer.h"
#include "vggtcd/nn/product.h"

namespace vggtcd::bench {
namespace {

constexpr int kRuns = 7;

void fill(const dnnl::memory& memory) {
  // Values do not matter to the speed, but denormals and NaN would.
  auto* bytes = static_cast<uint16_t*>(memory.get_data_handle());
  const size_t count = memory.get_desc().get_size() / 2;
  for (size_t i = 0; i < count; ++i) bytes[i] = static_cast<uint16_t>(0x3f80 + i % 64);
}

double measure(int64_t rows, int64_t in, int64_t out, bool bf16) {
  using dnnl::memory;
  const dnnl::engine engine(dnnl::engine::kind::cpu, 0);
  dnnl::stream stream(engine);
  const auto type = bf16 ? memory::data_type::bf16 : memory::data_type::f32;
  const memory::desc source_desc({rows, in}, type, memory::format_tag::ab);
  const memory::desc weights_desc({in, out}, type, memory::format_tag::any);
  const memory::desc target_desc({rows, out}, type, memory::format_tag::ab);
#if DNNL_VERSION_MAJOR >= 3
  const dnnl::matmul::primitive_desc description(engine, source_desc, weights_desc, target_desc);
#else
  const dnnl::matmul::primitive_desc description({source_desc, weights_desc, target_desc}, engine);
#endif
  const memory source(source_desc, engine), weights(description.weights_desc(), engine),
      target(target_desc, engine);
  fill(source);
  fill(weights);
  fill(target);
  const dnnl::matmul product(description);
  double best_s = 1e30;
  for (int run = 0; run < kRuns; ++run) {
    const Timer timer;
    product.execute(stream,
                    {{DNNL_ARG_SRC, source}, {DNNL_ARG_WEIGHTS, weights}, {DNNL_ARG_DST, target}});
    stream.wait();
    best_s = std::min(best_s, timer.seconds());
  }
  return 2e-9 * static_cast<double>(rows * in * out) / best_s;
}

}  // namespace

std::vector<GemmRate> measure_gemm_rates(bool bf16) {
  limit_onednn_to_cpu_level();
  std::vector<GemmRate> rates = {{10410, 1024, 3072, 0},
                                 {10410, 1024, 1024, 0},
                                 {10410, 1024, 4096, 0},
                                 {10410, 4096, 1024, 0}};
  for (GemmRate& rate : rates) rate.gflops = measure(rate.rows, rate.in, rate.out, bf16);
  return rates;
}

double best_gflops(const std::vector<GemmRate>& rates) {
  double best = 0;
  for (const GemmRate& rate : rates) best = std::max(best, rate.gflops);
  return best;
}

}  // namespace vggtcd::bench
