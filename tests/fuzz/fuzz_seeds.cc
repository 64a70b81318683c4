// SPDX-License-Identifier: Apache-2.0
// Writes the seeds of the fuzz targets: fuzz_seeds FOLDER makes FOLDER/TARGET/NAME.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/support/torch_writer.h"

namespace {

namespace fs = std::filesystem;

void write(const fs::path& path, const std::string& bytes) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string safetensors(const std::string& header, const std::string& data) {
  const uint64_t size = header.size();
  return std::string(reinterpret_cast<const char*>(&size), 8) + header + data;
}

// A picture of each format, with EXIF that turns it where the format has a place for it.
void write_pictures(const fs::path& folder) {
  cv::Mat picture(24, 32, CV_8UC4);
  cv::RNG(1).fill(picture, cv::RNG::UNIFORM, 0, 256);
  cv::Mat color;
  cv::extractChannel(picture, color, 0);
  cv::merge(std::vector<cv::Mat>{color, color, color}, color);
  const std::string exif("Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0",
                         32);
  for (const char* extension : {"jpg", "png", "webp", "tiff", "bmp", "ppm", "jp2"}) {
    std::vector<uint8_t> bytes;
    cv::imencode(std::string(".") + extension, color, bytes);
    std::string file(bytes.begin(), bytes.end());
    if (std::string(extension) == "jpg") {
      file = file.substr(0, 2) + std::string("\xff\xe1\0\x22", 4) + exif + file.substr(2);
    }
    write(folder / extension, file);
  }
  std::vector<uint8_t> bytes;
  cv::imencode(".jpg", color, bytes,
               {cv::IMWRITE_JPEG_PROGRESSIVE, 1, cv::IMWRITE_JPEG_RST_INTERVAL, 2});
  write(folder / "scans", std::string(bytes.begin(), bytes.end()));
  cv::imencode(".png", picture, bytes);
  write(folder / "rgba", std::string(bytes.begin(), bytes.end()));
  cv::imencode(".webp", picture, bytes, {cv::IMWRITE_WEBP_QUALITY, 101});
  write(folder / "lossless", std::string(bytes.begin(), bytes.end()));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: fuzz_seeds FOLDER\n");
    return 2;
  }
  const fs::path folder = argv[1];
  write_pictures(folder / "fuzz_image");
  const std::string header =
      R"({"__metadata__":{"config":"{}"},"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]},)"
      R"("b":{"dtype":"BF16","shape":[1,2],"data_offsets":[8,12]}} )";
  write(folder / "fuzz_safetensors" / "two", safetensors(header, "0123456789ab"));
  write(folder / "fuzz_safetensors" / "none", safetensors("{}", ""));

  const float values[6] = {1, 2, 3, 4, 5, 6};
  const std::vector<vggtcd::TensorView> tensors = {
      {"a.weight", vggtcd::DType::kF32, {2, 3}, std::as_bytes(std::span(values))},
      {"a.bias", vggtcd::DType::kF32, {2}, std::as_bytes(std::span(values).first(2))}};
  write(folder / "fuzz_torch_checkpoint" / "zip",
        vggtcd::testing::torch_zip_file("model", tensors));
  write(folder / "fuzz_torch_checkpoint" / "safetensors", safetensors(header, "0123456789ab"));
  write(folder / "fuzz_torch_pickle" / "state_dict", vggtcd::testing::state_dict_pickle(tensors));
  write(folder / "fuzz_torch_pickle" / "protocol4",
        std::string("\x80\x04\x95\x0a\0\0\0\0\0\0\0}\x94\x8c\x01"
                    "a\x94K\x01s.",
                    22));
  return 0;
}
