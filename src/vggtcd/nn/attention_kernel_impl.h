// SPDX-License-Identifier: Apache-2.0
// The attention kernel of attention_kernel.h for any of the vector types. Internal linkage: every
// instruction set has its own.
#pragma once

#include <cstdint>

#include "vggtcd/nn/attention_kernel.h"
#include "vggtcd/nn/tile.h"

namespace vggtcd {
namespace {

// S: vector type with dot(), exp2() and kPerWord; T: element type of q and out.
template <typename S, typename T, int kHeadDim>
struct AttentionKernel {
  using V = typename S::V;
  static constexpr int kLanes = S::kLanes;
  static constexpr int kRows = S::kAccumulatorRows;
  static constexpr int kColumns = 3;
  static constexpr int kQueries = kColumns * kLanes;  // of a group
  static constexpr int kGroups = kQueriesPerTask / kQueries;
  static constexpr int kKeySteps = kHeadDim / S::kPerWord;
  static constexpr int64_t kBlockKeys = kStepsPerKeyBlock * S::kPerWord;
  static constexpr float kHeadroom = 16.0f;
  static_assert(kQueriesPerTask % kQueries == 0 && kKeyPadding % kRows == 0 && kRows % 2 == 0);

  // The state of one group of queries.
  struct Group {
    float* q;          // [kKeySteps, kQueries] words
    float* out;        // [kHeadDim, kQueries], not yet divided by sum
    float* reference;  // [kQueries]
    float* sum;        // [kQueries]
  };

  // scores [kRows, kQueries] of kRows keys, and their maximum over the keys.
  static void score_tile(const Group& group, const float* keys, float* scores,
                         V (&largest)[kColumns]) {
    V acc[kRows][kColumns];
    multiply_tile<S>(kKeySteps, keys, kKeySteps, 1, group.q, acc);
    for (int c = 0; c < kColumns; ++c) {
      V most = acc[0][c];
      for (int r = 1; r < kRows; ++r) most = S::max(most, acc[r][c]);
      largest[c] = most;
    }
    for (int r = 0; r < kRows; ++r) {
      for (int c = 0; c < kColumns; ++c) S::store(scores + r * kQueries + c * kLanes, acc[r][c]);
    }
  }

  // Probabilities of a tile's keys, as words, and their sums (of what was stored: rounding cancels
  // in the ratio) added to sum; keys from `valid` on are padding, with probability 0.
  static void probability_tile(const Group& group, float scale, const float* scores, int64_t valid,
                               float* probabilities, V (&sum)[kColumns]) {
    for (int c = 0; c < kColumns; ++c) {
      const V factor = S::set(scale);
      const V minus_reference = S::sub(S::zero(), S::load(group.reference + c * kLanes));
      V tile_sum = S::zero();
      for (int r = 0; r < kRows; r += 2) {
        const float* at = scores + r * kQueries + c * kLanes;
        V p0 = S::exp2(S::fma(S::load(at), factor, minus_reference));
        V p1 = S::exp2(S::fma(S::load(at + kQueries), factor, minus_reference));
        if (r >= valid) p0 = S::zero();
        if (r + 1 >= valid) p1 = S::zero();
        float* words = probabilities + r / S::kPerWord * kQueries + c * kLanes;
        if constexpr (S::kPerWord == 2) {
          const V pair = S::pair(p0, p1);
          S::store(words, pair);
          tile_sum = S::add_pair(tile_sum, pair);
        } else {
          S::store(words, p0);
          S::store(words + kQueries, p1);
          tile_sum = S::add(tile_sum, S::add(p0, p1));
        }
      }
      sum[c] = S::add(sum[c], tile_sum);
    }
  }

  // out^T += values^T probabilities^T over some steps.
  static void add_values(const Group& group, int64_t steps, const float* values,
                         const float* probabilities) {
    for (int d = 0; d < kHeadDim; d += kRows) {
      V acc[kRows][kColumns];
      multiply_tile<S>(steps, values + d, 1, kHeadDim, probabilities, acc);
      for (int r = 0; r < kRows; ++r) {
        for (int c = 0; c < kColumns; ++c) {
          float* at = group.out + (d + r) * kQueries + c * kLanes;
          S::store(at, S::add(S::load(at), acc[r][c]));
        }
      }
    }
  }

  static void add_sum(const Group& group, V (&sum)[kColumns]) {
    for (int c = 0; c < kColumns; ++c) {
      float* at = group.sum + c * kLanes;
      S::store(at, S::add(S::load(at), sum[c]));
      sum[c] = S::zero();
    }
  }

  // Raises the reference of the queries that `largest` (scaled) exceeds by more than kHeadroom.
  [[gnu::noinline]] static void raise_reference(const Group& group, const V (&largest)[kColumns]) {
    for (int c = 0; c < kColumns; ++c) {
      float* at = group.reference + c * kLanes;
      const V old = S::load(at);
      const V raised =
          S::select_greater(largest[c], S::add(old, S::set(kHeadroom)), S::ceil(largest[c]), old);
      const V factor = S::scale_by_power_of_2(S::set(1.0f), S::sub(old, raised));
      S::store(at, raised);
      float* sum = group.sum + c * kLanes;
      S::store(sum, S::mul(S::load(sum), factor));
      for (int d = 0; d < kHeadDim; ++d) {
        float* out = group.out + d * kQueries + c * kLanes;
        S::store(out, S::mul(S::load(out), factor));
      }
    }
  }

