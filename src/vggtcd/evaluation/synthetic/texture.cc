// SPDX-License-Identifier: Apache-2.0
// Value noise and the patterns made of it.
#include "vggtcd/evaluation/synthetic/texture.h"

#include <algorithm>
#include <cmath>

#include "vggtcd/evaluation/synthetic/random.h"

namespace vggtcd {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

// A number in [0, 1) for a cell of an integer lattice.
float cell_hash(int x, int y, int z, uint64_t seed) {
  const uint64_t packed = (static_cast<uint64_t>(static_cast<uint32_t>(x)) << 32) ^
                          (static_cast<uint64_t>(static_cast<uint32_t>(y)) << 16) ^
                          static_cast<uint64_t>(static_cast<uint32_t>(z)) * 0x9E3779B1ull;
  return static_cast<float>(mix64(packed, seed) >> 40) * 0x1.0p-24f;
}

int floor_int(float x) { return static_cast<int>(std::floor(x)); }
float fract(float x) { return x - std::floor(x); }
float smooth(float t) { return t * t * (3 - 2 * t); }
float smoothstep(float low, float high, float x) {
  return smooth(std::clamp((x - low) / (high - low), 0.0f, 1.0f));
}
Vector3f mix(const Vector3f& a, const Vector3f& b, float t) { return a + (b - a) * t; }

// Value noise in [-1, 1], wavelength 1.
float noise(const Vector3f& p, uint64_t seed) {
  const int x = floor_int(p.x()), y = floor_int(p.y()), z = floor_int(p.z());
  const float u = smooth(p.x() - static_cast<float>(x));
  const float v = smooth(p.y() - static_cast<float>(y));
  const float w = smooth(p.z() - static_cast<float>(z));
  const auto row = [&](int dy, int dz) {
    const float a = cell_hash(x, y + dy, z + dz, seed);
    return a + (cell_hash(x + 1, y + dy, z + dz, seed) - a) * u;
  };
  const auto layer = [&](int dz) {
    const float a = row(0, dz);
    return a + (row(1, dz) - a) * v;
  };
  const float a = layer(0);
  return 2 * (a + (layer(1) - a) * w) - 1;
}

// A sum of octaves from the given wavelength down to about a pixel, each half as strong.
float octaves(const SurfacePoint& point, float wavelength_m, int count, uint64_t seed) {
  float sum = 0, strength = 1;
  for (int k = 0; k < count; ++k) {
    const float visible = smoothstep(1.0f, 3.0f, wavelength_m / (point.footprint_m + 1e-6f));
    if (visible <= 0) break;
    sum += strength * visible *
           noise(point.position_m / wavelength_m, seed + static_cast<uint64_t>(k));
    strength *= 0.6f;
    wavelength_m *= 0.5f;
  }
  return sum;
}

// A vivid colour drawn from a hash.
Vector3f random_color(uint64_t key) {
  Random random(key);
  const float hue = static_cast<float>(random.uniform(0, 6));
  const float light = static_cast<float>(random.uniform(0.08, 0.8));
  const float saturation = static_cast<float>(random.uniform(0.2, 0.95));
  const auto channel = [&](float offset) {
    const float distance = std::abs(std::fmod(hue + offset, 6.0f) - 3.0f);
    return light * (1 - saturation + saturation * std::clamp(distance - 1.0f, 0.0f, 1.0f));
  };
  return {channel(0), channel(2), channel(4)};
}

// Rows of glyphs, each a random 4 x 5 bitmap; 1 where there is ink.
float ink(const Vector2f& uv_m, float line_m, uint64_t seed) {
  const float line = uv_m.y() / line_m;
  const float column = uv_m.x() / (0.6f * line_m);
  const float in_line = fract(line), in_column = fract(column);
  if (in_line > 0.7f || in_column > 0.8f) return 0;
  const int glyph_x = floor_int(column), glyph_y = floor_int(line);
  if (cell_hash(glyph_x, glyph_y, 7, seed) < 0.18f) return 0;  // a gap between words
  return cell_hash(glyph_x * 4 + floor_int(in_column * 5), glyph_y * 5 + floor_int(in_line * 7), 0,
                   seed) < 0.55f
             ? 1.0f
             : 0.0f;
}

Vector3f brick(const Material& m, const SurfacePoint& p, bool tiles) {
  const float height = tiles ? m.feature_m : m.feature_m * 0.33f;
  const int row = floor_int(p.uv_m.y() / height);
  const float shift = !tiles && (row & 1) ? 0.5f : 0.0f;
  const float along = p.uv_m.x() / m.feature_m + shift;
  const int column = floor_int(along);
  const float edge_u = std::min(fract(along), 1 - fract(along)) * m.feature_m;
  const float in_row = fract(p.uv_m.y() / height);
  const float edge_v = std::min(in_row, 1 - in_row) * height;
  const float joint_m = tiles ? 0.012f * m.feature_m + 0.001f : 0.03f * m.feature_m;
  const float on_face = smoothstep(joint_m, joint_m * 1.5f, std::min(edge_u, edge_v));
  const float tone = cell_hash(column, row, static_cast<int>(p.face), m.seed);
  const float grain = octaves(p, 0.5f * m.feature_m, 5, m.seed);
  const Vector3f face =
      m.color * (tiles ? 0.85f + 0.3f * tone : 0.6f + 0.8f * tone) * (1 + 0.25f * grain);
  return mix(m.second_color * (1 + 0.2f * grain), face, on_face);
}

Vector3f planks(const Material& m, const SurfacePoint& p) {
  const int board = floor_int(p.uv_m.y() / m.feature_m);
  const float start = 7 * cell_hash(board, 0, static_cast<int>(p.face), m.seed);
  const float length = 12 * m.feature_m;
  const int piece = floor_int((p.uv_m.x() + start) / length);
  const float tone = cell_hash(board, piece, 1, m.seed);
  SurfacePoint stretched = p;  // the grain runs along u
  stretched.position_m = {p.uv_m.x() * 0.12f + 3 * tone, p.uv_m.y(),
                          static_cast<float>(board * 13 + piece)};
  const float grain = octaves(stretched, 0.25f * m.feature_m, 5, m.seed + 11);
  const float stain = octaves(p, 0.7f, 4, m.seed + 17);
  const float in_board = fract(p.uv_m.y() / m.feature_m);
  const float gap = smoothstep(0.0f, 0.03f, std::min(in_board, 1 - in_board));
  const float t = std::clamp(0.35f + 0.45f * grain + 0.15f * stain, 0.0f, 1.0f);
  return mix(m.color, m.second_color, t) * (0.75f + 0.5f * tone) * (0.35f + 0.65f * gap);
}

Vector3f poster(const Material& m, const SurfacePoint& p) {
  const Vector2f scaled = p.uv_m / m.feature_m;
  const int px = floor_int(scaled.x()), py = floor_int(scaled.y());
  const Vector2f uv(scaled.x() - static_cast<float>(px), scaled.y() - static_cast<float>(py));
  const uint64_t key = mix64(
      m.seed + p.face, mix64(static_cast<uint64_t>(px + 4096), static_cast<uint64_t>(py + 4096)));
  Vector3f color = mix(m.color, random_color(key), 0.6f);
  Random random(key, {1});
  for (int shape = 0; shape < 11; ++shape) {
    const Vector2f centre{static_cast<float>(random.uniform()),
                          static_cast<float>(random.uniform())};
    const Vector2f size{static_cast<float>(random.uniform(0.04, 0.28)),
                        static_cast<float>(random.uniform(0.04, 0.28))};
    const bool round = random.uniform() < 0.4;
    const uint64_t shape_key = random.next();
    const Vector2f offset = (uv - centre).cwiseQuotient(size);
    const bool inside = round ? offset.squaredNorm() < 1 : offset.cwiseAbs().maxCoeff() < 1;
    if (inside) color = mix(random_color(shape_key), color, 0.15f);
  }
  if (uv.y() > 0.66f && uv.y() < 0.9f) {
    color *= 1 - 0.85f * ink(uv, 0.055f, key);
  }
  return color * (1 + 0.12f * octaves(p, 0.4f * m.feature_m, 5, m.seed));
}

Vector3f books(const Material& m, const SurfacePoint& p) {
  const float slot = p.uv_m.x() / m.feature_m;
  // Two spines of unequal width per slot.
  const float split = 0.3f + 0.4f * cell_hash(floor_int(slot), 3, 0, m.seed);
  const bool second = fract(slot) > split;
  const int book = 2 * floor_int(slot) + (second ? 1 : 0);
  const uint64_t key = mix64(m.seed + p.face, static_cast<uint64_t>(book + 4096));
  Vector3f color = random_color(key);
  const float edge = std::abs(fract(slot) - (second ? 1.0f : split));
  const Vector2f title(p.uv_m.y() + 5 * cell_hash(book, 5, 0, m.seed), p.uv_m.x());
  if (ink(title, 0.45f * m.feature_m, key) > 0) color = mix(color, random_color(key + 1), 0.8f);
  return color * (0.3f + 0.7f * smoothstep(0.0f, 0.06f, edge)) *
         (1 + 0.15f * octaves(p, 0.05f, 4, m.seed));
}

Vector3f concrete(const Material& m, const SurfacePoint& p) {
  const float stains = octaves(p, 1.3f, 4, m.seed);
  const float speckle = octaves(p, 0.12f, 5, m.seed + 5);
  const float crack = std::abs(octaves(p, 0.9f, 5, m.seed + 9));
  const float pebbles = noise(p.position_m / 0.035f, m.seed + 13);
  const float visible = smoothstep(1.0f, 3.0f, 0.035f / (p.footprint_m + 1e-6f));
  Vector3f color = m.color * (1 + 0.22f * stains + 0.28f * speckle);
  if (pebbles > 0.45f) color *= 1 - 0.35f * visible;
  return mix(m.second_color, color, smoothstep(0.0f, 0.03f, crack));
}

}  // namespace

