// SPDX-License-Identifier: Apache-2.0
// What the VGGT-CD paper prints for the WAT benchmark (its tables of outdoor and indoor scenes and
// of the fine stage). Theirs, on their data and hardware; shown beside ours and marked as such.
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace vggtcd {

struct PaperRow {
  std::string_view scene;   // "car", "living_room", ...
  std::string_view method;  // as registration_methods() names them
  double ate_m = 0, rte_m = 0;
  double seconds = -1;  // of registration; negative: not printed
};
std::span<const PaperRow> paper_rows();
std::optional<PaperRow> paper_row(std::string_view scene, std::string_view method);

// The eleven scenes of WAT in the paper's order: five outdoor, then six indoor.
std::span<const std::string_view> wat_scene_names();

// The table of the fine stage: ATE in millimetres with and without it. keyframes 0: all frames.
struct PaperFineRow {
  std::string_view scene;
  int keyframes;
  double coarse_mm, full_mm;
};
std::span<const PaperFineRow> paper_fine_rows();

}  // namespace vggtcd
