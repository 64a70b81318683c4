// SPDX-License-Identifier: Apache-2.0
// quote(): text from an untrusted file made fit for a one-line message.
#pragma once

#include <string>
#include <string_view>

namespace vggtcd {

// In double quotes; control characters and bytes above ASCII as \xNN; at most 80 characters of the
// text, then "...". Names of tensors are ASCII, so nothing worth reading is lost.
std::string quote(std::string_view text);

}  // namespace vggtcd
