// SPDX-License-Identifier: Apache-2.0
// How progress is shown: one live line on a terminal, plain lines in a log, JSON lines for
// programs.
#pragma once

#include <memory>
#include <string_view>

#include "vggtcd/core/progress.h"

namespace vggtcd::cli {

// mode: auto, plain, json or none. All of them write to standard error; none still writes notices.
std::unique_ptr<ProgressSink> make_progress(std::string_view mode);

}  // namespace vggtcd::cli
