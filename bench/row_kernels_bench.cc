// SPDX-License-Identifier: Apache-2.0
// The operations that move memory rather than compute, on VGGT-1B's shapes for 10 views: bytes read
// and written a second, as a share of a stream copy measured in the same run.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <random>
#include <vector>

#include "vggtcd/core/cpu_features.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/core/timer.h"
#include "vggtcd/nn/activation.h"
#include "vggtcd/nn/layer_norm.h"
#include "vggtcd/nn/qk_norm_rope.h"
#include "vggtcd/nn/resize.h"

namespace vggtcd::bench {
namespace {

constexpr int64_t kRows = 10410, kChannels = 1024, kHidden = 4096;

double best_seconds(const std::function<void()>& body) {
  double best_s = 1e30;
  for (int run = 0; run < 9; ++run) {
    const Timer timer;
    body();
    best_s = std::min(best_s, timer.seconds());
  }
  return best_s;
}

// A copy by all threads; what it reads and writes, as for the others (a cache line that is written
// is read first, in the copy as in the operations).
double copy_gb_per_s(const std::vector<float>& from, std::vector<float>& to) {
  const auto size = static_cast<int64_t>(from.size());
  const double s = best_seconds([&] {
    parallel_for(size, 1 << 16, [&](int64_t begin, int64_t end) {
      std::copy(from.begin() + begin, from.begin() + end, to.begin() + begin);
    });
  });
  return 8e-9 * static_cast<double>(size) / s;
}

class Table {
 public:
  explicit Table(double copy) : copy_(copy) {
    fmt::print("{:42s} {:>8s} {:>8s} {:>8s}\n", "", "ms", "GB/s", "share");
    fmt::print("{:42s} {:>8s} {:8.1f} {:8.2f}\n", "copy", "", copy_, 1.0);
  }
  void add(const char* name, int64_t bytes, const std::function<void()>& body) const {
    const double s = best_seconds(body), rate = 1e-9 * static_cast<double>(bytes) / s;
    fmt::print("{:42s} {:8.2f} {:8.1f} {:8.2f}\n", name, 1e3 * s, rate, rate / copy_);
  }

 private:
  double copy_;
};

struct Data {
  std::vector<float> wide = std::vector<float>(kRows * kHidden), wide_out = wide;
  std::vector<uint16_t> narrow = std::vector<uint16_t>(kRows * kHidden), narrow_out = narrow;
  std::vector<float> weight = std::vector<float>(kHidden, 1.0f), bias = weight;
  std::vector<RopePosition> positions;
  RopeTable rope{64, 64, 100};

  Data() {
    std::mt19937 generator(1);
    std::normal_distribution<float> normal;
    for (size_t i = 0; i < wide.size(); ++i)
      wide[i] = i < 65536 ? normal(generator) : wide[i % 65536];
    bf16_from_f32(static_cast<int64_t>(wide.size()), wide.data(), narrow.data());
    for (int32_t i = 0; i < 1041; ++i) positions.push_back({i / 37, i % 37});
  }
  QkNormRope norm_rope() const {
    QkNormRope op{16, 64, weight.data(), bias.data(), weight.data(), bias.data(), 1e-5f};
    op.rope = &rope;
    op.positions = positions.data();
    op.position_count = 1041;
    return op;
  }
};

void blocks(Data& d, const Table& table) {
  constexpr int64_t kTokens = kRows * kChannels, kHiddens = kRows * kHidden;
  float *wide = d.wide.data(), *wide_out = d.wide_out.data();
  uint16_t *narrow = d.narrow.data(), *narrow_out = d.narrow_out.data();
  const float *weight = d.weight.data(), *bias = d.bias.data();
  table.add("layer norm f32, [10410, 1024]", 8 * kTokens, [&] {
    layer_norm_f32(kRows, kChannels, wide, kChannels, weight, bias, 1e-5f, wide_out, kChannels);
  });
  table.add("layer norm f32 -> bf16", 6 * kTokens, [&] {
    layer_norm_bf16(kRows, kChannels, wide, kChannels, weight, bias, 1e-5f, narrow_out, kChannels);
  });
  const QkNormRope op = d.norm_rope();
  // q and k of each row are read and written, v is passed over.
  table.add("q/k norm and rope f32, [10410, 3072]", 16 * kTokens,
            [&] { qk_norm_rope_f32(op, kRows, wide_out, 3 * kChannels); });
  table.add("q/k norm and rope bf16", 8 * kTokens,
            [&] { qk_norm_rope_bf16(op, kRows, narrow_out, 3 * kChannels); });
  table.add("gelu f32, [10410, 4096]", 8 * kHiddens, [&] { gelu_f32(kHiddens, wide, wide_out); });
  table.add("gelu bf16", 4 * kHiddens, [&] { gelu_bf16(kHiddens, narrow, narrow_out); });
  table.add("residual f32 += gamma f32, [10410, 1024]", 12 * kTokens,
            [&] { add_scaled_f32(kRows, kChannels, wide_out, weight, wide); });
  table.add("residual f32 += gamma bf16", 10 * kTokens,
            [&] { add_scaled_bf16(kRows, kChannels, wide_out, weight, narrow); });
  table.add("f32 -> bf16", 6 * kHiddens, [&] { bf16_from_f32(kHiddens, wide, narrow_out); });
}

void resizes(Data& d, const Table& table) {
  // The last one of the DPT head, and the largest fusion's.
  const ResizeShape last{128, 224, 296, 392, 518}, fusion{256, 112, 148, 224, 296};
  for (const auto& [name, s] :
       {std::pair{"resize to [392, 518, 128]", last}, {"resize to [224, 296, 256]", fusion}}) {
    const int64_t in = s.in_height * s.in_width, out = s.out_height * s.out_width;
    table.add(name, 4 * s.channels * (in + out), [&, shape = s] {
      resize_bilinear_channels_last(shape, d.wide.data(), d.wide_out.data());
    });
  }
}

}  // namespace
}  // namespace vggtcd::bench

int main() {
  using namespace vggtcd;
  fmt::print("{} threads, instruction set {}\n", num_threads(), enum_to_string(cpu_level()));
  bench::Data data;
  const bench::Table table(bench::copy_gb_per_s(data.wide, data.wide_out));
  bench::blocks(data, table);
  bench::resizes(data, table);
  return 0;
}
