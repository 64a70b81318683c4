// SPDX-License-Identifier: Apache-2.0
// Trajectories: choosing the reader.
#include "vggtcd/io/trajectory.h"

#include "vggtcd/core/error.h"
#include "vggtcd/core/tensor_view.h"
#include "vggtcd/io/colmap.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/npy.h"
#include "vggtcd/io/pose_matrix.h"
#include "vggtcd/io/tum.h"

namespace vggtcd {
namespace {

Trajectory read_npy_poses(const std::filesystem::path& path, PoseConvention convention) {
  const NpyDoubles array = read_npy_file(path);
  const std::vector<int64_t>& shape = array.shape;
  if (shape.size() != 3 || shape[0] < 1 || (shape[1] != 3 && shape[1] != 4) || shape[2] != 4) {
    throw_error(ErrorCode::kInput, "{}: expected poses of shape [N, 4, 4] or [N, 3, 4], found {}",
                path.string(), shape_string(shape));
  }
  Trajectory trajectory;
  const size_t stride = static_cast<size_t>(shape[1] * 4);
  for (size_t i = 0; i < static_cast<size_t>(shape[0]); ++i) {
    const Rigid3 pose =
        internal::pose_from_matrix(std::span(array.values).subspan(i * stride, stride),
                                   fmt::format("{}: pose {}", path.string(), i));
    trajectory.push_back({std::to_string(i),
                          convention == PoseConvention::kCameraFromWorld ? pose : pose.inverse()});
  }
  return trajectory;
}

}  // namespace

Trajectory read_trajectory(const std::filesystem::path& path, PoseConvention npy_convention) {
  if (!exists_at(path)) {
    throw_error(ErrorCode::kInput,
                "{}: expected poses (.npy), a COLMAP model or a TUM file, found {}", path.string(),
                what_stands_at(path));
  }
  if (path.extension() == ".npy") return read_npy_poses(path, npy_convention);
  if (is_folder(path)) return colmap_trajectory(read_colmap(path));
  if (path.filename() == "images.txt" || path.filename() == "images.bin") {
    return colmap_trajectory(read_colmap(path.parent_path().empty() ? "." : path.parent_path()));
  }
  return read_tum(path);
}

void write_npy_poses(const std::filesystem::path& path, std::span<const NamedPose> trajectory,
                     PoseConvention convention) {
  std::vector<double> values(trajectory.size() * 16, 0.0);
  for (size_t i = 0; i < trajectory.size(); ++i) {
    const Rigid3& camera_from_world = trajectory[i].camera_from_world;
    const Rigid3 pose = convention == PoseConvention::kCameraFromWorld
                            ? camera_from_world
                            : camera_from_world.inverse();
    Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(values.data() + 16 * i);
    matrix.topLeftCorner<3, 3>() = pose.rotation;
    matrix.topRightCorner<3, 1>() = pose.translation;
    matrix(3, 3) = 1;
  }
  const std::vector<int64_t> shape{static_cast<int64_t>(trajectory.size()), 4, 4};
  write_npy_file(path, shape, values);
}

}  // namespace vggtcd
