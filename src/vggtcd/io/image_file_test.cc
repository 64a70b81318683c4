// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/image_file.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <opencv2/core/mat.hpp>
#include <opencv2/imgcodecs.hpp>

#include "vggtcd/core/error.h"
#include "vggtcd/io/npz.h"

namespace vggtcd {
namespace {

using ::testing::HasSubstr;

const std::string kGolden = VGGTCD_SOURCE_DIR "/tests/golden/preprocess/";
const std::string kJpeg = kGolden + "inputs/04_portrait_360x640.jpg";
const std::string kPng = kGolden + "inputs/01_rgb_640x480.png";
const std::string kTurned = kGolden + "inputs/06_exif_orientation6_400x300.jpg";
constexpr ImageReadOptions kAsReference{.apply_exif_orientation = false};

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string error_of(const std::string& bytes) {
  try {
    decode_image(std::as_bytes(std::span(bytes)), "photo.jpg");
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInput);
    const std::string what = error.what();
    EXPECT_TRUE(what.starts_with("photo.jpg: ")) << what;
    EXPECT_EQ(what.find('\n'), std::string::npos);
    return what;
  }
  return "";
}

struct Difference {
  double mean = 0;
  int max = 0;
};

Difference difference(const Image& image, const std::string& key) {
  const NpzReader decoded(kGolden + "decoded.npz");
  decoded.expect_shape(key, std::array<int64_t, 3>{image.height, image.width, 3});
  const std::vector<uint8_t> expected = decoded.read<uint8_t>(key);
  Difference result;
  for (size_t i = 0; i < expected.size(); ++i) {
    const int d = std::abs(int{image.rgb[i]} - int{expected[i]});
    result.mean += d / static_cast<double>(expected.size());
    result.max = std::max(result.max, d);
  }
  return result;
}

TEST(ImageFile, PngFilesDecodeToTheReferencesPixels) {
  for (const char* file : {"01_rgb_640x480.png", "02_rgba_300x400.png", "03_gray_200x200.png",
                           "07_gray_alpha_150x100.png", "08_palette_transparency_1036x780.png",
                           "10_round_half_even_148x130.png"}) {
    const Image image = read_image(kGolden + "inputs/" + file, kAsReference);
    EXPECT_EQ(difference(image, std::string(file, 2)).max, 0) << file;
  }
}

// Another JPEG library may round the cosine transform and smooth colour edges differently.
TEST(ImageFile, JpegFilesDecodeCloseToTheReferencesPixels) {
  for (const char* file :
       {"04_portrait_360x640.jpg", "05_wide_900x120.jpg", "06_exif_orientation6_400x300.jpg"}) {
    const Difference d =
        difference(read_image(kGolden + "inputs/" + file, kAsReference), std::string(file, 2));
    EXPECT_LE(d.mean, 1.0) << file;
    EXPECT_LE(d.max, 32) << file;
  }
}

TEST(ImageFile, ExifOrientationTurnsThePictureUnlessTold) {
  const Image lying = read_image(kTurned, kAsReference);
  const Image standing = read_image(kTurned);
  ASSERT_EQ(lying.width, 400);
  ASSERT_EQ(lying.height, 300);
  ASSERT_EQ(standing.width, 300);
  ASSERT_EQ(standing.height, 400);
  // Orientation 6: the first row of the file is the right side of the picture.
  for (int x = 0; x < lying.width; ++x) {
    for (int c = 0; c < 3; ++c) EXPECT_EQ(standing.pixel(299, x)[c], lying.pixel(x, 0)[c]);
  }
}

TEST(ImageFile, SixteenBitGrayKeepsItsHighByte) {
  cv::Mat gray(2, 256, CV_16UC1);
  for (int x = 0; x < 256; ++x) {
    gray.at<uint16_t>(0, x) = static_cast<uint16_t>(257 * x);
    gray.at<uint16_t>(1, x) = static_cast<uint16_t>(256 * x + 255);
  }
  std::vector<uint8_t> file;
  cv::imencode(".png", gray, file);
  const Image image = decode_image(std::as_bytes(std::span(file)), "x");
  for (int x = 0; x < 256; ++x) {
    EXPECT_EQ(image.pixel(x, 0)[0], x);
    EXPECT_EQ(image.pixel(x, 1)[2], x);
  }
}

TEST(ImageFile, EveryAlphaIsBlendedOntoWhiteAndRounded) {
  cv::Mat bgra(256, 256, CV_8UC4);
  for (int a = 0; a < 256; ++a) {
    for (int c = 0; c < 256; ++c) {
      const auto byte = [](int value) { return static_cast<uint8_t>(value); };
      bgra.at<cv::Vec4b>(a, c) = {byte(c), byte(255 - c), byte(c / 2), byte(a)};
    }
  }
  std::vector<uint8_t> file;
  cv::imencode(".png", bgra, file);
  const Image image = decode_image(std::as_bytes(std::span(file)), "x");
  const auto on_white = [](int c, int a) {
    return static_cast<int>(std::lround((c * a + 255.0 * (255 - a)) / 255.0));
  };
  for (int a = 0; a < 256; ++a) {
    for (int c = 0; c < 256; ++c) {
      EXPECT_EQ(image.pixel(c, a)[0], on_white(c / 2, a));
      EXPECT_EQ(image.pixel(c, a)[1], on_white(255 - c, a));
      EXPECT_EQ(image.pixel(c, a)[2], on_white(c, a));
    }
  }
}

TEST(ImageFile, OtherFormatsAreDecodedToo) {
  const Image image = read_image(kPng);
  cv::Mat bgr(image.height, image.width, CV_8UC3);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const uint8_t* rgb = image.pixel(x, y);
      bgr.at<cv::Vec3b>(y, x) = {rgb[2], rgb[1], rgb[0]};
    }
  }
  for (const char* extension : {".bmp", ".tiff", ".ppm", ".webp"}) {
    std::vector<uint8_t> file;
    // A quality above 100 asks OpenCV's WebP for no loss.
    ASSERT_TRUE(cv::imencode(extension, bgr, file, {cv::IMWRITE_WEBP_QUALITY, 101}));
    EXPECT_EQ(decode_image(std::as_bytes(std::span(file)), "x").rgb, image.rgb) << extension;
  }
}

