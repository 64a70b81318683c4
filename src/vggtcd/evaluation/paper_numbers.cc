// SPDX-License-Identifier: Apache-2.0
// The paper's numbers, as data.
#include "vggtcd/evaluation/paper_numbers.h"

namespace vggtcd {
namespace {

constexpr PaperRow kRows[] = {
    {"car", "vggt_only", 3.373, 0.687, -1},
    {"community", "vggt_only", 1.703, 0.449, -1},
    {"grill", "vggt_only", 0.716, 0.151, -1},
    {"spa", "vggt_only", 1.661, 0.281, -1},
    {"street", "vggt_only", 1.564, 0.263, -1},
    {"car", "fgr", 0.405, 0.140, 586},
    {"community", "fgr", 0.323, 0.182, 837},
    {"grill", "fgr", 0.647, 0.151, 166},
    {"spa", "fgr", 0.616, 0.306, 48},
    {"street", "fgr", 1.083, 0.388, 94},
    {"car", "ransac_icp", 0.397, 0.141, 38},
    {"community", "ransac_icp", 0.330, 0.149, 95},
    {"grill", "ransac_icp", 0.445, 0.151, 41},
    {"spa", "ransac_icp", 0.566, 0.301, 17},
    {"street", "ransac_icp", 1.044, 0.402, 34},
    {"car", "scale_icp", 0.631, 0.143, 50},
    {"community", "scale_icp", 0.079, 0.068, 95},
    {"grill", "scale_icp", 0.509, 0.151, 39},
    {"spa", "scale_icp", 0.566, 0.302, 10},
    {"street", "scale_icp", 0.972, 0.424, 12},
    {"car", "geotransformer", 0.381, 0.140, 76},
    {"community", "geotransformer", 0.150, 0.055, 115},
    {"grill", "geotransformer", 0.461, 0.151, 77},
    {"spa", "geotransformer", 0.610, 0.305, 26},
    {"street", "geotransformer", 1.030, 0.444, 58},
    {"car", "paper", 0.040, 0.141, 3.2},
    {"community", "paper", 0.018, 0.022, 5.3},
    {"grill", "paper", 0.037, 0.156, 4.4},
    {"spa", "paper", 0.553, 0.294, 5.3},
    {"street", "paper", 0.834, 0.264, 5.3},
    {"breville", "vggt_only", 2.547, 1.010, -1},
    {"dyson", "vggt_only", 0.947, 0.283, -1},
    {"kitchen", "vggt_only", 0.855, 0.076, -1},
    {"living_room", "vggt_only", 0.743, 0.281, -1},
    {"mac", "vggt_only", 0.349, 0.047, -1},
    {"ninja", "vggt_only", 0.634, 0.139, -1},
    {"breville", "fgr", 1.626, 0.417, 705},
    {"dyson", "fgr", 2.205, 0.709, 805},
    {"kitchen", "fgr", 0.065, 0.049, 10},
    {"living_room", "fgr", 0.839, 0.282, 199},
    {"mac", "fgr", 0.112, 0.046, 172},
    {"ninja", "fgr", 2.556, 0.665, 4608},
    {"breville", "ransac_icp", 1.419, 0.200, 107},
    {"dyson", "ransac_icp", 1.009, 0.283, 98},
    {"kitchen", "ransac_icp", 0.075, 0.053, 11},
    {"living_room", "ransac_icp", 0.674, 0.276, 40},
    {"mac", "ransac_icp", 0.113, 0.046, 28},
    {"ninja", "ransac_icp", 1.269, 0.138, 204},
    {"breville", "scale_icp", 0.475, 0.208, 47},
    {"dyson", "scale_icp", 0.596, 0.292, 51},
    {"kitchen", "scale_icp", 0.085, 0.047, 6},
    {"living_room", "scale_icp", 0.523, 0.276, 17},
    {"mac", "scale_icp", 0.234, 0.054, 17},
    {"ninja", "scale_icp", 0.076, 0.163, 19},
    {"breville", "geotransformer", 1.328, 0.200, 1038},
    {"dyson", "geotransformer", 1.515, 0.290, 509},
    {"kitchen", "geotransformer", 0.068, 0.051, 16},
    {"living_room", "geotransformer", 0.824, 0.281, 155},
    {"mac", "geotransformer", 0.108, 0.046, 36},
    {"ninja", "geotransformer", 1.060, 0.140, 346},
    {"breville", "paper", 0.041, 0.217, 3.6},
    {"dyson", "paper", 0.110, 0.328, 3.9},
    {"kitchen", "paper", 0.055, 0.045, 3.1},
    {"living_room", "paper", 0.441, 0.285, 5.6},
    {"mac", "paper", 0.057, 0.049, 6.0},
    {"ninja", "paper", 0.111, 0.166, 3.3},
};

constexpr PaperFineRow kFineRows[] = {
    {"car", 2, 89.4, 80.8},    {"mac", 2, 63.0, 62.1},
    {"grill", 2, 40.2, 37.0},  {"living_room", 2, 533.6, 520.3},
    {"car", 3, 45.9, 43.1},    {"mac", 3, 59.2, 59.0},
    {"grill", 3, 32.3, 31.2},  {"living_room", 3, 594.2, 579.9},
    {"car", 5, 39.3, 39.0},    {"mac", 5, 57.9, 57.7},
    {"grill", 5, 39.1, 38.6},  {"living_room", 5, 454.7, 452.4},
    {"car", 7, 39.3, 38.8},    {"mac", 7, 63.6, 62.7},
    {"grill", 7, 38.2, 37.8},  {"living_room", 7, 486.4, 481.4},
    {"car", 9, 36.2, 36.1},    {"mac", 9, 59.7, 59.4},
    {"grill", 9, 38.6, 38.4},  {"living_room", 9, 468.4, 463.4},
    {"car", 15, 38.3, 38.2},   {"mac", 15, 63.7, 63.0},
    {"grill", 15, 36.0, 35.9}, {"living_room", 15, 448.4, 448.4},
    {"car", 20, 35.4, 35.4},   {"mac", 20, 62.6, 61.9},
    {"grill", 20, 32.9, 32.9}, {"living_room", 20, 457.0, 457.0},
    {"car", 50, 36.4, 36.4},   {"mac", 50, 62.6, 61.8},
    {"grill", 50, 35.8, 35.8}, {"living_room", 50, 475.8, 471.0},
    {"car", 0, 35.7, 35.7},    {"mac", 0, 62.1, 61.4},
    {"grill", 0, 34.1, 34.1},  {"living_room", 0, 475.8, 471.0},
};

constexpr std::string_view kWatScenes[] = {"car",         "community", "grill", "spa",
                                           "street",      "breville",  "dyson", "kitchen",
                                           "living_room", "mac",       "ninja"};

}  // namespace

std::span<const PaperRow> paper_rows() { return kRows; }

std::optional<PaperRow> paper_row(std::string_view scene, std::string_view method) {
  for (const PaperRow& row : kRows) {
    if (row.scene == scene && row.method == method) return row;
  }
  return std::nullopt;
}

std::span<const std::string_view> wat_scene_names() { return kWatScenes; }

std::span<const PaperFineRow> paper_fine_rows() { return kFineRows; }

}  // namespace vggtcd
