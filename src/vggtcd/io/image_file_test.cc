// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/image_file.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "vggtcd/core/error.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/io/picture_header.h"

namespace vggtcd {
namespace {

using ::testing::ElementsAre;
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

// A picture of noise: every part of its data shows.
cv::Mat noise(int width, int height, int type) {
  cv::Mat picture(height, width, type);
  cv::RNG(7).fill(picture, cv::RNG::UNIFORM, 0, 256);
  return picture;
}

std::string encoded(const char* extension, const cv::Mat& picture,
                    const std::vector<int>& parameters = {}) {
  std::vector<uint8_t> file;
  EXPECT_TRUE(cv::imencode(extension, picture, file, parameters));
  return {file.begin(), file.end()};
}

struct Outcome {
  Image image;
  PhotoFacts facts;
};

Outcome decoded(const std::string& bytes) {
  Outcome outcome;
  outcome.image = decode_image(std::as_bytes(std::span(bytes)), "photo.jpg", {}, &outcome.facts);
  return outcome;
}

TEST(ImageFile, CutOffPhotosAreRefused) {
  for (const std::string& path : {kJpeg, kPng}) {
    const std::string whole = content(path);
    EXPECT_EQ(error_of(whole), "");
    for (const size_t size : {whole.size() / 10, whole.size() / 2, whole.size() - 40}) {
      EXPECT_THAT(error_of(whole.substr(0, size)), HasSubstr("cut off")) << path << " " << size;
    }
  }
}

// Wherever it is cut, a picture is whole or refused, never one that ends in grey without a word.
TEST(ImageFile, AJpegCutAnywhereIsRefusedOrWhole) {
  for (const int restart : {0, 2}) {
    const std::string whole =
        encoded(".jpg", noise(40, 24, CV_8UC3), {cv::IMWRITE_JPEG_RST_INTERVAL, restart});
    const Image image = decoded(whole).image;
    size_t accepted = 0;
    for (size_t size = 1; size <= whole.size(); ++size) {
      try {
        const Outcome cut = decoded(whole.substr(0, size));
        EXPECT_TRUE(cut.image.rgb == image.rgb) << size << " of " << whole.size();
        EXPECT_TRUE(cut.facts.remarks.empty()) << cut.facts.remarks.front();
        ++accepted;
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kInput) << error.what();
      }
    }
    EXPECT_GE(accepted, 3u);  // the whole one, and those without all of the end marker
    EXPECT_LE(accepted, 8u);
  }
}

TEST(ImageFile, WhatTheDecoderReadsIsReadableWhateverItsEnd) {
  const std::string whole = content(kJpeg);
  ASSERT_TRUE(whole.ends_with("\xff\xd9"));
  const std::string data = whole.substr(0, whole.size() - 2);
  const Image image = decoded(whole).image;
  const std::string fill("\xff\xff\xff\xff", 4), end("\xff\xd9", 2);
  for (const std::string& file :
       {data + "\xff" + end, data + fill + end, data, data + "\xff", whole + fill,
        whole + std::string(100, '\0'), whole + "appended video \xff\xd8\xff\xda",
        data +
            std::string("\0\0\0\x18"
                        "ftypisom",
                        12) +
            std::string(5000, '\x11')}) {
    EXPECT_EQ(decoded(file).image.rgb, image.rgb) << file.size() - data.size();
  }
  const std::string png = content(kPng);
  EXPECT_EQ(decoded(png + "appended").image.rgb, decoded(png).image.rgb);
}

// As recovery tools leave it: the decoder fills what is missing, so somebody has to say it.
TEST(ImageFile, AJpegCutInTheMiddleWithAnEndMarkerIsUsedWithARemark) {
  const std::string whole = content(kJpeg);
  const Outcome cut = decoded(whole.substr(0, whole.size() / 2) + "\xff\xd9");
  EXPECT_EQ(cut.image.rgb.size(), decoded(whole).image.rgb.size());
  EXPECT_THAT(cut.facts.remarks,
              ElementsAre(HasSubstr("part of the picture is damaged or missing")));
  EXPECT_TRUE(decoded(whole).facts.remarks.empty());
}

// Uncompressed grey that claims 47 samples per pixel.
std::string tiff_of_many_samples() {
  constexpr int kWidth = 64, kHeight = 48;
  const auto number = [](uint32_t value, int bytes) {
    std::string text;
    for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> 8 * i);
    return text;
  };
  const std::pair<uint32_t, uint32_t> fields[] = {
      {256, kWidth},  {257, kHeight},         {258, 8}, {259, 1}, {262, 1}, {273, 8}, {277, 47},
      {278, kHeight}, {279, kWidth * kHeight}};
  std::string file = std::string("II*\0", 4) + number(8 + kWidth * kHeight, 4) +
                     std::string(kWidth * kHeight, 'x') + number(std::size(fields), 2);
  for (const auto& [tag, value] : fields) {
    file += number(tag, 2) + number(4, 2) + number(1, 4) + number(value, 4);
  }
  return file + std::string(4, '\0');
}

