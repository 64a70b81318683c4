// SPDX-License-Identifier: Apache-2.0
// Normalisation and rotary embedding of queries and keys: tables, checks, choice of the kernel.
#include "vggtcd/nn/qk_norm_rope.h"

#include <cmath>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/nn/reference.h"
#include "vggtcd/nn/row_kernels.h"

namespace vggtcd {
namespace {

// One head of one row, from the tables (reference::rope_head computes its angles itself).
template <typename T>
void norm_rope_head(const QkNormRope& op, const float* weight, const float* bias,
                    const RopePosition* position, T* head, float* scratch) {
  if (weight) {
    reference::layer_norm_row<float>(op.head_dim, head, weight, bias, op.eps, scratch);
  } else {
    for (int64_t c = 0; c < op.head_dim; ++c) scratch[c] = reference::load<float>(head[c]);
  }
  if (op.rope) {
    const int64_t quarter = op.head_dim / 4;
    for (int64_t half = 0; half < 2; ++half) {
      const int64_t at = half == 0 ? position->y : position->x;
      const float* cosines = op.rope->cosines(at);
      const float* sines = op.rope->sines(at);
      float* first = scratch + half * 2 * quarter;
      for (int64_t k = 0; k < quarter; ++k) {
        const float a = first[k], b = first[k + quarter];
        first[k] = a * cosines[k] - b * sines[k];
        first[k + quarter] = b * cosines[k] + a * sines[k];
      }
    }
  }
  for (int64_t c = 0; c < op.head_dim; ++c) head[c] = reference::store<T>(scratch[c]);
}

template <typename T>
void norm_rope_row(const RowKernels& kernels, const QkNormRope& op, const RopePosition* position,
                   T* q) {
  HeadsNormRope heads{op.heads, op.head_dim, op.q_weight, op.q_bias, op.eps,
                      nullptr,  nullptr,     nullptr,     nullptr};
  if (op.rope) {
    heads.cosines_y = op.rope->cosines(position->y);
    heads.sines_y = op.rope->sines(position->y);
    heads.cosines_x = op.rope->cosines(position->x);
    heads.sines_x = op.rope->sines(position->x);
  }
  const auto run = [&kernels](const HeadsNormRope& of, T* row) {
    if constexpr (sizeof(T) == 4) {
      kernels.norm_rope_f32(of, row);
    } else {
      kernels.norm_rope_bf16(of, row);
    }
  };
  run(heads, q);
  heads.weight = op.k_weight;
  heads.bias = op.k_bias;
  run(heads, q + op.heads * op.head_dim);
}

void check_op(const QkNormRope& op, int64_t rows, int64_t row_stride) {
  check(rows >= 0 && op.heads >= 1 && op.head_dim >= 4 && op.head_dim % 4 == 0,
        "qk_norm_rope: shape");
  check(row_stride >= 3 * op.heads * op.head_dim, "qk_norm_rope: row_stride");
  const bool none = !op.q_weight && !op.q_bias && !op.k_weight && !op.k_bias;
  const bool all = op.q_weight && op.q_bias && op.k_weight && op.k_bias;
  check(none || (all && op.eps > 0), "qk_norm_rope: all four of the norms' tensors, or none");
  if (!op.rope) return;
  check(op.rope->head_dim() == op.head_dim, "qk_norm_rope: a table for another head_dim");
  check(op.positions && op.position_count >= 1, "qk_norm_rope: no positions");
  for (int64_t i = 0; i < op.position_count; ++i) {
    const auto [y, x] = op.positions[i];
    check(y >= 0 && y < op.rope->positions() && x >= 0 && x < op.rope->positions(),
          "qk_norm_rope: a position outside the table");
  }
}

template <typename T>
void qk_norm_rope(const QkNormRope& op, int64_t rows, T* qkv, int64_t row_stride) {
  check_op(op, rows, row_stride);
  const RowKernels* kernels = row_kernels();
  if (op.head_dim % kRopeMultiple != 0 || op.head_dim > kRopeLargestHead) kernels = nullptr;
  parallel_for(rows, 32, [&](int64_t begin, int64_t end) {
    std::vector<float> scratch(kernels ? 0 : static_cast<size_t>(op.head_dim));
    for (int64_t row = begin; row < end; ++row) {
      const RopePosition* position = op.rope ? op.positions + row % op.position_count : nullptr;
      T* q = qkv + row * row_stride;
      if (kernels) {
        norm_rope_row(*kernels, op, position, q);
        continue;
      }
      for (int64_t h = 0; h < 2 * op.heads; ++h) {
        norm_rope_head(op, h < op.heads ? op.q_weight : op.k_weight,
                       h < op.heads ? op.q_bias : op.k_bias, position, q + h * op.head_dim,
                       scratch.data());
      }
    }
  });
}

}  // namespace

RopeTable::RopeTable(int64_t head_dim, int64_t positions, double frequency_base)
    : head_dim_(head_dim), positions_(positions) {
  check(head_dim >= 4 && head_dim % 4 == 0 && positions >= 1 && frequency_base > 0,
        "RopeTable: shape");
  const int64_t quarter = head_dim / 4;
  for (int64_t position = 0; position < positions; ++position) {
    for (int64_t k = 0; k < quarter; ++k) {
      const double exponent = -static_cast<double>(k) / static_cast<double>(quarter);
      const double angle = static_cast<double>(position) * std::pow(frequency_base, exponent);
      cosines_.push_back(static_cast<float>(std::cos(angle)));
      sines_.push_back(static_cast<float>(std::sin(angle)));
    }
  }
}

const float* RopeTable::cosines(int64_t position) const {
  return cosines_.data() + position * (head_dim_ / 4);
}

const float* RopeTable::sines(int64_t position) const {
  return sines_.data() + position * (head_dim_ / 4);
}

void qk_norm_rope_f32(const QkNormRope& op, int64_t rows, float* qkv, int64_t row_stride) {
  qk_norm_rope(op, rows, qkv, row_stride);
}

void qk_norm_rope_bf16(const QkNormRope& op, int64_t rows, uint16_t* qkv, int64_t row_stride) {
  qk_norm_rope(op, rows, qkv, row_stride);
}

}  // namespace vggtcd
