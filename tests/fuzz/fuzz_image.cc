// SPDX-License-Identifier: Apache-2.0
// Fuzz target: any bytes as a photo, HEIC and AVIF included: an image of the size that it says, or
// one line; and nothing on standard error.
#include "tests/fuzz/fuzz_files.h"
#include "vggtcd/io/image_file.h"
#include "vggtcd/io/picture_header.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using vggtcd::fuzz::require;
  const std::vector<std::byte> bytes(reinterpret_cast<const std::byte*>(data),
                                     reinterpret_cast<const std::byte*>(data) + size);
  // What a header claims may honestly be large; that it is bounded is a unit test's.
  constexpr int64_t kMany = 1 << 20;
  const auto header = vggtcd::read_picture_header(bytes);
  require(vggtcd::decode_bytes(bytes) >= 0);
  vggtcd::read_exif(bytes);
  if (header && header->pixels() > kMany && header->pixels() <= vggtcd::kMaxPixels) return 0;
  try {
    vggtcd::PhotoFacts facts;
    const vggtcd::Image image = vggtcd::decode_image(bytes, "fuzz", {}, &facts);
    require(image.width > 0 && image.height > 0);
    require(image.rgb.size() ==
            size_t{3} * static_cast<size_t>(image.width) * static_cast<size_t>(image.height));
    require(facts.exif.orientation >= 1 && facts.exif.orientation <= 8);
    for (const std::string& remark : facts.remarks) {
      require(remark.find('\n') == std::string::npos);
    }
  } catch (const vggtcd::Error& error) {
    require(error.code() == vggtcd::ErrorCode::kInput ||
            error.code() == vggtcd::ErrorCode::kMemory ||
            error.code() == vggtcd::ErrorCode::kUnavailable);
    vggtcd::fuzz::check_sentence(error);
  }
  return 0;
}
