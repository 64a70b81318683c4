// SPDX-License-Identifier: Apache-2.0
// Base64 (RFC 4648, section 4, with padding).
#pragma once

#include <string>
#include <string_view>

namespace vggtcd {

std::string base64_encode(std::string_view bytes);

}  // namespace vggtcd
