// SPDX-License-Identifier: Apache-2.0
// measure_product_rate: how fast this machine multiplies, for estimates of time.
#pragma once

#include "vggtcd/nn/linear.h"

namespace vggtcd {

// Floating-point operations a second of all threads together, on a product of the network's shape
// in these types: the best of a few runs, a tenth of a second in all.
double measure_product_rate(const ProductTypes& types);

}  // namespace vggtcd
