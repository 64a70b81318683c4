// SPDX-License-Identifier: Apache-2.0
// Runs the network on a golden case and compares every stage with the reference.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "tests/support/golden_case.h"
#include "vggtcd/vggt/model.h"

namespace vggtcd::testing {

// The largest deviations that a tensor of this name may have.
struct Limit {
  double rel_l2, rel_max;
};
using Limits = std::function<Limit(std::string_view name)>;

// f32: rel L2 5e-6, rel max 2e-5 for everything. A run in f64 differs from the reference by up to
// 1.9e-6 and 4.4e-6; the smallest mistake that must be seen (a wrong LayerNorm eps in the depth
// head) moves depth by 4e-6 in rel L2.
Limit f32_limit(std::string_view name);

// bf16: what the reference network deviates by from itself in f32 when the operands of all
// products, heads included, are rounded to bf16, with a margin of about two.
Limit bf16_limit(std::string_view name);

ImageBatch images_of(const GoldenCase& golden);

// Runs the model, expects every tensor of the case within its limit and every tensor compared.
// Returns one line per tensor: name, rel L2, rel max.
std::string expect_parity(const Vggt& model, const std::string& case_name, const Limits& limits);

}  // namespace vggtcd::testing
