// SPDX-License-Identifier: Apache-2.0
// table_columns: the words of headers.
#include "vggtcd/io/table_columns.h"

#include <algorithm>
#include <array>
#include <span>

namespace vggtcd {
namespace {

using Words = std::span<const std::string_view>;

constexpr std::array<std::string_view, 18> kNameWords = {
    "name", "photo", "image", "filename", "file_name", "image_name", "imagename", "file", "label",
    "foto", "bild",  "datei", "path",     "camera",    "timestamp",  "time",      "id",   "number"};
constexpr std::array<std::string_view, 9> kXWords = {
    "x", "tx", "pos_x", "position_x", "easting", "east", "ost", "rechtswert", "ostwert"};
constexpr std::array<std::string_view, 9> kYWords = {
    "y", "ty", "pos_y", "position_y", "northing", "north", "nord", "hochwert", "nordwert"};
constexpr std::array<std::string_view, 12> kZWords = {
    "z",         "tz",   "pos_z",  "position_z", "alt",  "altitude",
    "elevation", "elev", "height", "hoehe",      "höhe", "up"};
constexpr std::array<std::string_view, 13> kDegreeWords = {
    "lat",   "latitude",    "lon",        "long",        "lng",         "longitude",   "breite",
    "länge", "breitengrad", "längengrad", "laengengrad", "gpslatitude", "gpslongitude"};
constexpr std::array<std::string_view, 6> kMetres = {"m",     "meter",  "meters",
                                                     "metre", "metres", "mtr"};
constexpr std::array<std::string_view, 8> kOtherUnits = {"ft", "feet", "mm",  "cm",
                                                         "km", "in",   "deg", "yd"};

bool is_one_of(Words words, std::string_view word) {
  return std::ranges::find(words, word) != words.end();
}

// A word of a header without marks, and the unit that it says: "X [ft]" -> "x", "ft"; "z_m" -> "z".
struct Title {
  std::string word, unit;
  bool maybe_degrees = false;
};

void trim(std::string& text, std::string_view marks) {
  text.erase(0, std::min(text.find_first_not_of(marks), text.size()));
  text.erase(text.find_last_not_of(marks) + 1);
}

Title title_of(std::string_view text) {
  Title title{lower_case(text), "", false};
  trim(title.word, " \t#\"'");
  const size_t bracket = title.word.find_first_of("([");
  if (bracket != std::string::npos) {
    title.unit = title.word.substr(bracket + 1);
    title.unit.erase(std::min(title.unit.find_first_of(")]"), title.unit.size()));
    title.word.erase(bracket);
  }
  if (const size_t slash = title.word.find('/'); slash != std::string::npos) {
    const std::string other = title.word.substr(slash + 1);  // "x/longitude" of Metashape
    title.maybe_degrees = is_one_of(kDegreeWords, other);
    title.word.erase(slash);
  }
  if (const size_t end = title.word.rfind('_'); end != std::string::npos && end > 0) {
    const std::string unit = title.word.substr(end + 1);
    if (is_one_of(kMetres, unit) || is_one_of(kOtherUnits, unit)) {
      title.unit = unit;
      title.word.erase(end);
    }
  }
  trim(title.word, " \t_");
  return title;
}

std::optional<size_t> find_title(const std::vector<Title>& titles, Words words) {
  for (size_t i = 0; i < titles.size(); ++i) {
    if (is_one_of(words, titles[i].word)) return i;
  }
  return {};
}

// In the order of the list: a table may have "id" before "name".
std::optional<size_t> find_name(const std::vector<Title>& titles) {
  for (const std::string_view word : kNameWords) {
    if (const auto found = find_title(titles, std::span(&word, 1))) return found;
  }
  return {};
}

bool holds(const std::string& text, std::initializer_list<std::string_view> parts) {
  return std::ranges::any_of(
      parts, [&](std::string_view part) { return text.find(part) != std::string::npos; });
}

}  // namespace

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return lower;
}

TableHeader read_table_header(const std::vector<std::string>& words) {
  std::vector<Title> titles;
  for (const std::string& word : words) titles.push_back(title_of(word));
  TableHeader header;
  const auto x = find_title(titles, kXWords), y = find_title(titles, kYWords),
             z = find_title(titles, kZWords);
  if (!x || !y || !z) {
    const auto degrees = find_title(titles, kDegreeWords);
    if (degrees) header.refused = words[*degrees];
    return header;
  }
  for (const size_t i : {*x, *y, *z}) {
    if (!titles[i].unit.empty() && !is_one_of(kMetres, titles[i].unit)) {
      header.refused = words[i];
      return header;
    }
    header.maybe_degrees = header.maybe_degrees || titles[i].maybe_degrees;
  }
  auto name = find_name(titles);
  if (!name && *x != 0 && *y != 0 && *z != 0) name = 0;
  if (name) header.columns = TableColumns{*name, *x, *y, *z, words.size()};
  return header;
}

bool names_coordinate_system(std::string_view text) {
  std::string lower = lower_case(text);
  trim(lower, " \t#\"'");
  for (const std::string_view start :
       {"epsg:", "+proj", "+init", "projcs", "projcrs", "geogcs", "geogcrs", "compd_cs",
        "compoundcrs", "local_cs", "wgs84", "wgs 84", "utm", "etrs", "coordinatesystem", "crs"}) {
    if (lower.starts_with(start)) return true;
  }
  return false;
}

std::string unit_against_metres(std::string_view text) {
  const std::string lower = lower_case(text);
  if (holds(lower, {"foot", "feet", "ftus", "us-ft", "(ft)", "[ft]"})) return "feet";
  const bool projected = holds(lower, {"projcs", "projcrs", "utm", "local_cs"});
  if (!projected && holds(lower, {"geogcs", "geogcrs", "epsg:4326", "epsg::4326", "longlat",
                                  "latlong", "degree", "latitude", "wgs 84", "wgs84"})) {
    return "degrees";
  }
  return "";
}

}  // namespace vggtcd
