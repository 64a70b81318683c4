// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/image_write.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <opencv2/imgcodecs.hpp>

#include "tests/support/test_files.h"

namespace vggtcd {
namespace {

Image example() {
  Image image(37, 21);
  for (size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = static_cast<uint8_t>(i * 7 % 251);
  return image;
}

TEST(WritePng, KeepsEveryPixelInRgbOrder) {
  const TemporaryDirectory directory;
  const Image image = example();
  write_png(directory / "a.png", image);
  const cv::Mat bgr = cv::imread((directory / "a.png").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(bgr.rows, 21);
  ASSERT_EQ(bgr.cols, 37);
  ASSERT_EQ(bgr.channels(), 3);
  for (int y = 0; y < 21; ++y) {
    for (int x = 0; x < 37; ++x) {
      const cv::Vec3b pixel = bgr.at<cv::Vec3b>(y, x);
      for (int k = 0; k < 3; ++k) ASSERT_EQ(pixel[2 - k], image.pixel(x, y)[k]);
    }
  }
}

TEST(WriteJpeg, IsCloseAtHighQuality) {
  Image image(64, 64);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      image.pixel(x, y)[0] = static_cast<uint8_t>(4 * x);
      image.pixel(x, y)[1] = static_cast<uint8_t>(4 * y);
      image.pixel(x, y)[2] = 30;
    }
  }
  const TemporaryDirectory directory;
  write_jpeg(directory / "a.jpg", image, 95);
  const cv::Mat bgr = cv::imread((directory / "a.jpg").string());
  ASSERT_EQ(bgr.cols, 64);
  // A smooth ramp at quality 95: a few levels. Swapped channels would be off by up to 220.
  for (int x = 4; x < 60; ++x) {
    EXPECT_NEAR(bgr.at<cv::Vec3b>(20, x)[2], 4 * x, 6);
    EXPECT_NEAR(bgr.at<cv::Vec3b>(20, x)[0], 30, 6);
  }
}

TEST(WritePng, SamePixelsGiveSameBytesAndFailureIsAnOutputError) {
  EXPECT_EQ(encode_png(example()), encode_png(example()));
  const TemporaryDirectory directory;
  EXPECT_ERROR(write_png(directory / "no/a.png", example()), ErrorCode::kOutput, "no/a.png");
}

}  // namespace
}  // namespace vggtcd
