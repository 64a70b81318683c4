// SPDX-License-Identifier: Apache-2.0
// The report page without its data: what viewer/ builds, carried inside the program.
#pragma once

#include <string_view>

namespace vggtcd {

// The mark that stands where the data block belongs; exactly once in the template.
inline constexpr std::string_view kDataSlot = "@VGGTCD_REPORT_DATA@";

std::string_view page_template();

}  // namespace vggtcd