TEST(ImageFile, WhatADecoderComplainsAboutIsARemarkAndNothingIsPrinted) {
  const std::string whole = content(kJpeg);
  ::testing::internal::CaptureStderr();
  const Outcome outcome = decoded(whole.substr(0, whole.size() - 2) + "abc\xff\xd9");
  std::string broken = whole;
  for (size_t i = 0; i < 40; ++i) broken[broken.size() / 2 + i] = '\x55';
  EXPECT_THAT(decoded(broken).facts.remarks, ElementsAre(HasSubstr("damaged")));
  EXPECT_THAT(error_of(tiff_of_many_samples()), HasSubstr("not an image"));
  EXPECT_THAT(error_of(content(kPng).substr(0, 3000)), HasSubstr("cut off"));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_THAT(outcome.facts.remarks, ElementsAre(HasSubstr("says \"Corrupt JPEG data: 2 extra")));
  EXPECT_EQ(outcome.image.rgb, decoded(whole).image.rgb);
}

TEST(ImageFile, DamagedDataOfAnyFormatAreRefusedOrGiveAPictureOfTheWholeSize) {
  for (const char* extension : {".png", ".tiff", ".webp", ".jp2"}) {
    for (const int type : {CV_8UC3, CV_8UC4, CV_16UC3}) {
      if (std::string(extension) == ".webp" && type == CV_16UC3) continue;
      std::string file = encoded(extension, noise(48, 40, type));
      for (size_t i = 0; i < 20; ++i) file[file.size() / 2 + i] ^= '\x2a';
      try {
        EXPECT_EQ(decoded(file).image.rgb.size(), 3u * 48 * 40) << extension << type;
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kInput) << error.what();
      }
    }
  }
}

// A sound JPEG of one grey: each block of 8 x 8 px takes two bits.
std::string gray_jpeg(int width, int height, char frame_marker) {
  const auto segment = [](char marker, const std::string& data) {
    const size_t size = data.size() + 2;
    return std::string{'\xff', marker, static_cast<char>(size >> 8), static_cast<char>(size)} +
           data;
  };
  const auto two = [](int number) {
    return std::string{static_cast<char>(number >> 8), static_cast<char>(number)};
  };
  const std::string one_code = std::string(1, '\1') + std::string(15, '\0') + '\0';
  const size_t blocks =
      static_cast<size_t>((width + 7) / 8) * static_cast<size_t>((height + 7) / 8);
  return "\xff\xd8" + segment('\xdb', '\0' + std::string(64, '\1')) +
         segment(frame_marker, '\x08' + two(height) + two(width) + std::string("\1\1\x11\0", 4)) +
         segment('\xc4', '\0' + one_code) + segment('\xc4', '\x10' + one_code) +
         segment('\xda', std::string("\1\1\0\0\x3f\0", 6)) + std::string(blocks / 4 + 1, '\0') +
         "\xff\xd9";
}

TEST(ImageFile, AJpegOfMoreThanIsUsedIsDecodedSmaller) {
  constexpr char kBaseline = '\xc0', kProgressive = '\xc2';
  const Outcome small = decoded(gray_jpeg(400, 300, kBaseline));
  EXPECT_EQ(small.image.width, 400);
  EXPECT_TRUE(small.facts.remarks.empty());
  const std::string large = gray_jpeg(16520, 16384, kBaseline);
  const Outcome outcome = decoded(large);
  EXPECT_EQ(outcome.image.width, 4130);
  EXPECT_EQ(outcome.image.height, 4096);
  EXPECT_THAT(outcome.facts.remarks, ElementsAre(HasSubstr("16520 x 16384 px (270 megapixels)")));
  EXPECT_LT(decode_bytes(std::as_bytes(std::span(large))), 150'000'000);
  // Its decoder would keep all of it.
  EXPECT_THAT(error_of(gray_jpeg(30000, 30000, kProgressive)),
              HasSubstr("too large: expected at most 268 megapixels, found 30000 x 30000 px"));
  EXPECT_THAT(error_of(gray_jpeg(65000, 65000, kBaseline)), HasSubstr("too large"));
}

