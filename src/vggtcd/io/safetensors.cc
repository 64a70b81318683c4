// SPDX-License-Identifier: Apache-2.0
// safetensors: the header is believed in nothing that can be checked.
#include "vggtcd/io/safetensors.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <nlohmann/json.hpp>
#include <numeric>
#include <unordered_set>
#include <utility>

#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/io/output_file.h"
#include "vggtcd/io/quote.h"

namespace vggtcd {
namespace {

using Json = nlohmann::json;

constexpr uint64_t kMaxHeaderBytes = 100'000'000;  // the format's own limit
constexpr size_t kMaxDepth = 3;                    // {tensor: {shape: [numbers]}}
constexpr size_t kMaxRank = 16;

constexpr std::array<std::pair<std::string_view, DType>, 10> kDTypes = {{{"F64", DType::kF64},
                                                                         {"F32", DType::kF32},
                                                                         {"F16", DType::kF16},
                                                                         {"BF16", DType::kBF16},
                                                                         {"I64", DType::kI64},
                                                                         {"I32", DType::kI32},
                                                                         {"I16", DType::kI16},
                                                                         {"I8", DType::kI8},
                                                                         {"U8", DType::kU8},
                                                                         {"BOOL", DType::kBool}}};

std::string_view safetensors_dtype(DType dtype) {
  return std::ranges::find(kDTypes, dtype, [](const auto& entry) { return entry.second; })->first;
}

// What the parser does not check: bounded depth, no name twice. It goes over the text before
// anything is built; a callback of the parser would look through all tensors after each of them.
class StructureCheck : public nlohmann::json_sax<Json> {
 public:
  std::string wrong;  // empty: sound JSON of the depth of a header

  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_object(size_t) override { return enter(); }
  bool start_array(size_t) override { return enter(); }
  bool end_object() override { return leave(); }
  bool end_array() override { return leave(); }
  bool key(string_t& name) override {
    return keys_.back().insert(name).second || found(fmt::format("names {} twice", quote(name)));
  }
  bool parse_error(size_t byte, const std::string&, const Json::exception& error) override {
    const bool range = dynamic_cast<const Json::out_of_range*>(&error) != nullptr;
    return found(range ? "has a number out of range"
                       : fmt::format("is not valid JSON at byte {}", byte));
  }

 private:
  bool found(std::string what) {
    wrong = std::move(what);
    return false;  // the parser stops
  }
  bool enter() {
    keys_.emplace_back();
    return keys_.size() <= kMaxDepth || found("is nested too deeply");
  }
  bool leave() {
    keys_.pop_back();
    return true;
  }
  std::vector<std::unordered_set<std::string>> keys_;  // of the objects that are open
};

// Throws "FILE: ...": everything that is wrong is wrong with the file.
class Reader {
 public:
  Reader(std::span<const std::byte> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  WeightFile read() {
    const Json header = parse_header();
    WeightFile file;
    file.format = WeightFormat::kSafetensors;
    for (const auto& [key, value] : header.items()) {
      if (key == "__metadata__") {
        file.metadata = metadata(value);
      } else {
        file.tensors.push_back(tensor(key, value));
      }
    }
    std::ranges::sort(file.tensors, {}, [](const TensorView& tensor) {
      return std::pair(tensor.data.data(), tensor.data.size());
    });
    check_cover(file.tensors);
    return file;
  }

 private:
  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
    throw_error(ErrorCode::kWeights, "{}: {}", name_,
                fmt::format(format, std::forward<Args>(args)...));
  }

  Json parse_header() {
    if (bytes_.size() < 8) {
      fail("expected safetensors, found only {} bytes; download the file again", bytes_.size());
    }
    uint64_t length = 0;
    std::memcpy(&length, bytes_.data(), 8);
    if (length > kMaxHeaderBytes) {
      fail("expected a safetensors header of at most {} bytes, found a length of {}; not weights",
           kMaxHeaderBytes, length);
    }
    if (length > bytes_.size() - 8) {
      fail("safetensors header of {} bytes expected, the file ends after {}; download it again",
           length, bytes_.size() - 8);
    }
    const std::string_view text(reinterpret_cast<const char*>(bytes_.data()) + 8, length);
    data_ = bytes_.subspan(8 + length);
    if (!text.starts_with('{')) fail("safetensors header does not start with a brace; not weights");
    StructureCheck structure;
    Json::sax_parse(text, &structure);
    if (!structure.wrong.empty()) fail("safetensors header {}", structure.wrong);
    return Json::parse(text);
  }

  std::map<std::string, std::string> metadata(const Json& value) const {
    std::map<std::string, std::string> result;
    if (!value.is_object()) fail("safetensors __metadata__ is not an object");
    for (const auto& [key, text] : value.items()) {
      if (!text.is_string()) fail("safetensors __metadata__ {} is not a string", quote(key));
      result[key] = text.get<std::string>();
    }
    return result;
  }

