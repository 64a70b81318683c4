// SPDX-License-Identifier: Apache-2.0
// Exceptions that are no Error, made into one: of one line, with the file that was in work.
#pragma once

#include <filesystem>
#include <string_view>

#include "vggtcd/core/error.h"

namespace vggtcd {

inline constexpr std::string_view kOutOfMemory =
    "out of memory; use fewer or smaller photos, or fewer threads (--threads)";

// For the handler of a function that reads or writes a file: throws what is being handled again. An
// Error stays as it is. Anything else becomes an Error that begins with the file: kMemory where
// memory was short, whichever library said so, else kInternal.
//
//   Trajectory read_tum(const std::filesystem::path& path) try {
//     ...
//   } catch (...) {
//     rethrow_naming(path);
//   }
[[noreturn]] void rethrow_naming(const std::filesystem::path& file);

// The same for a program's last handler, where no file is known.
Error failure_in_flight();

// Keeps a little memory that is given back when a request for memory first fails: destructors and
// the error itself need some.
void reserve_memory_for_failures();

}  // namespace vggtcd
