// SPDX-License-Identifier: Apache-2.0
// JSON files and options structs as JSON.
#include "vggtcd/io/json_file.h"

#include <cmath>
#include <limits>

#include "vggtcd/io/failure.h"
#include "vggtcd/io/input_file.h"
#include "vggtcd/io/output_file.h"

namespace vggtcd {
namespace {

// The parser's recursion is not bounded; a file of a million brackets must not end the stack.
bool too_deep(std::string_view text) {
  constexpr int kMaxDepth = 100;
  int depth = 0;
  bool in_string = false;
  for (size_t i = 0; i < text.size(); ++i) {
    if (in_string && text[i] == '\\') {
      ++i;
    } else if (text[i] == '"') {
      in_string = !in_string;
    } else if (!in_string && (text[i] == '[' || text[i] == '{')) {
      if (++depth > kMaxDepth) return true;
    } else if (!in_string && (text[i] == ']' || text[i] == '}')) {
      --depth;
    }
  }
  return false;
}

template <typename T>
bool integer_to(const Json& json, T& value) {
  if (!json.is_number_integer()) return false;
  if (json.is_number_unsigned()) {
    const auto number = json.get<uint64_t>();
    if (number > static_cast<uint64_t>(std::numeric_limits<T>::max())) return false;
    value = static_cast<T>(number);
    return true;
  }
  const auto number = json.get<int64_t>();
  if (std::is_unsigned_v<T> ? number < 0
                            : number < static_cast<int64_t>(std::numeric_limits<T>::min())) {
    return false;
  }
  value = static_cast<T>(number);
  return true;
}

}  // namespace

Json read_json_file(const std::filesystem::path& path) try {
  const std::string text = InputFile(path, "a readable JSON file").read_all();
  if (too_deep(text)) {
    throw_error(ErrorCode::kInput, "{}: expected JSON nested at most 100 deep", path.string());
  }
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& error) {
    throw_error(ErrorCode::kInput, "{}: expected JSON, found something else at byte {}",
                path.string(), error.byte);
  } catch (const Json::out_of_range&) {
    throw_error(ErrorCode::kInput, "{}: expected JSON, found a number that no double can hold",
                path.string());
  }
} catch (...) {
  rethrow_naming(path);
}

void write_json_file(const std::filesystem::path& path, const Json& json) {
  write_text_file(path, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

const Json& json_member(const Json& json, std::string_view key, std::string_view where) {
  const auto member = json.is_object() ? json.find(std::string(key)) : json.end();
  if (member == json.end()) {
    throw_error(ErrorCode::kInput, "{}: expected a JSON object with \"{}\", found none", where,
                key);
  }
  return *member;
}

namespace internal {

bool json_to(const Json& json, bool& value) {
  if (!json.is_boolean()) return false;
  value = json.get<bool>();
  return true;
}
bool json_to(const Json& json, int& value) { return integer_to(json, value); }
bool json_to(const Json& json, int64_t& value) { return integer_to(json, value); }
bool json_to(const Json& json, uint64_t& value) { return integer_to(json, value); }
bool json_to(const Json& json, double& value) {
  if (!json.is_number()) return false;
  value = json.get<double>();
  return true;
}
bool json_to(const Json& json, float& value) {
  double number = 0;
  if (!json_to(json, number)) return false;
  if (std::abs(number) > static_cast<double>(std::numeric_limits<float>::max())) return false;
  value = static_cast<float>(number);
  return true;
}
bool json_to(const Json& json, std::string& value) {
  if (!json.is_string()) return false;
  value = json.get<std::string>();
  return true;
}

void throw_wrong_option(std::string_view where, std::string_view name, const Json& found) {
  throw_error(ErrorCode::kInput, "{}: {}: expected a value of another type or name, found {}",
              where, name, found.dump(-1, ' ', true, Json::error_handler_t::replace).substr(0, 60));
}

void expect_known_keys(const Json& json, const Json& known, std::string_view where) {
  if (!json.is_object()) {
    throw_error(ErrorCode::kInput, "{}: expected an object of options", where);
  }
  for (const auto& [key, value] : json.items()) {
    if (!known.contains(key))
      throw_error(ErrorCode::kInput, "{}: unknown option {}", where, Json(key).dump());
  }
}

}  // namespace internal
}  // namespace vggtcd