TEST(ImageFile, OtherFormatsAreRefusedAsTooLargeBeforeTheyAreDecoded) {
  std::string png = encoded(".png", noise(8, 8, CV_8UC3));
  png.replace(16, 8, std::string("\0\0\x75\x30\0\0\x75\x30", 8));
  EXPECT_THAT(error_of(png), HasSubstr("too large: expected at most 268 megapixels, found 30000"));
  std::string bmp = encoded(".bmp", noise(8, 8, CV_8UC3));
  bmp.replace(18, 8, std::string("\x30\x75\0\0\x30\x75\0\0", 8));
  EXPECT_THAT(error_of(bmp), HasSubstr("too large"));
  EXPECT_THAT(error_of("P6\n# comment 1\n30000 30000\n255\n"), HasSubstr("too large"));
}

TEST(PictureHeader, KnowsTheSizeOfEachFormat) {
  for (const char* extension : {".jpg", ".png", ".webp", ".tiff", ".bmp", ".ppm", ".pgm", ".jp2"}) {
    for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4}) {
      const std::string name = extension;
      if ((name == ".ppm" && type != CV_8UC3) || (name == ".pgm" && type != CV_8UC1)) continue;
      if (name == ".jpg" && type == CV_8UC4) continue;
      const std::string file = encoded(extension, noise(45, 33, type));
      const auto header = read_picture_header(std::as_bytes(std::span(file)));
      ASSERT_TRUE(header) << extension;
      EXPECT_EQ(header->width, 45) << extension << type;
      EXPECT_EQ(header->height, 33) << extension << type;
      EXPECT_FALSE(header->in_scans);
      EXPECT_GE(decode_bytes(std::as_bytes(std::span(file))), 45 * 33 * 6);
    }
  }
  const std::string lossless =
      encoded(".webp", noise(45, 33, CV_8UC3), {cv::IMWRITE_WEBP_QUALITY, 101});
  EXPECT_EQ(read_picture_header(std::as_bytes(std::span(lossless)))->height, 33);
  const std::string scans =
      encoded(".jpg", noise(45, 33, CV_8UC3), {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  EXPECT_TRUE(read_picture_header(std::as_bytes(std::span(scans)))->in_scans);
  EXPECT_FALSE(read_picture_header({}));
}

// EXIF 2.32, tag 274: where row 0 and column 0 of the file are.
TEST(TurnedUpright, PutsEachPixelWhereItsOrientationSays) {
  constexpr int kW = 5, kH = 3;
  Image image(kW, kH);
  for (size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = static_cast<uint8_t>(i);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const Image turned = turned_upright(image, orientation);
    ASSERT_EQ(turned.width, orientation < 5 ? kW : kH);
    for (int v = 0; v < turned.height; ++v) {
      for (int u = 0; u < turned.width; ++u) {
        const std::pair<int, int> source[] = {
            {u, v}, {kW - 1 - u, v}, {kW - 1 - u, kH - 1 - v}, {u, kH - 1 - v},
            {v, u}, {v, kH - 1 - u}, {kW - 1 - v, kH - 1 - u}, {kW - 1 - v, u}};
        const auto [x, y] = source[orientation - 1];
        EXPECT_EQ(turned.pixel(u, v)[1], image.pixel(x, y)[1]) << orientation;
      }
    }
  }
}

// EXIF with orientation 6, 35 mm equivalent of 77, a lens.
std::string exif_block() {
  std::string tiff(
      "MM\0\x2a\0\0\0\x08"
      "\0\x02",
      10);
  tiff += std::string("\x01\x12\0\x03\0\0\0\x01\0\x06\0\0", 12);
  tiff += std::string(
      "\x87\x69\0\x04\0\0\0\x01\0\0\0\x26"
      "\0\0\0\0",
      16);
  tiff += std::string(
      "\0\x03"
      "\x92\x0a\0\x05\0\0\0\x01\0\0\0\x50",
      14);
  tiff += std::string("\xa4\x05\0\x03\0\0\0\x01\0\x4d\0\0", 12);
  tiff += std::string(
      "\xa4\x34\0\x02\0\0\0\x05\0\0\0\x58"
      "\0\0\0\0",
      16);
  return tiff + std::string(
                    "\0\0\0\x5a\0\0\0\x0a"
                    "tele\0",
                    13);
}

std::string with_exif(const std::string& file, const std::string& extension) {
  const std::string exif = exif_block();
  const auto number = [](size_t value, int bytes, bool big) {
    std::string text;
    for (int i = 0; i < bytes; ++i) {
      text += static_cast<char>(value >> 8 * (big ? bytes - 1 - i : i));
    }
    return text;
  };
  if (extension == ".jpg") {
    return file.substr(0, 2) + "\xff\xe1" + number(exif.size() + 8, 2, true) +
           std::string("Exif\0\0", 6) + exif + file.substr(2);
  }
  if (extension == ".png") {
    uint32_t crc = 0xffffffff;
    for (const char c : "eXIf" + exif) {
      crc ^= static_cast<uint8_t>(c);
      for (int i = 0; i < 8; ++i) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0u);
    }
    return file.substr(0, 33) + number(exif.size(), 4, true) + "eXIf" + exif +
           number(crc ^ 0xffffffff, 4, true) + file.substr(33);
  }
  const std::string extended = "VP8X" + number(10, 4, false) + number(0x18, 4, false) +
                               number(23, 3, false) + number(15, 3, false);
  const std::string chunks = "WEBP" + extended + file.substr(12) + "EXIF" +
                             number(exif.size(), 4, false) + exif + (exif.size() % 2 ? "\0" : "");
  return "RIFF" + number(chunks.size(), 4, false) + chunks;
}

