// SPDX-License-Identifier: Apache-2.0
// SyntheticScene: one place at two times: objects with a pose in either epoch, light, two walks.
// The world is metric, right-handed, z up, the ground near z = 0 (docs/synthetic.md).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/core/options.h"
#include "vggtcd/evaluation/synthetic/mesh.h"
#include "vggtcd/evaluation/synthetic/texture.h"
#include "vggtcd/geometry/rigid3.h"

namespace vggtcd {

enum class Epoch { kT1 = 0, kT2 = 1 };
constexpr Epoch kEpochs[] = {Epoch::kT1, Epoch::kT2};
constexpr Epoch other_epoch(Epoch epoch) { return epoch == Epoch::kT1 ? Epoch::kT2 : Epoch::kT1; }

enum class ObjectChange { kUnchanged, kAdded, kRemoved, kMoved };
std::span<const EnumName<ObjectChange>> enum_names(ObjectChange);

// A rigid thing. A door or a lid is an object of its own.
struct SceneObject {
  std::string name;
  Mesh mesh;
  std::optional<Rigid3> world_from_object[2];  // by epoch; absent: not there

  ObjectChange change() const;
  // The box of the mesh in the object's own axes.
  Eigen::AlignedBox3d box_m() const;
};

// Light of one epoch. Colours are linear; a lamp's falls off with the squared distance.
struct Lighting {
  struct Lamp {
    Eigen::Vector3d position_m;
    Eigen::Vector3f color;
  };
  Eigen::Vector3d to_sun{0, 0, 1};
  Eigen::Vector3f sun{0, 0, 0}, ambient{0.3f, 0.3f, 0.3f};
  std::vector<Lamp> lamps;
  float exposure = 1;
  Eigen::Vector3f white_balance{1, 1, 1};
};

// Eye and target follow Catmull-Rom splines through these points.
struct CameraPath {
  std::vector<Eigen::Vector3d> eye_m, target_m;
};

struct SyntheticScene {
  std::string name;
  uint64_t seed = 0;
  uint64_t key = 0;  // of name and seed: what all random numbers of the scene start from
  bool outdoor = false;
  std::vector<Material> materials;
  std::vector<SceneObject> objects;
  Lighting lighting[2];
  CameraPath path[2];
  int frames[2] = {40, 40};
  double horizontal_fov_deg = 65;
  double scale_t2_from_t1 = 1;  // between the model units of the two passes
};

// The eleven names: five outdoor, then six indoor.
std::span<const std::string_view> scene_names();
// And those of scenes that test a limit and count in no average: `moving_day`, where 40 % of the
// surface changes.
std::span<const std::string_view> all_scene_names();

enum class SceneChange {
  kScene,  // the scene's own list
  kNone    // nothing: T2 is as T1 was; light and walk still differ
};
std::span<const EnumName<SceneChange>> enum_names(SceneChange);

enum class SceneTexture {
  kScene,  // every surface its own
  kOne,    // the same on every surface: what is seen in one place may be another one
  kNone    // plain surfaces
};
std::span<const EnumName<SceneTexture>> enum_names(SceneTexture);

// The scene of that name and seed; the seed varies shapes, places, textures, walks, light and which
// small things change. Error{kUsage} for an unknown name.
SyntheticScene make_scene(std::string_view name, uint64_t seed,
                          SceneChange change = SceneChange::kScene,
                          SceneTexture texture = SceneTexture::kScene);

// The cameras of a walk: camera_from_world, OpenCV axes. The speed varies along the path and the
// hand shakes, both drawn from the scene's seed.
std::vector<Rigid3> sample_path(const SyntheticScene& scene, Epoch epoch, int frames);

}  // namespace vggtcd
