// SPDX-License-Identifier: Apache-2.0
// The rate of a short product through the layer that the network runs.
#include "vggtcd/nn/product_rate.h"

#include <algorithm>
#include <cstring>

#include "vggtcd/core/parallel.h"
#include "vggtcd/core/timer.h"

namespace vggtcd {

double measure_product_rate(const ProductTypes& types) {
  constexpr int64_t kChannels = 1024;
  constexpr int kRuns = 4;
  const std::vector<float> weight(kChannels * kChannels, 0.5f);
  const Linear linear(weight, {}, kChannels, kChannels, {.types = types, .output = types.compute});
  const int64_t blocks = 2 * num_threads(), rows = blocks * kRowBlock;
  const Buffer x_memory(bytes_of(types.compute, rows, kChannels));
  const Buffer y_memory(bytes_of(types.compute, rows, kChannels));
  std::memset(x_memory.data(), 0, x_memory.size());
  const Rows x(types.compute, x_memory, kChannels), y(types.compute, y_memory, kChannels);
  double best_s = 1e30;
  for (int run = 0; run < kRuns; ++run) {
    const Timer timer;
    parallel_for(rows, kRowBlock, [&](int64_t begin, int64_t end) {
      linear.run(end - begin, x.at(begin), y.at(begin));
    });
    best_s = std::min(best_s, timer.seconds());
  }
  return 2.0 * static_cast<double>(rows * kChannels * kChannels) / best_s;
}

}  // namespace vggtcd
