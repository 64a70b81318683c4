// SPDX-License-Identifier: Apache-2.0
// ForeignLines: what libraries would print to standard error, kept from it.
#pragma once

#include <string>
#include <vector>

namespace vggtcd {

// While it lives, what the calling thread prints to the C stream stderr or to std::cerr is kept
// here; other threads print as ever. libjpeg, libpng, libtiff and OpenCV say there what is wrong
// with a picture, without its name and between lines of ours. May be nested: the inner one keeps.
// With a C library other than glibc nothing is kept from the streams.
class ForeignLines {
 public:
  ForeignLines();
  ~ForeignLines();
  ForeignLines(const ForeignLines&) = delete;
  ForeignLines& operator=(const ForeignLines&) = delete;

  const std::string& text() const { return text_; }
  // The lines without what a logger puts before them, each once.
  std::vector<std::string> lines() const;

 private:
  std::string text_;
  std::string* outer_;
};

}  // namespace vggtcd
