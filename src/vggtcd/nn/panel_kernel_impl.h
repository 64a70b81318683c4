// SPDX-License-Identifier: Apache-2.0
// The panel kernel of panel_kernel.h for any of the vector types. Internal linkage: every
// instruction set has its own.
#pragma once

#include <cstdint>

#include "vggtcd/nn/panel_kernel.h"
#include "vggtcd/nn/tile.h"

namespace vggtcd {
namespace {

template <typename S>
struct PanelProductKernel {
  using V = typename S::V;
  static constexpr int kLanes = S::kLanes;
  static constexpr int kRows = S::kAccumulatorRows;
  static constexpr int kColumns = 3;  // vectors of a full panel
  static constexpr int64_t kPanel = kColumns * kLanes;
  // Input channels of a block: 24 and 30 KB of words. Shorter blocks store their sums too often.
  static constexpr int64_t kBlock = kLanes == 8 ? 256 : 160;
  static_assert(kBlock * kPanel <= kPanelScratchFloats);

  struct Panel {
    int64_t first, count;  // its output channels
    const std::byte* words;
  };
  // Input channels [begin, end) of a panel.
  struct Block {
    int64_t begin, end;
    const float* words;      // widened
    const std::byte* ahead;  // the panels' bytes behind the block: what comes next
    int64_t bytes;           // of the block
  };

  static constexpr int64_t smaller(int64_t a, int64_t b) { return a < b ? a : b; }

  // Adds a tile's sums, and in the first block the bias. kWhole: no vector of the panel is padded.
  template <int kR, int kC, bool kWhole>
  [[gnu::always_inline]] static inline void add_tile(const PanelTask& task, const Panel& panel,
                                                     bool first_block, int64_t row,
                                                     const V (&acc)[kR][kC]) {
    const bool add = task.accumulate || !first_block;
    for (int c = 0; c < kC; ++c) {
      const int64_t channel = panel.first + c * kLanes;
      const int64_t n = smaller(kLanes, panel.count - c * kLanes);
      const auto load = [n](const float* p) { return kWhole ? S::load(p) : S::load_first(p, n); };
      const V bias = first_block && task.bias ? load(task.bias + channel) : S::zero();
      const V gamma = task.gamma ? load(task.gamma + channel) : S::set(1.0f);
      for (int r = 0; r < kR; ++r) {
        float* const y = task.y + (row + r) * task.y_stride + channel;
        V value = S::add(acc[r][c], bias);
        if (add) value = S::fma(gamma, value, load(y));
        if constexpr (kWhole) {
          S::store(y, value);
        } else {
          S::store_first(y, value, n);
        }
      }
    }
  }

  template <int kR, int kC>
  static void multiply_rows(const PanelTask& task, const Panel& panel, const Block& block,
                            int64_t row) {
    V acc[kR][kC];
    multiply_tile<F32Words<S>>(block.end - block.begin, task.x + row * task.x_stride + block.begin,
                               task.x_stride, 1, block.words, acc);
    if (panel.count == kC * kLanes) {
      add_tile<kR, kC, true>(task, panel, block.begin == 0, row, acc);
    } else {
      add_tile<kR, kC, false>(task, panel, block.begin == 0, row, acc);
    }
  }

  // All rows of the call, the last ones one by one. Meanwhile the next block's bytes are fetched.
  template <int kC>
  static void multiply_block(const PanelTask& task, const Panel& panel, const Block& block) {
    constexpr int64_t kLine = 64;
    const int64_t step = (block.bytes * kRows / task.rows + kLine - 1) / kLine * kLine;
    const std::byte* ahead = block.ahead;
    int64_t row = 0;
    for (; row + kRows <= task.rows; row += kRows, ahead += step) {
      for (int64_t i = 0; i < step; i += kLine) __builtin_prefetch(ahead + i, 0, 2);
      multiply_rows<kRows, kC>(task, panel, block, row);
    }
    for (; row < task.rows; ++row) multiply_rows<1, kC>(task, panel, block, row);
  }

  static const float* widen(const PanelTask& task, const std::byte* words, int64_t count) {
    if (!task.bf16) return reinterpret_cast<const float*>(words);
    const auto* from = reinterpret_cast<const uint16_t*>(words);
    for (int64_t i = 0; i < count; i += kLanes) S::store(task.scratch + i, S::load_bf16(from + i));
    return task.scratch;
  }

  static void activate(const PanelTask& task, const Panel& panel) {
    if (task.activation == Activation::kNone) return;
    const bool gelu = task.activation == Activation::kGelu;
    const auto apply = [gelu](V a) { return gelu ? gelu_f32<S>(a) : S::max(S::zero(), a); };
    for (int64_t row = 0; row < task.rows; ++row) {
      float* const y = task.y + row * task.y_stride + panel.first;
      int64_t c = 0;
      for (; c + kLanes <= panel.count; c += kLanes) S::store(y + c, apply(S::load(y + c)));
      if (const int64_t n = panel.count - c; n > 0) {
        S::store_first(y + c, apply(S::load_first(y + c, n)), n);
      }
    }
  }

  // Returns where the next panel begins. The blocks are of equal size, so that none is a stub.
  template <int kC>
  static const std::byte* multiply_panel(const PanelTask& task, const Panel& panel) {
    const int64_t blocks = (task.in + kBlock - 1) / kBlock;
    const int64_t size = (task.in + blocks - 1) / blocks;
    const std::byte* words = panel.words;
    for (int64_t begin = 0; begin < task.in; begin += size) {
      const int64_t end = smaller(begin + size, task.in);
      const int64_t count = (end - begin) * kC * kLanes;
      const int64_t bytes = count * (task.bf16 ? 2 : 4);
      multiply_block<kC>(task, panel,
                         {begin, end, widen(task, words, count), words + bytes, bytes});
      words += bytes;
    }
    activate(task, panel);
    return words;
  }

  static void run(const PanelTask& task) {
    Panel panel{0, 0, task.panels};
    for (; panel.first < task.out; panel.first += kPanel) {
      panel.count = smaller(kPanel, task.out - panel.first);
      if (panel.count > 2 * kLanes) {
        panel.words = multiply_panel<3>(task, panel);
      } else if (panel.count > kLanes) {
        panel.words = multiply_panel<2>(task, panel);
      } else {
        panel.words = multiply_panel<1>(task, panel);
      }
    }
  }

  static constexpr PanelKernel kernel() { return {kPanel, kLanes, run}; }
};

}  // namespace
}  // namespace vggtcd
