// SPDX-License-Identifier: Apache-2.0
// zip_directory: where the members of a zip archive in memory are, so that they can be used in
// place. Source: PKWARE APPNOTE 6.3, sections 4.3.12 to 4.3.16 (with ZIP64). For inflating, see
// npz.h.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "vggtcd/core/error.h"

namespace vggtcd {

struct ZipMember {
  std::string name;
  std::span<const std::byte> data;  // as stored in the archive
};

// The members in the order of the central directory. Only stored (uncompressed, not encrypted)
// members of a single-part archive are accepted. Throws Error{code}; `file` stands for the file.
std::vector<ZipMember> read_zip_directory(std::span<const std::byte> bytes, const std::string& file,
                                          ErrorCode code);

}  // namespace vggtcd
