// SPDX-License-Identifier: Apache-2.0
// A simple renderer's light: enough for photos that a feature matcher takes for photos.
#include "vggtcd/evaluation/synthetic/shading.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "vggtcd/evaluation/synthetic/random.h"

namespace vggtcd {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// Pale at the horizon, with clouds that lie far away (so they move with the rotation alone).
Vector3f sky(const SyntheticScene& scene, const Vector3d& direction) {
  const float up = static_cast<float>(std::clamp(direction.z(), 0.0, 1.0));
  const Vector3f blue = Vector3f(0.75f, 0.85f, 0.95f) * (1 - up) + Vector3f(0.3f, 0.5f, 0.85f) * up;
  Material cloud;
  cloud.texture = Texture::kFabric;
  cloud.feature_m = 0.35f;
  cloud.color = {0, 0, 0};
  cloud.second_color = {1, 1, 1};
  cloud.seed = scene.key;
  SurfacePoint point;
  point.position_m = direction.cast<float>();
  point.footprint_m = 0.03f;
  return blue + 0.5f * (surface_color(cloud, point) - Vector3f::Constant(0.4f)).cwiseMax(0.f);
}

float srgb(float linear) {
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

}  // namespace

Vector3f radiance(const SyntheticScene& scene, const Lighting& lighting, const RayCaster& caster,
                  const Vector3d& origin, const Vector3d& direction,
                  const std::optional<RayHit>& hit, float footprint_m) {
  if (!hit) return sky(scene, direction);
  const Material& material = scene.materials[static_cast<size_t>(hit->material)];
  const Vector3d place = origin + hit->distance_m * direction;
  const Vector3d outside = place + 1e-3 * hit->normal.cast<double>();
  const float facing = std::max(0.2f, std::abs(hit->normal.dot(direction.cast<float>())));
  SurfacePoint point;
  point.position_m = hit->position_in_object_m;
  point.uv_m = hit->uv_m;
  point.face = hit->face;
  point.footprint_m = footprint_m / facing;
  const Vector3f albedo = surface_color(material, point);

  // Ambient light comes from above more than from below.
  Vector3f diffuse = lighting.ambient * (0.72f + 0.28f * hit->normal.z());
  Vector3f highlight = Vector3f::Zero();
  const auto add_light = [&](const Vector3d& to_light, const Vector3f& color) {
    const float cosine = hit->normal.dot(to_light.cast<float>());
    if (cosine <= 0) return;
    diffuse += color * cosine;
    if (material.gloss <= 0) return;
    const Vector3f half = (to_light - direction).normalized().cast<float>();
    highlight += color * material.gloss * std::pow(std::max(0.0f, hit->normal.dot(half)), 40.0f);
  };
  if (lighting.sun.squaredNorm() > 0 && hit->normal.dot(lighting.to_sun.cast<float>()) > 0 &&
      !caster.blocked(outside, outside + 60 * lighting.to_sun)) {
    add_light(lighting.to_sun, lighting.sun);
  }
  for (const Lighting::Lamp& lamp : lighting.lamps) {
    const Vector3d offset = lamp.position_m - outside;
    if (hit->normal.dot(offset.cast<float>()) <= 0 || caster.blocked(outside, lamp.position_m))
      continue;
    const float falloff = static_cast<float>(1.0 / std::max(0.3, offset.squaredNorm()));
    add_light(offset.normalized(), lamp.color * falloff);
  }
  return albedo.cwiseProduct(diffuse) + highlight;
}

void develop(const Lighting& lighting, const Vector3f& radiance, uint64_t noise_key, uint8_t* rgb) {
  Random random(noise_key);
  for (int k = 0; k < 3; ++k) {
    const float exposed =
        std::max(0.0f, radiance[k] * lighting.exposure * lighting.white_balance[k]);
    const float shoulder = 1 - std::exp(-0.8f * exposed);
    const float noise = static_cast<float>(random.uniform(-1.7, 1.7));  // about 1 level
    rgb[k] = static_cast<uint8_t>(std::clamp(255.0f * srgb(shoulder) + noise + 0.5f, 0.f, 255.f));
  }
}

}  // namespace vggtcd
