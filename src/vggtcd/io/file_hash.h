// SPDX-License-Identifier: Apache-2.0
// Size and XXH64 of a file: whether it still holds what was written. Any xxh64sum gives the same
// number; it guards against accidents, not against forgery.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

namespace vggtcd {

// XXH64 (Collet) with seed 0.
uint64_t xxh64(std::span<const std::byte> bytes);

struct FileStamp {
  uint64_t bytes = 0;
  uint64_t hash = 0;
  bool operator==(const FileStamp&) const = default;
};

// Of a regular file; nothing if there is none, if it is a link, or if it cannot be read.
std::optional<FileStamp> stamp_of(const std::filesystem::path& path);
// The size only.
std::optional<uint64_t> size_of(const std::filesystem::path& path);

}  // namespace vggtcd
