// SPDX-License-Identifier: Apache-2.0
// PlyWriter: header, then packed records through a buffer.
#include <algorithm>
#include <cctype>
#include <cstring>

#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/io/ply.h"

namespace vggtcd {
namespace {

constexpr size_t kBufferBytes = size_t{1} << 20;

template <typename T>
void append(std::vector<std::byte>& buffer, const T* values, size_t count) {
  const auto bytes = std::as_bytes(std::span(values, count));
  buffer.insert(buffer.end(), bytes.begin(), bytes.end());
}

bool is_word(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_';
  });
}

}  // namespace

PlyWriter::PlyWriter(std::filesystem::path path, size_t num_points, std::vector<std::string> fields,
                     std::span<const std::string> comments, const Eigen::Vector3d& origin)
    : file_(std::move(path)), origin_(origin), num_points_(num_points), num_fields_(fields.size()) {
  std::string header = "ply\nformat binary_little_endian 1.0\n";
  for (const std::string& comment : comments) {
    check(comment.find_first_of("\r\n") == std::string::npos, "PlyWriter: comment of one line");
    header += "comment " + comment + "\n";
  }
  header += fmt::format("element vertex {}\n", num_points);
  const char* position_type = origin.isZero(0) ? "float" : "double";
  for (const char* axis : {"x", "y", "z"}) {
    header += fmt::format("property {} {}\n", position_type, axis);
  }
  for (const char* channel : {"red", "green", "blue"}) {
    header += fmt::format("property uchar {}\n", channel);
  }
  for (const std::string& field : fields) {
    check(is_word(field), "PlyWriter: field name");
    header += "property float scalar_" + field + "\n";
  }
  if (!fields.empty()) header += "property float quality\n";
  file_.write(header + "end_header\n");
  buffer_.reserve(kBufferBytes + 1024);
}

void PlyWriter::add(const Eigen::Vector3f& position, const uint8_t* rgb,
                    std::span<const float> values) {
  check(values.size() == num_fields_, "PlyWriter: one value per field");
  if (origin_.isZero(0)) {
    append(buffer_, position.data(), 3);
  } else {
    const Eigen::Vector3d in_file = origin_ + position.cast<double>();
    append(buffer_, in_file.data(), 3);
  }
  append(buffer_, rgb, 3);
  append(buffer_, values.data(), values.size());
  if (!values.empty()) append(buffer_, values.data(), 1);
  ++added_;
  if (buffer_.size() >= kBufferBytes) flush();
}

void PlyWriter::flush() {
  throw_if_interrupted();
  file_.write(std::span<const std::byte>(buffer_));
  buffer_.clear();
}

void PlyWriter::commit() {
  check(added_ == num_points_, "PlyWriter: as many points as promised");
  flush();
  file_.commit();
}

}  // namespace vggtcd
