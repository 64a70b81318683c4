// SPDX-License-Identifier: Apache-2.0
// Options of the change detection by free-space votes.
#include "vggtcd/change/free_space_options.h"

namespace vggtcd {

void FreeSpaceOptions::validate() const {
  check_field(max_views >= 1, "max_views", max_views, "at least 1");
  check_field(min_confidence_rank >= 0 && min_confidence_rank < 1, "min_confidence_rank",
              min_confidence_rank, "a number in [0, 1)");
  check_field(tolerance_sigmas > 0, "tolerance_sigmas", tolerance_sigmas, "a positive number");
  check_field(max_pair_sigma > 0, "max_pair_sigma", max_pair_sigma, "a positive number");
  check_field(smooth_radius >= 0, "smooth_radius", smooth_radius, "at least 0");
  check_field(min_through_share > 0 && min_through_share <= 1, "min_through_share",
              min_through_share, "a number in (0, 1]");
  check_field(min_votes > 0, "min_votes", min_votes, "a positive number");
  check_field(fusion_grid >= 1, "fusion_grid", fusion_grid, "at least 1");
  check_field(median_radius_px >= 0, "median_radius_px", median_radius_px, "at least 0");
}

}  // namespace vggtcd
