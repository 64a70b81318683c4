// SPDX-License-Identifier: Apache-2.0
// Procedural surfaces: colour as a function of where on the object one looks. They are meant to
// carry what a feature matcher lives on: detail on every scale that does not repeat.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace vggtcd {

enum class Texture {
  kPlaster,   // faint mottling: the "textureless" wall
  kConcrete,  // stains, speckle, cracks
  kBrick,
  kPlanks,  // boards with grain
  kTiles,
  kFabric,
  kGrass,
  kFoliage,
  kPoster,  // shapes and text, every face another one
  kText,    // rows of glyphs
  kBooks,   // spines side by side
  kMetal,
  kPaint,   // nearly plain, glossy
  kChequer  // two colours in squares of feature_m: every corner looks like every other
};

struct Material {
  Texture texture = Texture::kPlaster;
  Eigen::Vector3f color{0.5f, 0.5f, 0.5f};         // linear RGB reflectance
  Eigen::Vector3f second_color{0.3f, 0.3f, 0.3f};  // mortar, grain, ink
  float feature_m = 0.2f;                          // the size of a brick, plank, tile, page
  float gloss = 0;                                 // strength of the highlight
  uint64_t seed = 0;
};

struct SurfacePoint {
  Eigen::Vector3f position_m;  // in the object's own frame
  Eigen::Vector2f uv_m;
  uint32_t face = 0;
  float footprint_m = 0;  // the width of the pixel on the surface: finer detail is left out
};

// Linear RGB reflectance in [0, 1].
Eigen::Vector3f surface_color(const Material& material, const SurfacePoint& point);

}  // namespace vggtcd
