// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/vggt/preprocess.h"

#include <gmock/gmock.h>
#include <zlib.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/vggt/image_resize.h"

namespace vggtcd {
namespace {

using ::testing::HasSubstr;

const std::string kGolden = VGGTCD_SOURCE_DIR "/tests/golden/preprocess/";

nlohmann::json expected_outputs() {
  std::ifstream file(kGolden + "expected.json");
  return nlohmann::json::parse(file);
}

// The picture as the reference's loader has it before resizing.
Image decoded(const std::string& key) {
  const NpzReader npz(kGolden + "decoded.npz");
  const std::vector<int64_t> shape = npz.header(key).shape;
  Image image(static_cast<int>(shape[1]), static_cast<int>(shape[0]));
  image.rgb = npz.read<uint8_t>(key);
  return image;
}

// [S, 3, H, W] as the bytes k of k / 255.
std::vector<uint8_t> bytes_of(const ImageBatch& batch) {
  std::vector<uint8_t> bytes;
  for (const float value : batch.pixels) {
    const float k = value * 255.0f;
    const uint8_t byte = static_cast<uint8_t>(k + 0.5f);
    EXPECT_EQ(static_cast<float>(byte) / 255.0f, value);
    bytes.push_back(byte);
  }
  return bytes;
}

std::string crc_of(const std::vector<uint8_t>& bytes) {
  return fmt::format("{:08x}", crc32_z(0, bytes.data(), bytes.size()));
}

void expect_golden(FitMode mode, const std::string& mode_name) {
  const NpzReader rows(kGolden + "rows.npz");
  const nlohmann::json expected = expected_outputs()[mode_name];
  for (const auto& [key, output] : expected.items()) {
    if (output.contains("members")) continue;
    const Image fitted = fit_photo(decoded(key), mode, key);
    const ImageBatch batch = make_batch(std::span(&fitted, 1), {key});
    const std::vector<uint8_t> bytes = bytes_of(batch);
    ASSERT_EQ((std::vector<int64_t>{3, batch.height, batch.width}),
              output["shape"].get<std::vector<int64_t>>())
        << mode_name << key;
    EXPECT_EQ(crc_of(bytes), output["crc32"]) << mode_name << " " << key;
    // Where it differs, if it does.
    const std::vector<uint8_t> row = rows.read<uint8_t>(mode_name + "_" + key);
    const size_t width = static_cast<size_t>(batch.width),
                 height = static_cast<size_t>(batch.height);
    for (size_t i = 0; i < row.size(); ++i) {
      const size_t at = (i / width * height + height / 2) * width + i % width;
      ASSERT_EQ(bytes[at], row[i])
          << mode_name << " " << key << " channel " << i / width << " x " << i % width;
    }
  }
}

TEST(Preprocess, CropModeEqualsTheReferenceBitForBit) { expect_golden(FitMode::kCrop, "crop"); }
TEST(Preprocess, PadModeEqualsTheReferenceBitForBit) { expect_golden(FitMode::kPad, "pad"); }

TEST(Preprocess, MixedSizesAreCentredOnWhiteLikeTheReferences) {
  const nlohmann::json expected = expected_outputs()["crop"];
  for (const char* name : {"mixed_a", "mixed_b"}) {
    std::vector<Image> photos;
    for (const std::string key : expected[name]["members"]) {
      photos.push_back(fit_photo(decoded(key), FitMode::kCrop, key));
    }
    const ImageBatch batch = make_batch(photos, std::vector<std::string>(photos.size()));
    EXPECT_EQ((std::vector<int64_t>{batch.frames, 3, batch.height, batch.width}),
              expected[name]["shape"].get<std::vector<int64_t>>());
    EXPECT_EQ(crc_of(bytes_of(batch)), expected[name]["crc32"]) << name;
  }
}

// From the files: PNG exactly (the 16-bit one apart, see docs/formats.md).
TEST(Preprocess, PngFilesGiveTheReferencesBatchBitForBit) {
  const nlohmann::json golden = expected_outputs();
  for (const auto& [key, file] : golden["files"].items()) {
    if (!file.get<std::string>().ends_with(".png") || key == "09") continue;
    const std::filesystem::path path = kGolden + file.get<std::string>();
    const PhotoRef photo{path, path.filename().string(), nullptr};
    const ImageBatch batch =
        load_photos(std::span(&photo, 1), {.apply_exif_orientation = false}, silent_progress());
    EXPECT_EQ(crc_of(bytes_of(batch)), golden["crop"][key]["crc32"]) << key;
    EXPECT_EQ(batch.names, std::vector<std::string>{path.filename().string()});
  }
}

TEST(Preprocess, ResizingToTheSameSizeChangesNothing) {
  const Image image = decoded("07");
  EXPECT_EQ(resize_bicubic(image, image.width, image.height, 0, image.height).rgb, image.rgb);
}

TEST(Preprocess, SomeRowsAreTheRowsOfTheWhole) {
  const Image image = decoded("10");
  const Image whole = resize_bicubic(image, 60, 77, 0, 77);
  const Image some = resize_bicubic(image, 60, 77, 30, 21);
  EXPECT_EQ(some.rgb,
            std::vector<uint8_t>(whole.rgb.begin() + 30 * 60 * 3, whole.rgb.begin() + 51 * 60 * 3));
}

TEST(Preprocess, OneColourStaysOneColour) {
  Image image(333, 77);
  std::ranges::fill(image.rgb, uint8_t{255});
  for (const int size : {1, 14, 77, 500}) {
    for (const uint8_t value : resize_bicubic(image, size, size, 0, size).rgb) {
      ASSERT_EQ(value, 255);
    }
  }
}

TEST(Preprocess, PanoramasOf20000PixelsAreFittedAndStripesRefused) {
  Image panorama(20000, 2500);
  const Image fitted = fit_photo(panorama, FitMode::kCrop, "p.jpg");
  EXPECT_EQ(fitted.width, 518);
  EXPECT_EQ(fitted.height, 70);
  const Image stripe(20000, 100), post(100, 20000);
  for (const auto& [image, mode] :
       {std::pair(&stripe, FitMode::kCrop), std::pair(&stripe, FitMode::kPad),
        std::pair(&post, FitMode::kPad)}) {
    try {
      fit_photo(*image, mode, "stripe.jpg");
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInput);
      EXPECT_THAT(error.what(), HasSubstr("stripe.jpg: "));
      EXPECT_THAT(error.what(), HasSubstr("too narrow"));
    }
  }
  EXPECT_EQ(fit_photo(post, FitMode::kCrop, "p").height, 518);  // the middle of a very tall one
}

TEST(Preprocess, AnotherSideScalesTheFrame) {
  const Image photo(640, 480);
  const Image fitted = fit_photo(photo, FitMode::kCrop, "x", 140);
  EXPECT_EQ(fitted.width, 140);
  EXPECT_EQ(fitted.height, 112);  // 105 px are 7.5 patches; ties go to the even number
}

TEST(Preprocess, NoPhotosIsAnError) { EXPECT_THROW(load_photos({}, {}, silent_progress()), Error); }

}  // namespace
}  // namespace vggtcd
