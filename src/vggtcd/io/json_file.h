// SPDX-License-Identifier: Apache-2.0
// JSON files and options structs as JSON. Keys keep their order; doubles read back exactly.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <type_traits>

#include "vggtcd/core/error.h"
#include "vggtcd/core/options.h"

namespace vggtcd {

using Json = nlohmann::ordered_json;

// Throws Error{kInput} naming the file and, for broken JSON, the place.
Json read_json_file(const std::filesystem::path& path);

// Indented, with a final newline; text that is not UTF-8 is replaced by U+FFFD; aside and renamed.
// Throws Error{kOutput}.
void write_json_file(const std::filesystem::path& path, const Json& json);

// The member `key`; throws Error{kInput} naming `where` if json is no object or has none.
const Json& json_member(const Json& json, std::string_view key, std::string_view where);

// An options struct (core/options.h) as an object with one member per field; enums by name.
template <typename Options>
Json options_to_json(const Options& options) {
  Json json = Json::object();
  for_each_field(options, [&](std::string_view name, const auto& value, std::string_view) {
    using T = std::remove_cvref_t<decltype(value)>;
    Json& member = json[std::string(name)];
    if constexpr (std::is_enum_v<T>) {
      member = std::string(enum_to_string(value));
    } else if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) {
      member = value;
    } else {
      member = options_to_json(value);
    }
  });
  return json;
}

namespace internal {
// Sets value from json if that is a T (numbers may not lose anything); false if it is not.
bool json_to(const Json& json, bool& value);
bool json_to(const Json& json, int& value);
bool json_to(const Json& json, int64_t& value);
bool json_to(const Json& json, uint64_t& value);
bool json_to(const Json& json, float& value);
bool json_to(const Json& json, double& value);
bool json_to(const Json& json, std::string& value);
[[noreturn]] void throw_wrong_option(std::string_view where, std::string_view name,
                                     const Json& found);
void expect_known_keys(const Json& json, const Json& known, std::string_view where);
}  // namespace internal

// Sets the fields that json has, leaves the others. Throws Error{kInput} naming `where` and the
// field for unknown members and wrong types; ranges are validate()'s business.
template <typename Options>
void options_from_json(const Json& json, Options& options, std::string_view where) {
  internal::expect_known_keys(json, options_to_json(options), where);
  for_each_field(options, [&](std::string_view name, auto& value, std::string_view) {
    using T = std::remove_cvref_t<decltype(value)>;
    const auto member = json.find(std::string(name));
    if (member == json.end()) return;
    if constexpr (std::is_enum_v<T>) {
      for (const auto& entry : enum_names(T{})) {
        if (*member == std::string(entry.name)) {
          value = entry.value;
          return;
        }
      }
      internal::throw_wrong_option(where, name, *member);
    } else if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) {
      if (!internal::json_to(*member, value)) internal::throw_wrong_option(where, name, *member);
    } else {
      options_from_json(*member, value, fmt::format("{}: {}", where, name));
    }
  });
}

}  // namespace vggtcd
