// SPDX-License-Identifier: Apache-2.0
// image_resize: 8-bit bicubic resampling with Pillow's rounding, because the network was trained on
// pictures that Pillow resized.
// Source: the description of Pillow's resampling in docs/numerics.md; the reference's loader uses
// Image.resize(BICUBIC).
#pragma once

#include "vggtcd/scene/image.h"

namespace vggtcd {

// Rows [first_row, first_row + rows) of the image resized to width x height (all >= 1; the range
// inside [0, height)). Cubic kernel with a = -0.5, stretched when shrinking, its window clipped at
// the border and renormalised; weights rounded to 22 bits; horizontal pass first, each pass rounded
// and clamped to 8 bits. Bit for bit what Pillow gives.
Image resize_bicubic(const Image& image, int width, int height, int first_row, int rows);

}  // namespace vggtcd
