// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/failure.h"

#include <gtest/gtest.h>

#include <new>
#include <opencv2/core.hpp>
#include <system_error>

#include "tests/support/test_files.h"

namespace vggtcd {
namespace {

template <typename Exception>
void fail_with(const Exception& exception) try {
  throw exception;
} catch (...) {
  rethrow_naming("photos/a.jpg");
}

TEST(RethrowNaming, SaysThatMemoryIsShortWhicheverLibraryNoticed) {
  const cv::Exception opencv(cv::Error::StsNoMem, "Failed to allocate 8 bytes\n", "f", "alloc.cpp",
                             7);
  const std::system_error system(std::make_error_code(std::errc::not_enough_memory));
  for (const std::string& part :
       {std::string("photos/a.jpg: out of memory"), std::string("--threads")}) {
    EXPECT_ERROR(fail_with(std::bad_alloc()), ErrorCode::kMemory, part);
    EXPECT_ERROR(fail_with(opencv), ErrorCode::kMemory, part);
    EXPECT_ERROR(fail_with(system), ErrorCode::kMemory, part);
  }
}

TEST(RethrowNaming, MakesOneLineOfAnyOtherException) {
  const cv::Exception opencv(cv::Error::StsAssert, "(a)\n > (b)", "f", "alloc.cpp", 7);
  EXPECT_ERROR(fail_with(opencv), ErrorCode::kInternal, "photos/a.jpg: internal error: ");
  EXPECT_ERROR(fail_with(std::runtime_error("one\n   two\r\n")), ErrorCode::kInternal,
               "photos/a.jpg: internal error: one two; please report it");
  EXPECT_ERROR(fail_with(7), ErrorCode::kInternal, "photos/a.jpg: internal error: ");
}

TEST(RethrowNaming, LeavesAnErrorAsItIs) {
  EXPECT_ERROR(fail_with(Error(ErrorCode::kInput, "b.json: expected this")), ErrorCode::kInput,
               "b.json: expected this");
  try {
    fail_with(Error(ErrorCode::kInput, "b.json: expected this"));
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "b.json: expected this");
  }
}

}  // namespace
}  // namespace vggtcd
