// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/heif_image.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "tests/support/test_files.h"
#include "vggtcd/io/image_file.h"
#ifdef VGGTCD_WITH_HEIF
#include <libheif/heif.h>
#endif

// The encoder that makes the test files never frees one block of its own; LeakSanitizer asks here.
extern "C" const char* __lsan_default_suppressions() { return "leak:libx265"; }

namespace vggtcd {
namespace {

TEST(IsHeif, KnowsPicturesFromVideosByTheFirstBox) {
  const auto starts = [](const std::string& brand) {
    const std::string file = std::string("\0\0\0\x18", 4) + "ftyp" + brand + "rest";
    return is_heif(std::as_bytes(std::span(file)));
  };
  EXPECT_TRUE(starts("heic"));
  EXPECT_TRUE(starts("avif"));
  EXPECT_FALSE(starts("isom"));
  EXPECT_FALSE(is_heif({}));
}

#ifdef VGGTCD_WITH_HEIF
// What a phone writes: a quarter turn in the file's own terms, and in EXIF's too.
const std::string kExifTurned =
    std::string("Exif\0\0", 6) +
    std::string("II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0", 26);

heif_error append(heif_context*, const void* data, size_t size, void* file) {
  static_cast<std::string*>(file)->append(static_cast<const char*>(data), size);
  return {heif_error_Ok, heif_suberror_Unspecified, ""};
}

// 96 x 64 px, left half red, right half blue, as HEVC or AV1; "" where libheif has no encoder.
std::string encoded(heif_compression_format format, heif_orientation orientation, bool exif) {
  constexpr int kWidth = 96, kHeight = 64;
  heif_context* context = heif_context_alloc();
  heif_encoder* encoder = nullptr;
  std::string file;
  if (heif_context_get_encoder_for_format(context, format, &encoder).code == heif_error_Ok) {
    heif_image* image = nullptr;
    heif_image_create(kWidth, kHeight, heif_colorspace_RGB, heif_chroma_interleaved_RGB, &image);
    heif_image_add_plane(image, heif_channel_interleaved, kWidth, kHeight, 8);
    int stride = 0;
    uint8_t* plane = heif_image_get_plane(image, heif_channel_interleaved, &stride);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        uint8_t* pixel = plane + y * stride + 3 * x;
        pixel[0] = x < kWidth / 2 ? 200 : 20;
        pixel[1] = 20;
        pixel[2] = x < kWidth / 2 ? 20 : 200;
      }
    }
    heif_encoder_set_lossy_quality(encoder, 90);
    heif_encoding_options* options = heif_encoding_options_alloc();
    options->image_orientation = orientation;
    heif_image_handle* handle = nullptr;
    heif_context_encode_image(context, image, encoder, options, &handle);
    if (exif) {
      // libheif writes the offset of the TIFF header itself.
      heif_context_add_exif_metadata(context, handle, kExifTurned.data(),
                                     static_cast<int>(kExifTurned.size()));
    }
    heif_writer writer{1, append};
    heif_context_write(context, &writer, &file);
    heif_image_handle_release(handle);
    heif_encoding_options_free(options);
    heif_image_release(image);
    heif_encoder_release(encoder);
  }
  heif_context_free(context);
  return file;
}

bool is_red(const uint8_t* p) { return p[0] > 150 && p[2] < 80; }
bool is_blue(const uint8_t* p) { return p[2] > 150 && p[0] < 80; }

Image decode(const std::string& file) {
  return decode_image(std::as_bytes(std::span(file)), "phone.heic");
}

class Heif : public ::testing::TestWithParam<heif_compression_format> {};

TEST_P(Heif, IsDecodedToItsColours) {
  const std::string file = encoded(GetParam(), heif_orientation_normal, false);
  if (file.empty()) GTEST_SKIP() << "this libheif has no encoder for the format";
  const Image image = decode(file);
  ASSERT_EQ(image.width, 96);
  ASSERT_EQ(image.height, 64);
  EXPECT_TRUE(is_red(image.pixel(10, 10)));
  EXPECT_TRUE(is_blue(image.pixel(86, 50)));
}

TEST_P(Heif, IsTurnedOnceThoughEXIFSaysItToo) {
  const std::string file = encoded(GetParam(), heif_orientation_rotate_90_cw, true);
  if (file.empty()) GTEST_SKIP() << "this libheif has no encoder for the format";
  const Image image = decode(file);
  ASSERT_EQ(image.width, 64);
  ASSERT_EQ(image.height, 96);
  EXPECT_TRUE(is_red(image.pixel(32, 10)));  // the left has become the top
  EXPECT_TRUE(is_blue(image.pixel(32, 86)));
}

// HEIC's terms are the only ones; converters leave AVIF with those of the JPEG that they read.
TEST_P(Heif, EXIFAloneTurnsAvifOnly) {
  const std::string file = encoded(GetParam(), heif_orientation_normal, true);
  if (file.empty()) GTEST_SKIP() << "this libheif has no encoder for the format";
  const Image image = decode(file);
  EXPECT_EQ(image.width, GetParam() == heif_compression_AV1 ? 64 : 96);
  EXPECT_TRUE(is_red(image.pixel(10, 10)));
  EXPECT_TRUE(is_blue(image.pixel(image.width - 10, image.height - 10)));
  const Image as_stored =
      decode_image(std::as_bytes(std::span(file)), "x", {.apply_exif_orientation = false});
  EXPECT_EQ(as_stored.width, 96);
}

TEST_P(Heif, CutOffIsRefused) {
  const std::string file = encoded(GetParam(), heif_orientation_normal, false);
  if (file.empty()) GTEST_SKIP() << "this libheif has no encoder for the format";
  for (const size_t size : {size_t{20}, file.size() / 2, file.size() - 20}) {
    EXPECT_INPUT_ERROR(decode(file.substr(0, size)), "phone.heic: not a readable photo: HEIC");
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, Heif,
                         ::testing::Values(heif_compression_HEVC, heif_compression_AV1),
                         [](const auto& format) {
                           return format.param == heif_compression_HEVC ? "Heic" : "Avif";
                         });
#else
TEST(Heif, WithoutLibheifTheErrorSaysSo) {
  const std::string file = std::string("\0\0\0\x18", 4) + "ftypheicrest";
  EXPECT_ERROR(decode_image(std::as_bytes(std::span(file)), "phone.heic"), ErrorCode::kUnavailable,
               "libheif-dev");
}
#endif

}  // namespace
}  // namespace vggtcd
