// SPDX-License-Identifier: Apache-2.0
// Error: what the library throws when the world is wrong, and check(): when we are wrong.
// The three kinds of failure and the tool for each are in docs/architecture.md.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <string_view>

namespace vggtcd {

// The kind of failure. The numbers are the exit statuses of the command line (docs/formats.md).
enum class ErrorCode {
  kInternal = 1,      // a broken invariant of ours
  kUsage = 2,         // an option or argument
  kInput = 3,         // a file that cannot be read, is corrupt or has the wrong content
  kWeights = 4,       // network weights: missing, misshapen, not weights at all
  kDegenerate = 5,    // readable input that does not determine an answer (collinear, empty, ...)
  kOutput = 6,        // a result that cannot be written
  kMemory = 7,        // would not fit
  kUnavailable = 8,   // an optional component or external program that is missing
  kImplausible = 9,   // two epochs that do not fit together; --accept-alignment overrides
  kInterrupted = 130  // Ctrl-C
};

// The message is one line: the object, what was expected, what was found, and the remedy.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& what) : std::runtime_error(what), code_(code) {}
  ErrorCode code() const { return code_; }

 private:
  ErrorCode code_;
};

// throw_error(ErrorCode::kInput, "{}: expected ..., found ...", path, ...)
template <typename... Args>
[[noreturn]] void throw_error(ErrorCode code, fmt::format_string<Args...> format, Args&&... args) {
  throw Error(code, fmt::format(format, std::forward<Args>(args)...));
}

// A broken invariant of ours throws in every build.
inline void check(bool condition, std::string_view what) {
  if (!condition) throw Error(ErrorCode::kInternal, fmt::format("internal error: {}", what));
}

// For inner loops: checked in debug builds only.
#ifdef NDEBUG
inline void dcheck(bool, std::string_view) {}
#else
inline void dcheck(bool condition, std::string_view what) { check(condition, what); }
#endif

}  // namespace vggtcd
