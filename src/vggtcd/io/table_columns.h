// SPDX-License-Identifier: Apache-2.0
// table_columns: which column of a table of camera positions holds what, by the words of its
// header, as spreadsheets, RealityScan, Metashape, ODM and survey programs write it.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vggtcd {

struct TableColumns {
  size_t name = 0, x = 1, y = 2, z = 3;
  size_t count = 4;
};

// What a header says. Either columns, or why its numbers cannot be taken for metres ("latitude"),
// or neither: words that name no x, y and z.
struct TableHeader {
  std::optional<TableColumns> columns;
  std::string refused;         // what was found instead of metres
  bool maybe_degrees = false;  // "X/Longitude": the line with the coordinate system decides
};
TableHeader read_table_header(const std::vector<std::string>& words);

// Whether a text describes a coordinate system (EPSG:32633, PROJCS[...], +proj=..., WGS84 UTM 32N).
bool names_coordinate_system(std::string_view text);
// What speaks against metres in such a text: "degrees", "feet", or nothing.
std::string unit_against_metres(std::string_view text);

std::string lower_case(std::string_view text);  // of ASCII

}  // namespace vggtcd
