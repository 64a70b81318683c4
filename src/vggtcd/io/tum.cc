// SPDX-License-Identifier: Apache-2.0
// TUM trajectories.
#include "vggtcd/io/tum.h"

#include <Eigen/Geometry>

#include "vggtcd/core/error.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/input_file.h"
#include "vggtcd/io/output_file.h"
#include "vggtcd/io/text_file.h"
#include "vggtcd/io/text_line.h"

namespace vggtcd {

void write_tum(const std::filesystem::path& path, const Trajectory& trajectory,
               std::string_view comment) {
  std::string text = comment.empty() ? "" : fmt::format("# {}\n", comment);
  text += "# timestamp tx ty tz qx qy qz qw\n";
  for (size_t i = 0; i < trajectory.size(); ++i) {
    const Rigid3 world_from_camera = trajectory[i].camera_from_world.inverse();
    const Eigen::Vector3d& t = world_from_camera.translation;
    Eigen::Quaterniond q(world_from_camera.rotation);
    if (q.w() < 0) q.coeffs() *= -1;  // of the two equal ones always the same
    text += fmt::format("{} {} {} {} {} {} {} {}\n", i, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(),
                        q.w());
  }
  write_text_file(path, text);
}

Trajectory read_tum(const std::filesystem::path& path) try {
  Trajectory trajectory;
  for_each_text_line(path, "a trajectory file", [&](int number, std::string_view line) {
    const TextLine words(path, number, line);
    if (words.is_blank_or_comment()) return;
    words.expect_count(8, "timestamp tx ty tz qx qy qz qw");
    words.number(0);
    const Eigen::Quaterniond q = words.unit_quaternion({4, 5, 6, 7});
    const Eigen::Vector3d t(words.coordinate(1), words.coordinate(2), words.coordinate(3));
    trajectory.push_back({std::string(words.word(0)), Rigid3{q.toRotationMatrix(), t}.inverse()});
  });
  if (trajectory.empty()) {
    throw_error(ErrorCode::kInput, "{}: expected camera poses, found none", path.string());
  }
  return trajectory;
} catch (...) {
  rethrow_naming(path);
}

}  // namespace vggtcd
