// SPDX-License-Identifier: Apache-2.0
// The one file that knows Embree.
#include "vggtcd/evaluation/synthetic/ray_caster.h"

#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <new>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

struct WorldTriangle {
  uint32_t object;
  uint32_t triangle;  // within the object's mesh
};

// Squared distance from a point to a triangle (Ericson, Real-Time Collision Detection, 5.1.5).
double squared_distance(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                        const Vector3d& c) {
  const Vector3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return ap.squaredNorm();
  const Vector3d bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return bp.squaredNorm();
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return (ap - d1 / (d1 - d3) * ab).squaredNorm();
  const Vector3d cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return cp.squaredNorm();
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return (ap - d2 / (d2 - d6) * ac).squaredNorm();
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return (bp - (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b)).squaredNorm();
  }
  const double scale = 1.0 / (va + vb + vc);
  return (ap - vb * scale * ab - vc * scale * ac).squaredNorm();
}

}  // namespace

struct RayCaster::Implementation {
  const SyntheticScene& scene;
  RTCDevice device = nullptr;
  RTCScene embree = nullptr;
  std::vector<Vector3f> positions;  // world
  std::vector<std::array<uint32_t, 3>> corners;
  std::vector<WorldTriangle> triangles;
  std::vector<Rigid3> world_from_object;

