// SPDX-License-Identifier: Apache-2.0
// Points of one frame in another.
#include "vggtcd/registration/map_points.h"

#include "vggtcd/core/parallel.h"

namespace vggtcd {

std::vector<Eigen::Vector3f> map_points(const Sim3& b_from_a,
                                        const std::vector<Eigen::Vector3f>& points_in_a,
                                        int stride) {
  const auto step = static_cast<size_t>(stride);
  std::vector<Eigen::Vector3f> points_in_b((points_in_a.size() + step - 1) / step);
  constexpr int64_t kGrain = 1 << 14;
  parallel_for(static_cast<int64_t>(points_in_b.size()), kGrain, [&](int64_t begin, int64_t end) {
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      points_in_b[i] = (b_from_a * points_in_a[i * step].cast<double>()).cast<float>();
    }
  });
  return points_in_b;
}

}  // namespace vggtcd