  TensorView tensor(const std::string& key, const Json& value) const {
    const auto member = [&](const char* field) -> const Json& {
      if (!value.is_object() || !value.contains(field)) {
        fail("tensor {} has no {}", quote(key), field);
      }
      return value[field];
    };
    TensorView view;
    view.name = key;
    view.dtype = dtype(key, member("dtype"));
    uint64_t size = dtype_size(view.dtype);
    for (const int64_t length : unsigned_numbers(key, "shape", member("shape"), kMaxRank)) {
      view.shape.push_back(length);
      if (__builtin_mul_overflow(size, static_cast<uint64_t>(length), &size)) {
        fail("tensor {} has the absurd shape {}", quote(key), shape_string(view.shape));
      }
    }
    const std::vector<int64_t> range =
        unsigned_numbers(key, "data_offsets", member("data_offsets"), 2);
    if (range.size() != 2 || range[0] > range[1]) {
      fail("tensor {}: data_offsets must be [begin, end]", quote(key));
    }
    const uint64_t begin = static_cast<uint64_t>(range[0]), end = static_cast<uint64_t>(range[1]);
    if (end > data_.size()) {
      fail("tensor {} ends at byte {} of the data, the file has {}; download it again", quote(key),
           end, data_.size());
    }
    if (end - begin != size) {
      fail("tensor {}: {} {} needs {} bytes, data_offsets give {}", quote(key),
           dtype_name(view.dtype), shape_string(view.shape), size, end - begin);
    }
    view.data = data_.subspan(begin, size);
    if (reinterpret_cast<uintptr_t>(view.data.data()) % dtype_size(view.dtype) != 0) {
      fail(
          "tensor {} is not aligned to its {}-byte elements; save the file again with safetensors "
          "0.3 or later",
          quote(key), dtype_size(view.dtype));
    }
    return view;
  }

  DType dtype(const std::string& key, const Json& value) const {
    if (!value.is_string()) fail("tensor {}: dtype is not a string", quote(key));
    const std::string text = value.get<std::string>();
    const auto* entry = std::ranges::find(kDTypes, text, [](const auto& e) { return e.first; });
    if (entry == kDTypes.end()) {
      fail("tensor {}: expected F32, F16, BF16 or another plain type, found {}", quote(key),
           quote(text));
    }
    return entry->second;
  }

  std::vector<int64_t> unsigned_numbers(const std::string& key, const char* field,
                                        const Json& value, size_t max_count) const {
    std::vector<int64_t> result;
    const bool sound = value.is_array() && value.size() <= max_count;
    for (size_t i = 0; sound && i < value.size(); ++i) {
      const bool fits = value[i].is_number_unsigned() &&
                        value[i].get<uint64_t>() <= uint64_t{std::numeric_limits<int64_t>::max()};
      if (!fits) break;
      result.push_back(value[i].get<int64_t>());
    }
    if (!sound || result.size() != value.size()) {
      fail("tensor {}: {} is not a list of at most {} whole numbers", quote(key), field, max_count);
    }
    return result;
  }

  // The tensors, in order of address, must cover the data without overlap and without gap.
  void check_cover(const std::vector<TensorView>& tensors) const {
    const std::byte* covered = data_.data();
    for (const TensorView& tensor : tensors) {
      const std::byte* begin = tensor.data.data();
      if (begin < covered) fail("tensor {} overlaps the one before it", quote(tensor.name));
      if (begin > covered) {
        fail("{} bytes before tensor {} belong to no tensor", begin - covered, quote(tensor.name));
      }
      covered += tensor.data.size();
    }
    const auto rest = data_.data() + data_.size() - covered;
    if (rest > 0) fail("{} bytes after the last tensor belong to no tensor", rest);
  }

  std::span<const std::byte> bytes_;
  std::span<const std::byte> data_;
  const std::string& name_;
};

// As the library that writes the header judges it.
bool is_utf8(const std::string& text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::ignore) ==
         Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

uint64_t byte_size(const TensorInfo& tensor) {
  uint64_t size = dtype_size(tensor.dtype);
  for (const int64_t length : tensor.shape) size *= static_cast<uint64_t>(length);
  return size;
}

// Padded with spaces so that the data starts at a multiple of 64 bytes of the file.
std::string header_text(std::span<const TensorInfo> tensors, const std::vector<size_t>& order,
                        const std::map<std::string, std::string>& metadata) {
  nlohmann::ordered_json header = nlohmann::ordered_json::object();
  if (!metadata.empty()) header["__metadata__"] = metadata;
  auto& entries = header.get_ref<nlohmann::ordered_json::object_t&>();
  uint64_t offset = 0;
  for (const size_t i : order) {
    const uint64_t end = offset + byte_size(tensors[i]);
    // At the end, without a search among the others for the name.
    entries.emplace_back(tensors[i].name,
                         nlohmann::ordered_json{{"dtype", safetensors_dtype(tensors[i].dtype)},
                                                {"shape", tensors[i].shape},
                                                {"data_offsets", {offset, end}}});
    offset = end;
  }
  std::string text = header.dump();
  constexpr size_t kAlignment = 64;
  text.append((kAlignment - (text.size() + 8) % kAlignment) % kAlignment, ' ');
  return text;
}

}  // namespace

WeightFile parse_safetensors(std::span<const std::byte> bytes, const std::string& name) {
  return Reader(bytes, name).read();
}

void write_safetensors(const std::filesystem::path& path, std::span<const TensorInfo> tensors,
                       const std::map<std::string, std::string>& metadata,
                       const std::function<void(size_t, std::span<std::byte>)>& fill) {
  for (const TensorInfo& tensor : tensors) {
    if (is_utf8(tensor.name)) continue;
    throw_error(
        ErrorCode::kWeights,
        "{}: tensor {}: expected a name in UTF-8, for safetensors holds no other; rename it "
        "in the checkpoint",
        path.string(), quote(tensor.name));
  }
  std::vector<size_t> order(tensors.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, std::greater{},
                           [&](size_t i) { return dtype_size(tensors[i].dtype); });
  const std::string header = header_text(tensors, order, metadata);
  const uint64_t length = header.size();
  OutputFile file(path);
  file.write(std::as_bytes(std::span(&length, 1)));
  file.write(header);
  std::vector<std::byte> data;
  for (const size_t i : order) {
    throw_if_interrupted();
    data.resize(byte_size(tensors[i]));
    fill(i, data);
    file.write(data);
  }
  throw_if_interrupted();  // the last tensor may come from a file that was cut off meanwhile
  file.commit();
}

}  // namespace vggtcd
