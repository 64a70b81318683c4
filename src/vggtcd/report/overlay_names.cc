// SPDX-License-Identifier: Apache-2.0
// Names of the overlays of an epoch: as short as they may be without meeting each other.
#include "vggtcd/report/overlay_names.h"

#include <filesystem>
#include <set>

#include "vggtcd/io/quote.h"

namespace vggtcd {

std::vector<std::string> overlay_names(std::span<const std::string> photo_names) {
  std::vector<std::string> names, stems;
  for (const std::string& name : photo_names) {
    names.push_back(single_line(name));
    stems.push_back(std::filesystem::path(names.back()).stem().string());
  }
  const bool by_stem = std::set(stems.begin(), stems.end()).size() == stems.size();
  std::vector<std::string>& chosen = by_stem ? stems : names;
  for (std::string& name : chosen) name += ".png";
  return chosen;
}

}  // namespace vggtcd
