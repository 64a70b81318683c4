// SPDX-License-Identifier: Apache-2.0
// The one file that knows Open3D.
#include "vggtcd/evaluation/baselines/open3d_rivals.h"

#include <open3d/geometry/KDTreeSearchParam.h>
#include <open3d/geometry/PointCloud.h>
#include <open3d/pipelines/registration/ColoredICP.h>
#include <open3d/pipelines/registration/CorrespondenceChecker.h>
#include <open3d/pipelines/registration/FastGlobalRegistration.h>
#include <open3d/pipelines/registration/Feature.h>
#include <open3d/pipelines/registration/Registration.h>
#include <open3d/utility/Logging.h>
#include <open3d/utility/Random.h>

#include "vggtcd/core/error.h"
#include "vggtcd/scene/confidence.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

namespace o3 = open3d::pipelines::registration;
using Cloud = open3d::geometry::PointCloud;
using CloudPtr = std::shared_ptr<Cloud>;

Cloud make_cloud(const Reconstruction& reconstruction) {
  const PointCloud points = unproject(reconstruction, confidence_threshold(reconstruction));
  Cloud cloud;
  for (size_t k = 0; k < points.size(); ++k) {
    cloud.points_.push_back(points.positions[k].cast<double>());
    const uint8_t* rgb = reconstruction.color.data() + 3 * size_t{points.pixels[k]};
    cloud.colors_.push_back(Eigen::Vector3d(rgb[0], rgb[1], rgb[2]) / 255.0);
  }
  return cloud;
}

double diagonal(const Cloud& cloud) { return (cloud.GetMaxBound() - cloud.GetMinBound()).norm(); }

CloudPtr downsample(const Cloud& cloud, double size, double normal_radius) {
  CloudPtr down = cloud.VoxelDownSample(size);
  if (down->points_.size() < 3) {
    throw_error(ErrorCode::kDegenerate, "rival: {} points are left at voxel size {:.3g}",
                down->points_.size(), size);
  }
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

Sim3 to_sim3(const Eigen::Matrix4d& matrix, double source_scale) {
  return {source_scale, matrix.topLeftCorner<3, 3>(), matrix.topRightCorner<3, 1>()};
}

void quiet_and_seeded() {
  open3d::utility::SetVerbosityLevel(open3d::utility::VerbosityLevel::Error);
  open3d::utility::random::Seed(0);
}

Eigen::Matrix4d ransac_then_icp(const Cloud& source, const Cloud& target, int icp_iterations) {
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

}  // namespace

Sim3 align_fgr(const RegistrationProblem& problem) {
  quiet_and_seeded();
  const Cloud source = make_cloud(problem.before), target = make_cloud(problem.after);
  const double voxel = 0.01 * diagonal(target);
  const Features s = make_features(source, voxel), t = make_features(target, voxel);
  o3::FastGlobalRegistrationOption option;
  option.use_absolute_scale_ = false;
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
  estimate = o3::RegistrationICP(*fine_source, *fine_target, 0.2 * voxel, estimate,
                                 o3::TransformationEstimationPointToPlane(),
                                 o3::ICPConvergenceCriteria(1e-6, 1e-6, 100))
                 .transformation_;
  return to_sim3(estimate, 1.0);
}

Sim3 align_ransac_icp(const RegistrationProblem& problem) {
  quiet_and_seeded();
  return to_sim3(ransac_then_icp(make_cloud(problem.before), make_cloud(problem.after), 2000), 1.0);
}

Sim3 align_scale_icp(const RegistrationProblem& problem) {
  quiet_and_seeded();
  Cloud source = make_cloud(problem.before);
  const Cloud target = make_cloud(problem.after);
  const double scale = diagonal(target) / diagonal(source);
  source.Scale(scale, Eigen::Vector3d::Zero());
  return to_sim3(ransac_then_icp(source, target, 500), scale);
}

}  // namespace vggtcd