TEST(ImageFile, ExifOrientationTurnsPngAndWebPAsItDoesJpeg) {
  for (const char* extension : {".jpg", ".png", ".webp"}) {
    for (const int type : {CV_8UC3, CV_8UC4}) {
      const std::string plain = encoded(extension, noise(24, 16, type));
      const std::string turned = with_exif(plain, extension);
      const Outcome outcome = decoded(turned);
      EXPECT_EQ(outcome.image.rgb, turned_upright(decoded(plain).image, 6).rgb)
          << extension << type;
      EXPECT_EQ(outcome.image.width, 16) << extension;
      EXPECT_EQ(outcome.facts.exif.orientation, 6);
      EXPECT_EQ(outcome.facts.exif.lens, "tele");
      EXPECT_EQ(outcome.facts.exif.focal_35mm, 77);
      EXPECT_EQ(outcome.facts.exif.focal_mm, 9);
      EXPECT_EQ(decode_image(std::as_bytes(std::span(turned)), "x", kAsReference).rgb,
                decoded(plain).image.rgb);
    }
  }
}

TEST(Exif, CutAnywhereIsReadAsFarAsItGoes) {
  const std::string whole = exif_block();
  for (size_t size = 0; size <= whole.size(); ++size) {
    const Exif exif = parse_exif(std::as_bytes(std::span(whole).first(size)));
    EXPECT_TRUE(exif.orientation == 1 || exif.orientation == 6);
  }
  EXPECT_EQ(parse_exif(std::as_bytes(std::span(whole))).lens, "tele");
}

TEST(ImageFile, APanoramaAllAroundIsRemarkedOn) {
  cv::Mat wide(1000, 2000, CV_8UC3, cv::Scalar::all(90));
  EXPECT_THAT(decoded(encoded(".png", wide)).facts.remarks, ElementsAre(HasSubstr("panorama")));
  EXPECT_TRUE(decoded(encoded(".png", wide.colRange(0, 1990))).facts.remarks.empty());
  const std::string jpeg = encoded(".jpg", noise(64, 48, CV_8UC3));
  const std::string xmp = "GPano:ProjectionType=\"equirectangular\"";
  const std::string said = jpeg.substr(0, 2) + "\xff\xe1" + std::string(1, '\0') +
                           static_cast<char>(xmp.size() + 2) + xmp + jpeg.substr(2);
  EXPECT_THAT(decoded(said).facts.remarks, ElementsAre(HasSubstr("panorama")));
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
