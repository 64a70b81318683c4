// SPDX-License-Identifier: Apache-2.0
// The convention for options: one plain struct per algorithm whose fields are listed once. That
// list feeds the command line, the JSON in every report and Python, so the three cannot disagree.
//
//   struct FineOptions {
//     double static_factor = 3.0;
//     static constexpr auto fields = [](auto&& self, auto&& field) {
//       field("static_factor", self.static_factor, "static set: d < static_factor * median(d); >
//       0");
//     };
//     void validate() const;  // throws Error{kUsage} naming field, value and bound
//   };
//
// A field may be bool, int, int64_t, uint64_t, float, double, std::string, a nested options struct,
// or an enum with `std::span<const EnumName<E>> enum_names(E)` found by argument-dependent lookup.
#pragma once

#include <span>
#include <string_view>
#include <type_traits>

#include "vggtcd/core/error.h"

namespace vggtcd {

template <typename E>
struct EnumName {
  E value;
  std::string_view name;
};

template <typename E>
requires std::is_enum_v<E> std::string_view enum_to_string(E value) {
  for (const auto& entry : enum_names(E{})) {
    if (entry.value == value) return entry.name;
  }
  check(false, "enum_to_string: value without a name");
  return {};
}

// Calls visit(name, value, help) for every field; options may be const or not.
template <typename Options, typename Visitor>
void for_each_field(Options& options, Visitor&& visit) {
  std::remove_const_t<Options>::fields(options, visit);
}

// For validate(): throws Error{kUsage} "name: expected EXPECTED, found VALUE".
template <typename T>
void check_field(bool valid, std::string_view name, const T& value, std::string_view expected) {
  if (!valid) throw_error(ErrorCode::kUsage, "{}: expected {}, found {}", name, expected, value);
}

}  // namespace vggtcd