  static bool exceeds_reference(const Group& group, const V (&largest)[kColumns]) {
    bool any = false;
    for (int c = 0; c < kColumns; ++c) {
      const V bound = S::add(S::load(group.reference + c * kLanes), S::set(kHeadroom));
      any = any || S::any_greater(largest[c], bound);
    }
    return any;
  }

  // One group against keys [begin, end) of the head, begin and end multiples of kRows but for the
  // last end.
  static void key_block(const AttentionTask<T>& task, const Group& group, int64_t begin,
                        int64_t end, float* probabilities, float* scores) {
    const float scale = task.scale * 1.44269504f;  // log2(e)
    V sum[kColumns];
    for (int c = 0; c < kColumns; ++c) sum[c] = S::zero();
    int64_t pending = begin;  // keys [pending, key) have probabilities but are not yet in out
    const auto flush = [&](int64_t key) {
      add_values(group, (key - pending) / S::kPerWord,
                 task.values + pending / S::kPerWord * kHeadDim, probabilities);
      add_sum(group, sum);
      pending = key;
    };
    int64_t key = begin;
    for (; key < end; key += kRows) {
      V largest[kColumns];
      score_tile(group, task.keys + key * kKeySteps, scores, largest);
      for (int c = 0; c < kColumns; ++c) largest[c] = S::mul(largest[c], S::set(scale));
      if (exceeds_reference(group, largest)) {
        flush(key);
        raise_reference(group, largest);
      }
      probability_tile(group, scale, scores, end - key,
                       probabilities + (key - pending) / S::kPerWord * kQueries, sum);
    }
    flush(key);
  }

  // Words of kQueries rows of q, transposed; rows from `count` on repeat the last.
  static void pack_queries(const T* q, int64_t stride, int64_t count, const Group& group) {
    constexpr int kElementsPerWord = static_cast<int>(sizeof(float) / sizeof(T));
    const auto* base = reinterpret_cast<const float*>(q);
    for (int c = 0; c < kColumns; ++c) {
      int32_t offset[kLanes];
      for (int i = 0; i < kLanes; ++i) {
        const int64_t row = c * kLanes + i < count ? c * kLanes + i : count - 1;
        offset[i] = static_cast<int32_t>(row * stride / kElementsPerWord);
      }
      const auto index = S::load_index(offset);
      float* to = group.q + c * kLanes;
      for (int i = 0; i < kHeadDim / kElementsPerWord; ++i) {
        const V words = S::gather(base + i, index);
        if constexpr (kElementsPerWord == S::kPerWord) {
          S::store(to + i * kQueries, words);
        } else {  // bf16 in, f32 words
          S::store(to + 2 * i * kQueries, S::low_bf16(words));
          S::store(to + (2 * i + 1) * kQueries, S::high_bf16(words));
        }
      }
    }
  }

  // out^T / sum, transposed back.
  static void write_out(const Group& group, int64_t count, T* out, int64_t stride) {
    int32_t offset[kLanes];
    for (int i = 0; i < kLanes; ++i) offset[i] = i * kQueries;
    const auto index = S::load_index(offset);
    for (int64_t query = 0; query < count; ++query) {
      const V factor = S::set(1.0f / group.sum[query]);
      for (int d = 0; d < kHeadDim; d += kLanes) {
        const V value = S::mul(S::gather(group.out + d * kQueries + query, index), factor);
        if constexpr (sizeof(T) == sizeof(float)) {
          S::store(out + query * stride + d, value);
        } else {
          S::store_bf16(out + query * stride + d, value);
        }
      }
    }
  }

  static void run(const AttentionTask<T>& task) {
    const int groups = static_cast<int>((task.queries + kQueries - 1) / kQueries);
    Group group[kGroups];
    float* scratch = task.scratch;
    const auto take = [&scratch](int64_t floats) {
      float* const taken = scratch;
      scratch += floats;
      return taken;
    };
    for (int g = 0; g < groups; ++g) {
      group[g] = {take(kKeySteps * kQueries), take(kHeadDim * kQueries), take(kQueries),
                  take(kQueries)};
      const int64_t first = g * kQueries;
      pack_queries(task.q + first * task.q_stride, task.q_stride, task.queries - first, group[g]);
      for (int i = 0; i < kHeadDim * kQueries; ++i) group[g].out[i] = 0;
      for (int i = 0; i < kQueries; ++i) group[g].reference[i] = -1e30f;
      for (int i = 0; i < kQueries; ++i) group[g].sum[i] = 0;
    }
    float* const probabilities = take(kStepsPerKeyBlock * kQueries);
    float* const scores = take(kRows * kQueries);
    // Blocks of equal size, so that the last one is not a stub.
    const int64_t blocks = (task.tokens + kBlockKeys - 1) / kBlockKeys;
    const int64_t block =
        ((task.tokens + blocks - 1) / blocks + kKeyPadding - 1) / kKeyPadding * kKeyPadding;
    for (int64_t begin = 0; begin < task.tokens; begin += block) {
      const int64_t end = begin + block < task.tokens ? begin + block : task.tokens;
      for (int g = 0; g < groups; ++g) {
        key_block(task, group[g], begin, end, probabilities, scores);
      }
    }
    for (int g = 0; g < groups; ++g) {
      const int64_t first = g * kQueries;
      const int64_t left = task.queries - first;
      write_out(group[g], left < kQueries ? left : kQueries, task.out + first * task.out_stride,
                task.out_stride);
    }
  }
};

template <typename S, typename T>
void run_attention(const AttentionTask<T>& task) {
  if (task.head_dim == 64) {
    AttentionKernel<S, T, 64>::run(task);
  } else {
    AttentionKernel<S, T, 128>::run(task);
  }
}

}  // namespace
}  // namespace vggtcd
