// SPDX-License-Identifier: Apache-2.0
// Asks again about one pixel, and keeps what every photo said.
#pragma once

#include "vggtcd/change/explanation.h"
#include "vggtcd/change/free_space_options.h"
#include "vggtcd/change/inquiry.h"

namespace vggtcd {

// question: about a photo of the judged epoch. changed: what a change is called there.
PixelExplanation explain_pixel(const Inquiry& inquiry, const PixelQuestion& question,
                               const VoteGrid& grid, ChangeLabel changed, const VoteScale& scale,
                               const FreeSpaceOptions& options);

}  // namespace vggtcd
