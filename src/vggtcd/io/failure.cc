// SPDX-License-Identifier: Apache-2.0
// Which exceptions say that memory was short, and the one line of all others.
#include "vggtcd/io/failure.h"

#include <atomic>
#include <cstdlib>
#include <new>
#include <opencv2/core.hpp>
#include <system_error>

namespace vggtcd {
namespace {

// Texts of libraries come with line breaks and indentation.
std::string in_one_line(std::string_view text) {
  std::string line;
  for (const char c : text) {
    const bool space = c == ' ' || (c >= '\t' && c <= '\r');
    if (!space) line += c;
    if (space && !line.empty() && line.back() != ' ') line += ' ';
  }
  if (!line.empty() && line.back() == ' ') line.pop_back();
  return line;
}

std::string with_file(const std::filesystem::path* file, std::string_view what) {
  return file ? fmt::format("{}: {}", file->string(), what) : std::string(what);
}

Error error_naming(const std::filesystem::path* file) {
  const auto out_of_memory = [&] {
    return Error(ErrorCode::kMemory, with_file(file, kOutOfMemory));
  };
  const auto internal = [&](std::string_view what) {
    return Error(
        ErrorCode::kInternal,
        with_file(file, fmt::format("internal error: {}; please report it", in_one_line(what))));
  };
  try {
    throw;
  } catch (const Error& error) {
    return error;
  } catch (const std::bad_alloc&) {
    return out_of_memory();
  } catch (const cv::Exception& error) {
    // OpenCV 4.6 asserts when it frees a buffer that it could not allocate.
    const bool of_memory = error.code == cv::Error::StsNoMem || error.func == "cleanup";
    return of_memory ? out_of_memory() : internal(error.what());
  } catch (const std::system_error& error) {
    return error.code() == std::errc::not_enough_memory ? out_of_memory() : internal(error.what());
  } catch (const std::exception& error) {
    return internal(error.what());
  } catch (...) {
    return internal("an exception of an unknown kind");
  }
}

std::atomic<void*> g_reserve{nullptr};

// Frees the reserve; the request that failed fails all the same.
void on_memory_short() {
  std::free(g_reserve.exchange(nullptr));
  throw std::bad_alloc();
}

}  // namespace

void rethrow_naming(const std::filesystem::path& file) { throw error_naming(&file); }

Error failure_in_flight() { return error_naming(nullptr); }

void reserve_memory_for_failures() {
  constexpr size_t kReserveBytes = 256 << 10;
  if (g_reserve.load() == nullptr) g_reserve = std::malloc(kReserveBytes);
  std::set_new_handler(on_memory_short);
}

}  // namespace vggtcd