Vector3f surface_color(const Material& m, const SurfacePoint& p) {
  const auto tint = [&](float t) { return mix(m.color, m.second_color, std::clamp(t, 0.f, 1.f)); };
  Vector3f color = m.color;
  switch (m.texture) {
    case Texture::kPlaster:
      color = m.color *
              (1 + 0.05f * octaves(p, 0.8f, 4, m.seed) + 0.06f * octaves(p, 0.06f, 4, m.seed + 4));
      break;
    case Texture::kConcrete:
      color = concrete(m, p);
      break;
    case Texture::kBrick:
      color = brick(m, p, false);
      break;
    case Texture::kPlanks:
      color = planks(m, p);
      break;
    case Texture::kTiles:
      color = brick(m, p, true);
      break;
    case Texture::kFabric:
      color = tint(0.5f + 0.5f * octaves(p, m.feature_m, 4, m.seed)) *
              (1 + 0.35f * octaves(p, 0.02f, 3, m.seed + 6));
      break;
    case Texture::kGrass:
      color = tint(0.5f + 0.5f * octaves(p, 0.08f, 4, m.seed)) *
              (1 + 0.3f * octaves(p, 1.7f, 4, m.seed + 8));
      break;
    case Texture::kFoliage: {
      const float leaf = noise(p.position_m / m.feature_m, m.seed);
      color = tint(0.5f + 0.9f * leaf) * (1 + 0.45f * octaves(p, 0.4f * m.feature_m, 4, m.seed));
      break;
    }
    case Texture::kPoster:
      color = poster(m, p);
      break;
    case Texture::kText:
      color = mix(m.color, m.second_color,
                  ink(p.uv_m, m.feature_m, m.seed + static_cast<uint64_t>(p.face))) *
              (1 + 0.1f * octaves(p, 0.2f, 5, m.seed));
      break;
    case Texture::kBooks:
      color = books(m, p);
      break;
    case Texture::kMetal: {
      SurfacePoint brushed = p;
      brushed.position_m = {p.position_m.x(), p.position_m.y(), 9 * p.position_m.z()};
      color = m.color * (1 + 0.15f * octaves(brushed, 0.2f, 5, m.seed) +
                         0.1f * octaves(p, 0.5f, 3, m.seed + 3));
      break;
    }
    case Texture::kPaint:
      color = m.color * (1 + 0.08f * octaves(p, 0.5f, 6, m.seed));
      break;
    case Texture::kChequer:
      color = (floor_int(p.uv_m.x() / m.feature_m) + floor_int(p.uv_m.y() / m.feature_m)) % 2 == 0
                  ? m.color
                  : m.second_color;
      break;
  }
  return color.cwiseMax(0.01f).cwiseMin(0.95f);
}

}  // namespace vggtcd