  Implementation(const SyntheticScene& scene_in, Epoch epoch) : scene(scene_in) {
    collect(epoch);
    device = rtcNewDevice("threads=1,isa=sse4.2");
    if (device == nullptr) {
      if (rtcGetDeviceError(nullptr) == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
      throw_error(ErrorCode::kUnavailable, "embree: no device");
    }
    embree = rtcNewScene(device);
    rtcSetSceneFlags(embree, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertex_buffer = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                sizeof(Vector3f), positions.size()));
    auto* index_buffer = static_cast<uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(uint32_t), corners.size()));
    if (vertex_buffer == nullptr || index_buffer == nullptr) throw std::bad_alloc();
    for (size_t k = 0; k < positions.size(); ++k) {
      for (int axis = 0; axis < 3; ++axis) *vertex_buffer++ = positions[k][axis];
    }
    for (const auto& corner : corners) {
      for (const uint32_t index : corner) *index_buffer++ = index;
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(embree, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(embree);
    const RTCError error = rtcGetDeviceError(device);
    if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
    check(error == RTC_ERROR_NONE, "embree: scene could not be built");
  }
  ~Implementation() {
    if (embree != nullptr) rtcReleaseScene(embree);
    if (device != nullptr) rtcReleaseDevice(device);
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  void collect(Epoch epoch) {
    for (uint32_t object = 0; object < scene.objects.size(); ++object) {
      const SceneObject& each = scene.objects[object];
      const auto& pose = each.world_from_object[static_cast<int>(epoch)];
      world_from_object.push_back(pose.value_or(Rigid3{}));
      if (!pose) continue;
      const uint32_t first = static_cast<uint32_t>(positions.size());
      for (const Mesh::Vertex& vertex : each.mesh.vertices) {
        positions.push_back((*pose * vertex.position_m.cast<double>()).cast<float>());
      }
      for (uint32_t k = 0; k < each.mesh.triangles.size(); ++k) {
        const auto& corner = each.mesh.triangles[k].vertex;
        corners.push_back({first + corner[0], first + corner[1], first + corner[2]});
        triangles.push_back({object, k});
      }
    }
  }

  Vector3d corner(uint32_t primitive, size_t k) const {
    return positions[corners[primitive][k]].cast<double>();
  }

  RayHit describe(uint32_t primitive, const Vector3d& origin, const Vector3d& direction) const {
    const Vector3d a = corner(primitive, 0), ab = corner(primitive, 1) - a,
                   ac = corner(primitive, 2) - a;
    const Vector3d plane = ab.cross(ac);
    RayHit hit;
    hit.distance_m = (a - origin).dot(plane) / direction.dot(plane);
    const Vector3d offset = origin + hit.distance_m * direction - a;
    const double area2 = plane.squaredNorm();
    const float wb = static_cast<float>(offset.cross(ac).dot(plane) / area2);
    const float wc = static_cast<float>(ab.cross(offset).dot(plane) / area2);
    const float wa = 1 - wb - wc;

    const WorldTriangle& where = triangles[primitive];
    const Mesh& mesh = scene.objects[where.object].mesh;
    const Mesh::Triangle& triangle = mesh.triangles[where.triangle];
    const auto& va = mesh.vertices[triangle.vertex[0]];
    const auto& vb = mesh.vertices[triangle.vertex[1]];
    const auto& vc = mesh.vertices[triangle.vertex[2]];
    hit.object = static_cast<int>(where.object);
    hit.material = triangle.material;
    hit.face = triangle.face;
    hit.position_in_object_m = wa * va.position_m + wb * vb.position_m + wc * vc.position_m;
    hit.uv_m = wa * va.uv_m + wb * vb.uv_m + wc * vc.uv_m;
    const Vector3f normal = wa * va.normal + wb * vb.normal + wc * vc.normal;
    hit.normal = (world_from_object[where.object].rotation.cast<float>() * normal).normalized();
    if (hit.normal.dot(direction.cast<float>()) > 0) hit.normal = -hit.normal;
    return hit;
  }
};

namespace {

template <typename Ray>
void set_ray(Ray& ray, const Vector3d& origin, const Vector3d& direction, double near, double far) {
  ray.org_x = static_cast<float>(origin.x());
  ray.org_y = static_cast<float>(origin.y());
  ray.org_z = static_cast<float>(origin.z());
  ray.dir_x = static_cast<float>(direction.x());
  ray.dir_y = static_cast<float>(direction.y());
  ray.dir_z = static_cast<float>(direction.z());
  ray.tnear = static_cast<float>(near);
  ray.tfar = static_cast<float>(far);
  ray.time = 0;
  ray.mask = 0xFFFFFFFFu;
  ray.id = 0;
  ray.flags = 0;
}

}  // namespace

RayCaster::RayCaster(const SyntheticScene& scene, Epoch epoch)
    : implementation_(std::make_unique<Implementation>(scene, epoch)) {}
RayCaster::~RayCaster() = default;

std::optional<RayHit> RayCaster::cast(const Vector3d& origin, const Vector3d& direction) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  set_ray(query.ray, origin, direction, 1e-4, std::numeric_limits<float>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(implementation_->embree, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return implementation_->describe(query.hit.primID, origin, direction);
}

bool RayCaster::blocked(const Vector3d& from, const Vector3d& to) const {
  const Vector3d offset = to - from;
  const double distance = offset.norm();
  if (distance <= 0.002) return false;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray{};
  set_ray(ray, from, offset / distance, 1e-3, distance - 0.002);
  rtcOccluded1(implementation_->embree, &context, &ray);
  return ray.tfar < 0;
}

bool RayCaster::surface_within(const Vector3d& point, double distance_m) const {
  struct Search {
    const Implementation* implementation;
    Vector3d point;
    double squared;
    bool found;
  } search{implementation_.get(), point, distance_m * distance_m, false};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  RTCPointQuery query;
  query.x = static_cast<float>(point.x());
  query.y = static_cast<float>(point.y());
  query.z = static_cast<float>(point.z());
  query.radius = static_cast<float>(distance_m * 1.001 + 1e-6);
  query.time = 0;
  rtcPointQuery(
      implementation_->embree, &query, &context,
      [](RTCPointQueryFunctionArguments* arguments) {
        auto& s = *static_cast<Search*>(arguments->userPtr);
        const uint32_t primitive = arguments->primID;
        const auto& impl = *s.implementation;
        s.found |= squared_distance(s.point, impl.corner(primitive, 0), impl.corner(primitive, 1),
                                    impl.corner(primitive, 2)) <= s.squared;
        return false;  // the radius stays as it is
      },
      &search);
  return search.found;
}

}  // namespace vggtcd
