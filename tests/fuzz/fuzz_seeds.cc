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
  cv::Mat picture(32, 40, CV_8UC4);  // JPEG 2000 wants 32 pixels for its six resolutions
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

std::string part(const std::string& bytes) {
  return std::string{static_cast<char>(bytes.size() & 255), static_cast<char>(bytes.size() >> 8)} +
         bytes;
}

template <typename T>
std::string raw(T value) {
  return std::string(reinterpret_cast<const char*>(&value), sizeof(T));
}

// A model of one camera, one image and one point.
void write_colmap_seeds(const fs::path& folder) {
  const std::string cameras = raw<uint64_t>(1) + raw<uint32_t>(1) + raw<int32_t>(1) +
                              raw<uint64_t>(640) + raw<uint64_t>(480) + raw(500.0) + raw(500.0) +
                              raw(320.0) + raw(240.0);
  const std::string images = raw<uint64_t>(1) + raw<uint32_t>(7) + raw(1.0) + raw(0.0) + raw(0.0) +
                             raw(0.0) + raw(0.5) + raw(-1.0) + raw(2.0) + raw<uint32_t>(1) +
                             std::string("a.jpg\0", 6) + raw<uint64_t>(1) + raw(1.5) + raw(2.5) +
                             raw<uint64_t>(3);
  const std::string points = raw<uint64_t>(1) + raw<uint64_t>(3) + raw(1.0) + raw(2.0) + raw(3.0) +
                             "rgb" + raw(0.5) + raw<uint64_t>(1) + raw<uint32_t>(7) +
                             raw<uint32_t>(0);
  write(folder / "binary", "b" + part(cameras) + part(images) + points);
  write(folder / "text", "a" + part("# cameras\n1 SIMPLE_RADIAL 640 480 500 320 240 0.1\n") +
                             part("1 1 0 0 0 0.5 -1 2 1 a b.jpg\n1.5 2.5 3\n") +
                             "3 1 2 3 10 20 30 0.5 1 0\n");
}

void write_table_seeds(const fs::path& folder) {
  write(folder / "tum",
        std::string(1, '\0') + "# a comment\n0.5 1 2 3 0 0 0 1\n1e0 -1 2e-3 3 0 0 0.6 0.8\n");
  write(folder / "csv", "\1name;x;y;z\nbefore/a b.jpg;691234.5;5334321.25;1e2\nafter/3,1,2,3\n");
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 3, 4), }";
  header += std::string(117 - header.size(), ' ') + "\n";
  std::string npy = std::string("\x93NUMPY\1\0", 8) + raw<uint16_t>(118) + header;
  for (const double value : {1., 0., 0., 4., 0., 1., 0., 5., 0., 0., 1., 6.}) npy += raw(value);
  write(folder / "npy", "\2" + npy);
}

void write_ply_seeds(const fs::path& folder) {
  const std::string start = "ply\nformat binary_little_endian 1.0\ncomment c\nelement vertex 2\n";
  write(folder / "floats",
        start +
            "property float x\nproperty float y\nproperty float z\nproperty uchar red\n"
            "property uchar green\nproperty uchar blue\nproperty float scalar_a\nend_header\n" +
            std::string(38, 'p'));
  write(folder / "doubles",
        start +
            "property double x\nproperty double y\nproperty double z\nproperty short s\n"
            "element face 0\nproperty list uchar int vertex_indices\nend_header\n" +
            std::string(52, 'q'));
}

void write_json_seeds(const fs::path& folder) {
  write(folder / "sim3",
        R"({"scale":1.5,"rotation":[[0,-1,0],[1,0,0],[0,0,1]],"translation":[1e3,-2,0.5]})");
  write(folder / "options",
        R"({"flag":true,"many":-3,"seed":18446744073709551615,"share":1e308,"length":0.1,)"
        R"("name":"\u00e9\n","kind":"other","inner":{"whole":2}})");
  write(folder / "index",
        R"({"metadata":{"total_size":8},"weight_map":{"a.weight":"model-1-of-2.safetensors",)"
        R"("b":"model-2-of-2.safetensors"}})");
}

// All keys, in the layouts of VGGT and of Depth Anything 3; one number is replaced by one third.
void write_prediction_seeds(const fs::path& folder) {
  const std::string edit = std::string("\2\5\0", 3) + "\x3f\xd5\x55\x55\x55\x55\x55\x55";
  write(folder / "vggt", "\xe3\x36" + part("photo.jpg") + edit);
  write(folder / "da3", "\x3a\x36" + part("") + edit);
  write(folder / "square", "\x47\x36" + part("") + edit);
}

void write_result_list_seeds(const fs::path& folder) {
  write(folder / "results",
        "vggt-cd results 1\n00000000000000ff 12 report.html\n0123456789abcdef 3 a/b \\n c.png\n");
  write(folder / "old", "Written by vggt-cd, which may replace this directory.\n");
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
  write_colmap_seeds(folder / "fuzz_colmap");
  write_json_seeds(folder / "fuzz_json");
  write_ply_seeds(folder / "fuzz_ply");
  write_prediction_seeds(folder / "fuzz_predictions");
  write_result_list_seeds(folder / "fuzz_result_list");
  write_table_seeds(folder / "fuzz_tables");
  return 0;
}
