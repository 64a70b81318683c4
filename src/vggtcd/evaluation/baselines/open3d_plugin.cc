// SPDX-License-Identifier: Apache-2.0
// The classical rivals of the VGGT-CD paper on Open3D, with the parameters its authors used
// (baselines/rivals.h). The one file that knows Open3D; built as a plugin.
#include "vggtcd/evaluation/baselines/open3d_plugin.h"

#include <open3d/geometry/KDTreeSearchParam.h>
#include <open3d/geometry/PointCloud.h>
#include <open3d/pipelines/registration/ColoredICP.h>
#include <open3d/pipelines/registration/CorrespondenceChecker.h>
#include <open3d/pipelines/registration/FastGlobalRegistration.h>
#include <open3d/pipelines/registration/Feature.h>
#include <open3d/pipelines/registration/Registration.h>
#include <open3d/utility/Logging.h>
#include <open3d/utility/Random.h>

#include <cstdio>
#include <stdexcept>
#include <string>
#include <string_view>

namespace {

namespace o3 = open3d::pipelines::registration;
using Cloud = open3d::geometry::PointCloud;
using CloudPtr = std::shared_ptr<Cloud>;

Cloud make_cloud(const VggtcdRivalCloud& from) {
  Cloud cloud;
  for (int64_t k = 0; k < from.size; ++k) {
    cloud.points_.emplace_back(Eigen::Map<const Eigen::Vector3d>(from.positions + 3 * k));
    cloud.colors_.emplace_back(Eigen::Map<const Eigen::Vector3d>(from.colors + 3 * k));
  }
  return cloud;
}

double diagonal(const Cloud& cloud) { return (cloud.GetMaxBound() - cloud.GetMinBound()).norm(); }

CloudPtr downsample(const Cloud& cloud, double size, double normal_radius) {
  CloudPtr down = cloud.VoxelDownSample(size);
  if (down->points_.size() < 3) throw std::runtime_error("fewer than 3 voxels are occupied");
  down->EstimateNormals(open3d::geometry::KDTreeSearchParamHybrid(normal_radius, 30));
  return down;
}

struct Features {
  CloudPtr cloud;
  std::shared_ptr<o3::Feature> fpfh;
};

Features make_features(const Cloud& cloud, double voxel) {
  CloudPtr down = downsample(cloud, voxel, 2 * voxel);
  auto fpfh =
      o3::ComputeFPFHFeature(*down, open3d::geometry::KDTreeSearchParamHybrid(5 * voxel, 100));
  return {std::move(down), std::move(fpfh)};
}

Eigen::Matrix4d align_fgr(const Cloud& source, const Cloud& target) {
  const double voxel = 0.01 * diagonal(target);
  const Features s = make_features(source, voxel), t = make_features(target, voxel);
  o3::FastGlobalRegistrationOption option;
  option.maximum_correspondence_distance_ = 1.5 * voxel;
  option.iteration_number_ = 128;
  option.maximum_tuple_count_ = 2000;
  Eigen::Matrix4d estimate =
      o3::FastGlobalRegistrationBasedOnFeatureMatching(*s.cloud, *t.cloud, *s.fpfh, *t.fpfh, option)
          .transformation_;
  CloudPtr fine_source, fine_target;
  for (const double size : {2 * voxel, voxel, 0.5 * voxel}) {
    fine_source = downsample(source, size, 2 * size);
    fine_target = downsample(target, size, 2 * size);
    try {
      estimate = o3::RegistrationColoredICP(*fine_source, *fine_target, 0.4 * size, estimate,
                                            o3::TransformationEstimationForColoredICP(0.968),
                                            o3::ICPConvergenceCriteria(1e-6, 1e-6, 100))
                     .transformation_;
    } catch (const std::runtime_error&) {
      // Open3D throws where no pair lies within the distance; the estimate stays as it is.
    }
  }
  return o3::RegistrationICP(*fine_source, *fine_target, 0.2 * voxel, estimate,
                             o3::TransformationEstimationPointToPlane(),
                             o3::ICPConvergenceCriteria(1e-6, 1e-6, 100))
      .transformation_;
}

Eigen::Matrix4d align_ransac_icp(const Cloud& source, const Cloud& target, int icp_iterations) {
  const double voxel = 0.02 * diagonal(target);
  const Features s = make_features(source, voxel), t = make_features(target, voxel);
  const o3::CorrespondenceCheckerBasedOnEdgeLength edges(0.9);
  const o3::CorrespondenceCheckerBasedOnDistance distance(1.5 * voxel);
  const o3::RegistrationResult coarse = o3::RegistrationRANSACBasedOnFeatureMatching(
      *s.cloud, *t.cloud, *s.fpfh, *t.fpfh, true, 1.5 * voxel,
      o3::TransformationEstimationPointToPoint(false), 3, {edges, distance},
      o3::RANSACConvergenceCriteria(100000, 0.999));
  return o3::RegistrationICP(*s.cloud, *t.cloud, 0.4 * voxel, coarse.transformation_,
                             o3::TransformationEstimationPointToPlane(),
                             o3::ICPConvergenceCriteria(1e-6, 1e-6, icp_iterations))
      .transformation_;
}

void align(std::string_view rival, const VggtcdRivalCloud& from, const VggtcdRivalCloud& to,
           VggtcdRivalAnswer& answer) {
  open3d::utility::SetVerbosityLevel(open3d::utility::VerbosityLevel::Error);
  open3d::utility::random::Seed(0);
  Cloud source = make_cloud(from);
  const Cloud target = make_cloud(to);
  answer.scale = 1;
  Eigen::Matrix4d matrix;
  if (rival == "fgr") {
    matrix = align_fgr(source, target);
  } else if (rival == "ransac_icp") {
    matrix = align_ransac_icp(source, target, 2000);
  } else if (rival == "scale_icp") {
    answer.scale = diagonal(target) / diagonal(source);
    source.Scale(answer.scale, Eigen::Vector3d::Zero());
    matrix = align_ransac_icp(source, target, 500);
  } else {
    throw std::runtime_error("no rival of this name");
  }
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      answer.rotation[3 * row + column] = matrix(row, column);
    }
    answer.translation[row] = matrix(row, 3);
  }
}

}  // namespace

extern "C" __attribute__((visibility("default"))) int vggtcd_align_rival(
    const char* rival, const VggtcdRivalCloud* source, const VggtcdRivalCloud* target,
    VggtcdRivalAnswer* answer) {
  try {
    align(rival, *source, *target, *answer);
    return 0;
  } catch (const std::exception& error) {
    std::snprintf(answer->message, sizeof(answer->message), "%s", error.what());
    return 1;
  }
}
