// SPDX-License-Identifier: Apache-2.0
// Reading PLY: the header decides the record, the file size must agree before memory is reserved.
#include <algorithm>
#include <charconv>
#include <cstring>
#include <fstream>
#include <sstream>

#include "vggtcd/core/error.h"
#include "vggtcd/io/ply.h"

namespace vggtcd {
namespace {

struct Property {
  std::string name;
  char kind = 'f';  // f: float, u: unsigned, i: signed
  size_t size = 4;
  size_t offset = 0;  // in the record
};

struct Header {
  int64_t num_points = -1;
  std::vector<Property> properties;
  size_t record_bytes = 0;
  const Property* find(std::string_view name) const {
    for (const Property& property : properties) {
      if (property.name == name) return &property;
    }
    return nullptr;
  }
};

[[noreturn]] void throw_not_ply(const std::string& what, std::string_view found) {
  throw_error(ErrorCode::kInput, "{}: expected a binary little-endian PLY point cloud, found {}",
              what, found);
}

bool set_type(Property& property, std::string_view type) {
  struct Type {
    std::string_view name, alias;
    char kind;
    size_t size;
  };
  constexpr Type kTypes[] = {{"float", "float32", 'f', 4}, {"double", "float64", 'f', 8},
                             {"uchar", "uint8", 'u', 1},   {"char", "int8", 'i', 1},
                             {"ushort", "uint16", 'u', 2}, {"short", "int16", 'i', 2},
                             {"uint", "uint32", 'u', 4},   {"int", "int32", 'i', 4}};
  for (const Type& entry : kTypes) {
    if (type != entry.name && type != entry.alias) continue;
    property.kind = entry.kind;
    property.size = entry.size;
    return true;
  }
  return false;
}

Header read_header(std::istream& file, const std::string& what) {
  Header header;
  std::string line;
  bool vertices = false, after = false;
  for (int number = 0; std::getline(file, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (number == 0 && line != "ply") throw_not_ply(what, "another file");
    std::istringstream words(line);
    std::string keyword, type, name;
    words >> keyword >> type >> name;
    if (keyword == "end_header") break;
    if (keyword == "format" && type != "binary_little_endian") throw_not_ply(what, type + " data");
    if (keyword == "element") {
      after = after || vertices;
      vertices = type == "vertex";
      if (!vertices && !after) throw_not_ply(what, "an element " + type + " before the vertices");
      if (vertices &&
          (after || std::from_chars(name.data(), name.data() + name.size(), header.num_points).ec !=
                        std::errc())) {
        throw_not_ply(what, "a broken header line: " + line.substr(0, 80));
      }
    }
    if (keyword == "property" && vertices) {
      Property property{name};
      if (!set_type(property, type) || header.find(name) != nullptr) {
        throw_not_ply(what, "an unusable property: " + line.substr(0, 80));
      }
      property.offset = header.record_bytes;
      header.record_bytes += property.size;
      header.properties.push_back(property);
    }
    if (number == 1000) throw_not_ply(what, "a header without end");
  }
  if (line != "end_header") throw_not_ply(what, "a truncated header");
  for (const char* axis : {"x", "y", "z"}) {
    if (header.num_points < 0 || header.find(axis) == nullptr) {
      throw_not_ply(what, "no vertices with x, y and z");
    }
  }
  return header;
}

template <typename T>
T load(const char* from) {
  T value;
  std::memcpy(&value, from, sizeof(T));
  return value;
}

float read_value(const Property& property, const char* record) {
  const char* from = record + property.offset;
  switch (property.kind) {
    case 'u':
      if (property.size == 1) return load<uint8_t>(from);
      if (property.size == 2) return load<uint16_t>(from);
      return static_cast<float>(load<uint32_t>(from));
    case 'i':
      if (property.size == 1) return load<int8_t>(from);
      if (property.size == 2) return load<int16_t>(from);
      return static_cast<float>(load<int32_t>(from));
    default:
      return property.size == 4 ? load<float>(from) : static_cast<float>(load<double>(from));
  }
}

}  // namespace

const std::vector<float>* PlyCloud::field(std::string_view name) const {
  for (const Field& field : fields) {
    if (field.name == name) return &field.values;
  }
  return nullptr;
}

PlyCloud read_ply(const std::filesystem::path& path) {
  const std::string what = path.string();
  std::ifstream file(path, std::ios::binary);
  if (!file || !std::filesystem::is_regular_file(path)) throw_not_ply(what, "no readable file");
  const Header header = read_header(file, what);
  const auto size = static_cast<uint64_t>(std::filesystem::file_size(path));
  const auto available = size - static_cast<uint64_t>(file.tellg());
  const auto points = static_cast<uint64_t>(header.num_points);
  if (points > available / header.record_bytes) {
    throw_error(ErrorCode::kInput, "{}: expected {} points of {} bytes, found {} bytes; truncated",
                what, points, header.record_bytes, available);
  }

  const Property* position[] = {header.find("x"), header.find("y"), header.find("z")};
  const Property* color[] = {header.find("red"), header.find("green"), header.find("blue")};
  const bool has_color = std::all_of(color, color + 3, [](const Property* channel) {
    return channel != nullptr && channel->kind == 'u' && channel->size == 1;
  });
  std::vector<const Property*> others;
  PlyCloud cloud;
  for (const Property& property : header.properties) {
    const bool known = std::find(position, position + 3, &property) != position + 3 ||
                       (has_color && std::find(color, color + 3, &property) != color + 3);
    if (known) continue;
    constexpr std::string_view kPrefix = "scalar_";
    const bool prefixed = property.name.starts_with(kPrefix);
    cloud.fields.push_back({property.name.substr(prefixed ? kPrefix.size() : 0), {}});
    cloud.fields.back().values.resize(points);
    others.push_back(&property);
  }
  cloud.positions.resize(points);
  cloud.rgb.resize(has_color ? 3 * points : 0);
  std::vector<char> record(header.record_bytes);
  for (size_t i = 0; i < points; ++i) {
    file.read(record.data(), static_cast<std::streamsize>(record.size()));
    if (!file) throw_not_ply(what, "a read error");
    for (size_t k = 0; k < 3; ++k) {
      cloud.positions[i][static_cast<Eigen::Index>(k)] = read_value(*position[k], record.data());
      if (has_color) cloud.rgb[3 * i + k] = static_cast<uint8_t>(record[color[k]->offset]);
    }
    for (size_t k = 0; k < others.size(); ++k) {
      cloud.fields[k].values[i] = read_value(*others[k], record.data());
    }
  }
  return cloud;
}

}  // namespace vggtcd
