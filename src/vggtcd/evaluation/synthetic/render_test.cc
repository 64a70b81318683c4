// SPDX-License-Identifier: Apache-2.0
// Rays, depth and labels against analytic answers and brute force; promises about all scenes.
#include "vggtcd/evaluation/synthetic/render.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <set>

#include "vggtcd/core/error.h"
#include "vggtcd/evaluation/synthetic/random.h"
#include "vggtcd/evaluation/synthetic/ray_caster.h"

namespace vggtcd {
namespace {

using Eigen::Vector3d;

// A floor, a wall 5 m ahead (y = 5) and a cube of 1 m in between that is gone in T2. Both epochs
// are looked at from (0, -1, 1) along +y.
SyntheticScene cube_scene() {
  SyntheticScene scene;
  scene.name = "cube";
  scene.materials.resize(1);
  Mesh floor, wall, cube;
  add_box(floor, at(0, 0, -0.5), {20, 20, 1}, 0);
  add_box(wall, at(0, 5.5, 0), {20, 1, 20}, 0);
  add_box(cube, {}, {1, 1, 1}, 0);
  scene.objects.push_back({"floor", floor, {Rigid3{}, Rigid3{}}});
  scene.objects.push_back({"wall", wall, {Rigid3{}, Rigid3{}}});
  scene.objects.push_back({"cube", cube, {at(0, 2.5, 0.5), std::nullopt}});
  for (CameraPath& path : scene.path) {
    path.eye_m = {{0, -1, 1}, {0, -1, 1}};
    path.target_m = {{0, 5, 1}, {0, 5, 1}};
  }
  return scene;
}

RenderOptions small(int frames, int width) {
  RenderOptions options;
  options.frames = frames;
  options.width = width;
  options.photo_scale = 1;
  options.samples = 1;
  return options;
}

// Moeller and Trumbore over every triangle.
double brute_force_distance(const SyntheticScene& scene, Epoch epoch, const Vector3d& origin,
                            const Vector3d& direction) {
  double nearest = INFINITY;
  for (const SceneObject& object : scene.objects) {
    const auto& pose = object.world_from_object[static_cast<int>(epoch)];
    if (!pose) continue;
    for (const Mesh::Triangle& triangle : object.mesh.triangles) {
      Vector3d p[3];
      for (size_t k = 0; k < 3; ++k) {
        p[k] = *pose * object.mesh.vertices[triangle.vertex[k]].position_m.cast<double>();
      }
      const Vector3d ab = p[1] - p[0], ac = p[2] - p[0], cross = direction.cross(ac);
      const double determinant = ab.dot(cross);
      if (std::abs(determinant) < 1e-14) continue;
      const Vector3d offset = origin - p[0];
      const double u = offset.dot(cross) / determinant;
      const Vector3d q = offset.cross(ab);
      const double v = direction.dot(q) / determinant, t = ac.dot(q) / determinant;
      if (u >= 0 && v >= 0 && u + v <= 1 && t > 1e-4) nearest = std::min(nearest, t);
    }
  }
  return nearest;
}

TEST(RayCaster, AgreesWithBruteForceOverAllTriangles) {
  const SyntheticScene scene = make_scene("kitchen", 3);
  for (const Epoch epoch : kEpochs) {
    const RayCaster caster(scene, epoch);
    Random random(5);
    int compared = 0;
    for (int k = 0; k < 150; ++k) {
      const Vector3d origin{random.uniform(-1, 1), random.uniform(0.8, 1.5), random.uniform(1, 2)};
      const Vector3d direction =
          Vector3d{random.normal(), random.normal(), random.normal()}.normalized();
      const double expected = brute_force_distance(scene, epoch, origin, direction);
      const auto hit = caster.cast(origin, direction);
      ASSERT_EQ(hit.has_value(), std::isfinite(expected));
      if (!hit) continue;
      // Embree works on vertices in float, a few metres from the origin: 1e-6 m, and more at a
      // grazing angle; where two surfaces meet it may take the other one.
      EXPECT_NEAR(hit->distance_m, expected, 1e-4) << "ray " << k;
      ++compared;
      const Vector3d before = origin + 0.9 * expected * direction;
      const Vector3d behind = origin + (expected + 0.01) * direction;
      EXPECT_FALSE(caster.blocked(origin, before));
      EXPECT_TRUE(caster.blocked(origin, behind));
    }
    EXPECT_EQ(compared, 150);  // the room is closed
  }
}

TEST(RayCaster, KnowsTheDistanceToABox) {
  const SyntheticScene scene = cube_scene();
  const RayCaster caster(scene, Epoch::kT1);
  // From 0.3 m above the cube's top; 0.3 beyond a corner diagonally; 0.2 before the wall.
  EXPECT_TRUE(caster.surface_within({0.1, 2.4, 1.3}, 0.3001));
  EXPECT_FALSE(caster.surface_within({0.1, 2.4, 1.3}, 0.2999));
  const double diagonal = 0.3 * std::sqrt(3.0);
  EXPECT_TRUE(caster.surface_within({0.8, 1.7, 1.3}, diagonal + 1e-4));
  EXPECT_FALSE(caster.surface_within({0.8, 1.7, 1.3}, diagonal - 1e-4));
  EXPECT_FALSE(caster.surface_within({5, 4.8, 5}, 0.1999));
  EXPECT_TRUE(caster.surface_within({5, 4.8, 5}, 0.2001));
}

TEST(Render, DepthIsWhereThePixelsRayMeetsTheScene) {
  const SyntheticScene scene = cube_scene();
  const SceneTruth truth = render(scene, small(2, 64), silent_progress());
  const EpochTruth& t1 = truth.of(Epoch::kT1);
  int cube = 0;
  for (int frame = 0; frame < 2; ++frame) {
    const View& view = t1.views[static_cast<size_t>(frame)];
    for (int v = 0; v < t1.height; ++v) {
      for (int u = 0; u < t1.width; ++u) {
        const size_t pixel = static_cast<size_t>((frame * t1.height + v) * t1.width + u);
        const Vector3d point =
            view.camera_from_world.inverse() * view.pinhole.unproject(u, v, t1.depth_m[pixel]);
        // Floor: z = 0. Wall: y = 5. Cube: |x| or |y - 2.5| is 0.5, or z is 1.
        double off = 0;
        switch (t1.object[pixel]) {
          case 1:
            off = std::abs(point.z());
            break;
          case 2:
            off = std::abs(point.y() - 5);
            break;
          default: {
            const Vector3d in_cube = (point - Vector3d(0, 2.5, 0.5)).cwiseAbs();
            off = std::abs(in_cube.maxCoeff() - 0.5);
            ++cube;
          }
        }
        EXPECT_LT(off, 2e-5);  // depth is stored in float
      }
    }
  }
  EXPECT_GT(cube, 50);
}

TEST(Render, LabelsTheRemovedCubeAndWhatItHid) {
  const SceneTruth truth = render(cube_scene(), small(2, 64), silent_progress());
  const EpochTruth& t1 = truth.of(Epoch::kT1);
  const EpochTruth& t2 = truth.of(Epoch::kT2);
  for (size_t pixel = 0; pixel < t1.label.size(); ++pixel) {
    if (t1.object[pixel] == 3) {
      EXPECT_NE(t1.label[pixel], kLabelUnchanged);
      EXPECT_TRUE(t1.other_looked[pixel]);  // T2 looks through the place
    } else {
      EXPECT_EQ(t1.label[pixel], kLabelUnchanged);
    }
  }
  // In T2, what lies in the cube's former place or behind it was hidden from T1: a pixel of the
  // floor under the cube, and of the wall straight behind it.
  int hidden = 0;
  for (size_t pixel = 0; pixel < t2.label.size(); ++pixel) {
    EXPECT_EQ(t2.label[pixel], kLabelUnchanged);
    const View& view = t2.views[pixel / t2.pixels_per_frame()];
    const size_t in_frame = pixel % t2.pixels_per_frame();
    const Vector3d point =
        view.camera_from_world.inverse() *
        view.pinhole.unproject(static_cast<double>(in_frame % 64),
                               static_cast<double>(in_frame / 64), t2.depth_m[pixel]);
    const bool under_cube =
        point.z() < 0.01 && std::abs(point.x()) < 0.49 && std::abs(point.y() - 2.5) < 0.49;
    if (!under_cube) continue;
    ++hidden;
    EXPECT_FALSE(t2.other_looked[pixel]) << point.transpose();
  }
  EXPECT_GT(hidden, 10);
}

TEST(Render, LeavesOutChangedSurfaceThatTouchesTheOtherEpoch) {
  // The cube's lowest centimetres lie within the resolution of the floor, which stays.
  RenderOptions options = small(2, 128);
  options.label_resolution = 0.01;
  const SceneTruth truth = render(cube_scene(), options, silent_progress());
  const EpochTruth& t1 = truth.of(Epoch::kT1);
  const double resolution_m = 0.01 * truth.extent_m;
  int changed = 0, left_out = 0;
  for (size_t pixel = 0; pixel < t1.label.size(); ++pixel) {
    if (t1.object[pixel] != 3) continue;
    const View& view = t1.views[pixel / t1.pixels_per_frame()];
    const size_t in_frame = pixel % t1.pixels_per_frame();
    const double z =
        (view.camera_from_world.inverse() *
         view.pinhole.unproject(static_cast<double>(in_frame % 128),
                                static_cast<double>(in_frame / 128), t1.depth_m[pixel]))
            .z();
    if (std::abs(z - resolution_m) < 1e-4) continue;
    EXPECT_EQ(t1.label[pixel], z < resolution_m ? kLabelVoid : kLabelChanged);
    (z < resolution_m ? left_out : changed)++;
  }
  EXPECT_GT(changed, 100);
  EXPECT_GT(left_out, 10);
}

class EveryScene : public testing::TestWithParam<std::string_view> {};

TEST_P(EveryScene, KeepsItsPromises) {
  for (const uint64_t seed : {1u, 2u}) {
    const SyntheticScene scene = make_scene(GetParam(), seed);
    for (const int frames : scene.frames) {
      EXPECT_GE(frames, 20);
      EXPECT_LE(frames, 100);
    }
    EXPECT_GE(scene.scale_t2_from_t1, 0.4);
    EXPECT_LE(scene.scale_t2_from_t1, 2.5);
    const SceneTruth truth = render(scene, small(12, 64), silent_progress());
    double changed = 0, surface = 0, unseen = 0;
    for (const EpochTruth& epoch : truth.epoch) {
      for (size_t pixel = 0; pixel < epoch.label.size(); ++pixel) {
        if (epoch.object[pixel] == 0) {
          EXPECT_TRUE(scene.outdoor) << "a hole in a room";
          continue;
        }
        surface += 1;
        changed += epoch.label[pixel] == kLabelChanged ? 1 : 0;
        unseen += epoch.other_looked[pixel] ? 0 : 1;
        EXPECT_GT(epoch.depth_m[pixel], 0.3f) << "a camera inside or against something";
      }
    }
    EXPECT_GE(changed / surface, 0.01);
    EXPECT_LE(changed / surface, 0.25);
    // The walks overlap, but only in part.
    EXPECT_GE(unseen / surface, 0.03);
    EXPECT_LE(unseen / surface, 0.5);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, EveryScene,
                         testing::ValuesIn(scene_names().begin(), scene_names().end()),
                         [](const auto& each) { return std::string(each.param); });

TEST(MakeScene, NothingChangesWhereNothingShall) {
  const SyntheticScene scene = make_scene("living_room", 1, SceneChange::kNone);
  const SceneTruth truth = render(scene, small(6, 64), silent_progress());
  EXPECT_EQ(changed_share(truth), 0);
  // The same place as the scene with changes: its T1 is the same.
  const SceneTruth changing = render(make_scene("living_room", 1), small(6, 64), silent_progress());
  EXPECT_EQ(truth.of(Epoch::kT1).depth_m, changing.of(Epoch::kT1).depth_m);
  EXPECT_NE(truth.of(Epoch::kT2).depth_m, changing.of(Epoch::kT2).depth_m);
}

TEST(MakeScene, MovingDayChangesFortyPercentAndIsNotOneOfTheEleven) {
  EXPECT_EQ(scene_names().size(), 11u);
  EXPECT_EQ(all_scene_names().back(), "moving_day");
  for (const uint64_t seed : {1u, 2u, 3u}) {
    const SceneTruth truth =
        render(make_scene("moving_day", seed), small(12, 64), silent_progress());
    EXPECT_GE(changed_share(truth), 0.36) << seed;
    EXPECT_LE(changed_share(truth), 0.46) << seed;
  }
}

TEST(MakeScene, RefusesAnUnknownNameAndListsTheKnownOnes) {
  try {
    make_scene("moon", 1);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kUsage);
    EXPECT_NE(std::string(error.what()).find("living_room"), std::string::npos);
  }
}

TEST(MakeScene, SeedsDiffer) {
  const SyntheticScene a = make_scene("desk", 1), b = make_scene("desk", 2);
  const auto first_eye = [](const SyntheticScene& scene) {
    return camera_center(sample_path(scene, Epoch::kT1, 20)[0]);
  };
  EXPECT_GT((first_eye(a) - first_eye(b)).norm(), 1e-3);
}

TEST(MakeScene, EveryNameAndSeedHasRandomNumbersOfItsOwn) {
  std::set<uint64_t> keys;
  for (const std::string_view name : scene_names()) {
    for (const uint64_t seed : {0u, 1u, 2u, 3u}) keys.insert(make_scene(name, seed).key);
  }
  EXPECT_EQ(keys.size(), 4 * scene_names().size());
}

}  // namespace
}  // namespace vggtcd
