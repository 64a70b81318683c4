// SPDX-License-Identifier: Apache-2.0
// Normalisation and rotation of queries and keys against plain loops in double precision, at every
// instruction-set level.
#include "vggtcd/nn/qk_norm_rope.h"

#include <gmock/gmock.h>

#include <array>

#include "vggtcd/core/error.h"
#include "vggtcd/nn/test_support.h"

namespace vggtcd {
namespace {

constexpr double kBase = 100;

class QkNormRopeOp : public CpuLevelTest {};

struct Norms {
  std::array<std::vector<float>, 4> tensors;
  explicit Norms(int64_t head_dim) {
    for (unsigned i = 0; i < 4; ++i) tensors[i] = random_values<float>(head_dim, 10 + i);
  }
  void set(QkNormRope& op) const {
    op.q_weight = tensors[0].data();
    op.q_bias = tensors[1].data();
    op.k_weight = tensors[2].data();
    op.k_bias = tensors[3].data();
    op.eps = 1e-5f;
  }
};

std::vector<double> expect(const QkNormRope& op, int64_t rows, const std::vector<float>& qkv) {
  std::vector<double> expected(qkv.begin(), qkv.end());
  const int64_t dim = op.head_dim, stride = static_cast<int64_t>(qkv.size()) / rows;
  for (int64_t row = 0; row < rows; ++row) {
    for (int64_t h = 0; h < 2 * op.heads; ++h) {
      double* head = expected.data() + row * stride + h * dim;
      if (op.q_weight) {
        reference::layer_norm_row<double>(
            dim, qkv.data() + row * stride + h * dim, h < op.heads ? op.q_weight : op.k_weight,
            h < op.heads ? op.q_bias : op.k_bias, double{op.eps}, head);
      }
      if (op.rope) {
        const RopePosition position = op.positions[row % op.position_count];
        reference::rope_head<double>(dim, position.y, position.x, kBase, head);
      }
    }
  }
  return expected;
}

// 7 rows of 3 heads with positions that repeat after 5.
struct Case {
  static constexpr int64_t kRows = 7;
  RopeTable table;
  Norms norms;
  std::vector<RopePosition> positions{{0, 0}, {1, 1}, {37, 2}, {3, 36}, {5, 0}};
  std::vector<float> qkv;
  QkNormRope op;

  Case(int64_t head_dim, bool norm, bool rope)
      : table(head_dim, 38, kBase),
        norms(head_dim),
        qkv(random_values<float>(kRows * (9 * head_dim + 2))),
        op{3, head_dim} {
    if (norm) norms.set(op);
    if (rope) {
      op.rope = &table;
      op.positions = positions.data();
      op.position_count = 5;
    }
  }
  int64_t stride() const { return 9 * op.head_dim + 2; }
};

TEST_P(QkNormRopeOp, IsTheDoubleResultToFloatPrecision) {
  for (const int64_t head_dim : {64, 128, 20, 4}) {
    for (const auto& [norm, rope] : {std::pair{true, true}, {true, false}, {false, true}}) {
      const Case made(head_dim, norm, rope);
      auto actual = made.qkv;
      qk_norm_rope_f32(made.op, Case::kRows, actual.data(), made.stride());
      // Includes v and what lies beyond it, which must be untouched.
      EXPECT_LE(relative_l2(actual, expect(made.op, Case::kRows, made.qkv)), 3e-7)
          << head_dim << (norm ? " norm" : "") << (rope ? " rope" : "");
    }
  }
}

TEST_P(QkNormRopeOp, LeavesValuesAndPaddingAlone) {
  const Case made(64, true, true);
  auto actual = made.qkv;
  qk_norm_rope_f32(made.op, Case::kRows, actual.data(), made.stride());
  for (int64_t row = 0; row < Case::kRows; ++row) {
    for (int64_t c = 2 * 3 * 64; c < made.stride(); ++c) {
      const auto i = static_cast<size_t>(row * made.stride() + c);
      EXPECT_EQ(actual[i], made.qkv[i]);
    }
  }
}

TEST_P(QkNormRopeOp, InBf16IsTheF32ResultOfTheSameInputRounded) {
  for (const int64_t head_dim : {64, 128, 20}) {
    const Case made(head_dim, true, true);
    std::vector<uint16_t> actual;
    std::vector<float> widened;
    for (const float value : made.qkv) {
      actual.push_back(bfloat16_from_float(value));
      widened.push_back(float_from_bfloat16(actual.back()));
    }
    qk_norm_rope_bf16(made.op, Case::kRows, actual.data(), made.stride());
    qk_norm_rope_f32(made.op, Case::kRows, widened.data(), made.stride());
    for (size_t i = 0; i < actual.size(); ++i) {
      EXPECT_EQ(actual[i], bfloat16_from_float(widened[i])) << i;
    }
  }
}

TEST_P(QkNormRopeOp, WithoutNormsAndRopeChangesNothing) {
  const Case made(64, false, false);
  auto actual = made.qkv;
  qk_norm_rope_f32(made.op, Case::kRows, actual.data(), made.stride());
  EXPECT_EQ(actual, made.qkv);
}

TEST_P(QkNormRopeOp, LetsScoresDependOnRelativePositionOnly) {
  const RopeTable table(64, 50, kBase);
  const auto score = [&](RopePosition q_at, RopePosition k_at) {
    auto rows = random_values<float>(2 * 192);
    const RopePosition positions[] = {q_at, k_at};
    QkNormRope op{1, 64};
    op.rope = &table;
    op.positions = positions;
    op.position_count = 2;
    qk_norm_rope_f32(op, 2, rows.data(), 192);
    double dot = 0;
    for (size_t c = 0; c < 64; ++c) dot += double{rows[c]} * double{rows[192 + 64 + c]};
    return dot;
  };
  EXPECT_NEAR(score({3, 7}, {10, 4}), score({23, 20}, {30, 17}), 2e-5);
  EXPECT_GT(std::abs(score({3, 7}, {10, 4}) - score({3, 7}, {4, 10})), 1e-2);
}

INSTANTIATE_TEST_SUITE_P(, QkNormRopeOp, ::testing::ValuesIn(kAllCpuLevels), cpu_level_name);

TEST(QkNormRopeShapes, ThatCannotBeAreRefused) {
  std::vector<float> qkv(2 * 192);
  const RopeTable table(64, 4, kBase);
  const RopePosition inside[] = {{0, 0}, {3, 3}}, outside[] = {{0, 0}, {4, 0}};
  QkNormRope op{1, 64};
  op.rope = &table;
  op.positions = outside;
  op.position_count = 2;
  EXPECT_THROW(qk_norm_rope_f32(op, 2, qkv.data(), 192), Error);
  op.positions = inside;
  EXPECT_NO_THROW(qk_norm_rope_f32(op, 2, qkv.data(), 192));
  EXPECT_THROW(qk_norm_rope_f32(op, 2, qkv.data(), 191), Error);
  op.q_weight = qkv.data();  // three tensors missing
  EXPECT_THROW(qk_norm_rope_f32(op, 2, qkv.data(), 192), Error);
}

}  // namespace
}  // namespace vggtcd
