// SPDX-License-Identifier: Apache-2.0
// SceneBuilder: materials, furniture and clutter, so that a scene reads as a list of things.
#pragma once

#include <string>

#include "vggtcd/evaluation/synthetic/random.h"
#include "vggtcd/evaluation/synthetic/scene.h"

namespace vggtcd {

// What may happen to each of n small things.
struct ClutterChanges {
  int unchanged = 4, removed = 1, added = 1, moved = 1;
};

class SceneBuilder {
 public:
  SceneBuilder(std::string_view name, uint64_t seed);

  SyntheticScene scene;
  Random random;  // never twice in one call's arguments: compilers differ in their order

  // --- materials, each with a seed of its own
  int material(Texture texture, const Eigen::Vector3f& color, const Eigen::Vector3f& second,
               double feature_m, double gloss = 0);
  int wood();
  int metal();
  int paint();
  int fabric();
  int poster(double page_m);
  int books();
  int text(double line_m);
  int foliage();
  int ceramic();

  // --- objects; meshes stand on z = 0 of their own frame, around its origin
  void fixed(std::string name, Mesh mesh, const Rigid3& pose);
  void removed(std::string name, Mesh mesh, const Rigid3& pose_t1);
  void added(std::string name, Mesh mesh, const Rigid3& pose_t2);
  void moved(std::string name, Mesh mesh, const Rigid3& pose_t1, const Rigid3& pose_t2);
  // A panel that turns by an angle about an axis of its own frame (doors, lids).
  void swung(std::string name, Mesh mesh, const Rigid3& pose_t1, const Eigen::Vector3d& axis,
             double angle_deg);

  // Small things without overlap on a horizontal rectangle centred at `pose`, of about `size_m`.
  void clutter(const Rigid3& pose, const Eigen::Vector2d& extent_m, double size_m,
               const ClutterChanges& changes);

  // --- furniture
  Mesh table(const Eigen::Vector3d& size_m);
  Mesh chair();
  Mesh sofa(double width_m);
  Mesh cupboard(const Eigen::Vector3d& size_m, bool with_front);
  Mesh door_panel(double width_m, double height_m, int material_index);  // hinged at its origin
  Mesh bookshelf(const Eigen::Vector3d& size_m);
  Mesh framed_poster(double width_m, double height_m);  // stands upright, faces +y
  Mesh monitor(double width_m);
  Mesh plant(double height_m);
  Mesh carton(const Eigen::Vector3d& size_m);
  Mesh small_thing(double size_m);
  // --- outdoors
  Mesh tree(double height_m);
  Mesh car(int body_material, bool with_trunk_lid);
  Mesh facade(double width_m, double height_m);  // a wall with windows, faces +y
  Mesh bench();
  Mesh bin();
  Mesh parasol();
  Mesh lounger();
  Mesh hedge(const Eigen::Vector3d& size_m);
  Mesh bicycle();

  // A closed room around the origin: floor, ceiling, four walls with pictures.
  void room(const Eigen::Vector3d& size_m, int wall_material, int floor_material);
  // Light of both epochs, similar but not equal.
  void daylight();
  void lamplight(const Eigen::Vector3d& room_m);

 private:
  Eigen::Vector3f varied(const Eigen::Vector3f& color);
  void add_leaves(Mesh& mesh, int leaves, double radius_m, double spread_m, double height_m);
};

}  // namespace vggtcd