TEST(ImageFile, SixteenBitColoursKeepTheirHighByte) {
  cv::Mat bgr(2, 256, CV_16UC3);
  for (int x = 0; x < 256; ++x) {
    const auto level = [](int value) { return static_cast<uint16_t>(value); };
    bgr.at<cv::Vec3w>(0, x) = {level(256 * x), level(256 * x + 255), level(65535 - 256 * x)};
    bgr.at<cv::Vec3w>(1, x) = {level(128), level(257 * x), level(256 * x + 127)};
  }
  for (const char* extension : {".png", ".tiff"}) {
    std::vector<uint8_t> file;
    ASSERT_TRUE(cv::imencode(extension, bgr, file));
    const Image image = decode_image(std::as_bytes(std::span(file)), "x");
    for (int x = 0; x < 256; ++x) {
      for (int y = 0; y < 2; ++y) {
        for (int c = 0; c < 3; ++c) {
          EXPECT_EQ(image.pixel(x, y)[c], bgr.at<cv::Vec3w>(y, x)[2 - c] >> 8) << extension << x;
        }
      }
    }
  }
}

TEST(ImageFile, CutOffPhotosAreRefused) {
  for (const std::string& path : {kJpeg, kPng}) {
    const std::string whole = content(path);
    EXPECT_EQ(error_of(whole), "");
    EXPECT_EQ(error_of(whole + "appended video"), "") << path;
    for (const size_t size : {whole.size() / 10, whole.size() / 2, whole.size() - 40}) {
      EXPECT_THAT(error_of(whole.substr(0, size)), HasSubstr("cut off")) << path << " " << size;
    }
  }
  EXPECT_THAT(error_of(content(kJpeg).substr(0, content(kJpeg).size() - 2)), HasSubstr("cut off"));
}

TEST(ImageFile, WhatIsNoPhotoIsCalledWhatItIs) {
  EXPECT_THAT(error_of(""), HasSubstr("empty"));
  EXPECT_THAT(error_of("<html>404</html>"), HasSubstr("web page"));
  EXPECT_THAT(error_of("hello"), HasSubstr("not an image"));
  EXPECT_THAT(error_of(std::string("\0\0\0\x18", 4) + "ftypisom"), HasSubstr("video"));
  EXPECT_THAT(error_of(std::string(1000, '\0')), HasSubstr("not an image"));
}

}  // namespace
}  // namespace vggtcd
