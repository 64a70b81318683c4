// SPDX-License-Identifier: Apache-2.0
// Reading PLY: the header decides the record, the file size must agree before memory is reserved.
#include <algorithm>
#include <array>
#include <cstring>
#include <sstream>

#include "vggtcd/core/error.h"
#include "vggtcd/core/number_text.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/input_file.h"
#include "vggtcd/io/ply.h"
#include "vggtcd/io/quote.h"

namespace vggtcd {
namespace {

constexpr size_t kBlockPoints = 1 << 15;

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

constexpr std::string_view kExpected = "a binary little-endian PLY point cloud";

[[noreturn]] void throw_not_ply(const std::string& what, std::string_view found) {
  throw_error(ErrorCode::kInput, "{}: expected {}, found {}", what, kExpected, found);
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
    if (keyword == "format" && type != "binary_little_endian")
      throw_not_ply(what, quote(type) + " data");
    if (keyword == "element") {
      after = after || vertices;
      vertices = type == "vertex";
      if (!vertices && !after)
        throw_not_ply(what, "an element " + quote(type) + " before the vertices");
      const auto count = number_in<int64_t>(name);
      if (vertices && (after || !count)) {
        throw_not_ply(what, "a broken header line: " + quote(line));
      }
      if (vertices) header.num_points = *count;
    }
    if (keyword == "property" && vertices) {
      Property property{name};
      if (!set_type(property, type) || header.find(name) != nullptr) {
        throw_not_ply(what, "an unusable property: " + quote(line));
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

double read_value(const Property& property, const char* record) {
  const char* from = record + property.offset;
  switch (property.kind) {
    case 'u':
      if (property.size == 1) return load<uint8_t>(from);
      if (property.size == 2) return load<uint16_t>(from);
      return load<uint32_t>(from);
    case 'i':
      if (property.size == 1) return load<int8_t>(from);
      if (property.size == 2) return load<int16_t>(from);
      return load<int32_t>(from);
    default:
      return property.size == 4 ? static_cast<double>(load<float>(from)) : load<double>(from);
  }
}

}  // namespace

const std::vector<float>* PlyCloud::field(std::string_view name) const {
  for (const Field& field : fields) {
    if (field.name == name) return &field.values;
  }
  return nullptr;
}

struct PlyReader::Layout {
  Header header;
  std::streamoff first_record = 0;
  std::array<const Property*, 3> position{}, color{};  // of the header; color null: none
  std::vector<std::string> fields;                     // every other property
  std::vector<const Property*> properties;             // of the fields
};

PlyReader::PlyReader(const std::filesystem::path& path) try : path_(path) {
  const std::string what = path.string();
  InputFile file(path, kExpected);
  auto layout = std::make_unique<Layout>();
  layout->header = read_header(file, what);
  layout->first_record = file.tellg();
  const Header& header = layout->header;
  const auto available = file.size() - static_cast<uint64_t>(layout->first_record);
  const auto points = static_cast<uint64_t>(header.num_points);
  if (points > available / header.record_bytes) {
    throw_error(ErrorCode::kInput, "{}: expected {} points of {} bytes, found {} bytes; truncated",
                what, points, header.record_bytes, available);
  }
  layout->position = {header.find("x"), header.find("y"), header.find("z")};
  layout->color = {header.find("red"), header.find("green"), header.find("blue")};
  const bool has_color = std::ranges::all_of(layout->color, [](const Property* channel) {
    return channel != nullptr && channel->kind == 'u' && channel->size == 1;
  });
  if (!has_color) layout->color = {};
  for (const Property& property : header.properties) {
    if (std::ranges::find(layout->position, &property) != layout->position.end() ||
        std::ranges::find(layout->color, &property) != layout->color.end()) {
      continue;
    }
    constexpr std::string_view kPrefix = "scalar_";
    const bool prefixed = property.name.starts_with(kPrefix);
    layout->fields.push_back(property.name.substr(prefixed ? kPrefix.size() : 0));
    layout->properties.push_back(&property);
  }
  layout_ = std::move(layout);
} catch (...) {
  rethrow_naming(path);
}

PlyReader::~PlyReader() = default;

size_t PlyReader::size() const { return static_cast<size_t>(layout_->header.num_points); }

const std::vector<std::string>& PlyReader::fields() const { return layout_->fields; }

void PlyReader::read(std::span<const std::string> fields,
                     const std::function<void(const PlyCloud& block)>& sink,
                     const Eigen::Vector3d& origin) const try {
  const Layout& layout = *layout_;
  const size_t record_bytes = layout.header.record_bytes;
  const bool has_color = layout.color[0] != nullptr;
  std::vector<const Property*> wanted;
  PlyCloud block;
  for (const std::string& name : fields) {
    const auto found = std::ranges::find(layout.fields, name);
    check(found != layout.fields.end(), "PlyReader: a field that is there");
    wanted.push_back(layout.properties[static_cast<size_t>(found - layout.fields.begin())]);
    block.fields.push_back({name, {}});
  }
  InputFile file(path_, kExpected);
  file.seekg(layout.first_record);
  std::vector<char> records;
  for (size_t first = 0; first < size(); first += kBlockPoints) {
    const size_t points = std::min(kBlockPoints, size() - first);
    records.resize(points * record_bytes);
    file.read(records.data(), static_cast<std::streamsize>(records.size()));
    if (!file) throw_not_ply(path_.string(), "a read error");
    block.positions.resize(points);
    block.rgb.resize(has_color ? 3 * points : 0);
    for (auto& field : block.fields) field.values.resize(points);
    for (size_t i = 0; i < points; ++i) {
      const char* record = &records[i * record_bytes];
      for (size_t k = 0; k < 3; ++k) {
        const auto axis = static_cast<Eigen::Index>(k);
        block.positions[i][axis] =
            static_cast<float>(read_value(*layout.position[k], record) - origin[axis]);
        if (has_color) block.rgb[3 * i + k] = static_cast<uint8_t>(record[layout.color[k]->offset]);
      }
      for (size_t k = 0; k < wanted.size(); ++k) {
        block.fields[k].values[i] = static_cast<float>(read_value(*wanted[k], record));
      }
    }
    sink(block);
  }
} catch (...) {
  rethrow_naming(path_);
}

PlyCloud read_ply(const std::filesystem::path& path) {
  const PlyReader reader(path);
  PlyCloud cloud;
  for (const std::string& name : reader.fields()) cloud.fields.push_back({name, {}});
  const auto append = [](auto& all, const auto& block) {
    all.insert(all.end(), block.begin(), block.end());
  };
  reader.read(reader.fields(), [&](const PlyCloud& block) {
    append(cloud.positions, block.positions);
    append(cloud.rgb, block.rgb);
    for (size_t k = 0; k < block.fields.size(); ++k) {
      append(cloud.fields[k].values, block.fields[k].values);
    }
  });
  return cloud;
}

}  // namespace vggtcd
