// SPDX-License-Identifier: Apache-2.0
// Trajectories: choosing the reader.
#include "vggtcd/io/trajectory.h"

#include "vggtcd/core/error.h"
#include "vggtcd/core/number_text.h"
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

bool are_numbers_in_order(const Trajectory& trajectory) {
  for (size_t i = 0; i < trajectory.size(); ++i) {
    if (signed_number_in(trajectory[i].name) != static_cast<double>(i)) return false;
  }
  return true;
}

}  // namespace

TrajectoryFile read_trajectory_file(const std::filesystem::path& path,
                                    PoseConvention npy_convention) {
  if (!exists_at(path)) {
    throw_error(ErrorCode::kInput,
                "{}: expected poses (.npy), a COLMAP model or a TUM file, found {}", path.string(),
                what_stands_at(path));
  }
  const bool is_directory = is_folder(path);
  if (path.extension() == ".npy" && !is_directory) {
    return {read_npy_poses(path, npy_convention), PoseNames::kNumbers};
  }
  if (is_directory) return {read_colmap_trajectory(path), PoseNames::kPhotos};
  if (path.filename() == "images.txt" || path.filename() == "images.bin") {
    const std::filesystem::path folder = path.parent_path();
    return {read_colmap_trajectory(folder.empty() ? "." : folder), PoseNames::kPhotos};
  }
  Trajectory poses = read_tum(path);
  const PoseNames names =
      are_numbers_in_order(poses) ? PoseNames::kNumbers : PoseNames::kTimeStamps;
  return {std::move(poses), names};
}

Trajectory read_trajectory(const std::filesystem::path& path, PoseConvention npy_convention) {
  return read_trajectory_file(path, npy_convention).poses;
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
