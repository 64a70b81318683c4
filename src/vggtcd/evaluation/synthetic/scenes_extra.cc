// SPDX-License-Identifier: Apache-2.0
// Scenes beside the eleven, each for one limit.
#include "vggtcd/evaluation/synthetic/scenes.h"

namespace vggtcd {

// A furnished room before, cartons after: 40 % of what the photos show is other than it was.
void build_moving_day(SceneBuilder& b) {
  const Eigen::Vector3d room(6.0, 5.0, 2.7);
  const int walls = b.material(Texture::kPlaster, {0.66f, 0.63f, 0.57f}, {0, 0, 0}, 1);
  const int boards = b.wood();
  b.room(room, walls, boards);
  for (const double x : {-1.8, -0.2}) {
    b.removed("bookshelf", b.bookshelf({1.3, 0.35, 2.1}), at(x, -2.3, 0, 180));
  }
  b.removed("sofa", b.sofa(2.0), at(-0.6, -1.0, 0, 176));
  b.fixed("armchair", b.sofa(0.95), at(1.9, -1.0, 0, 140));
  b.removed("table", b.table({1.1, 0.6, 0.45}), at(-0.2, 0.1, 0, 8));
  b.fixed("radiator", b.cupboard({1.2, 0.14, 0.6}, false), at(2.2, -2.4, 0, 180));
  b.fixed("plant", b.plant(1.2), at(2.5, -1.7, 0));
  for (int k = 0; k < 8; ++k) {
    const double x = -1.8 + 1.1 * (k % 4);
    const double side_m = b.random.uniform(0.6, 0.75);
    b.added("carton", b.carton({side_m, side_m, 0.62}), at(x, -1.3, k < 4 ? 0 : 0.62, 4.0 * k));
  }
  b.lamplight(room);
  arc_walk(b, Epoch::kT1, 40, {{0, -1.3, 0.8}, 3.0, 48, 120, 1.6});
  arc_walk(b, Epoch::kT2, 40, {{0.1, -1.3, 0.8}, 2.9, 128, 60, 1.55});
  b.scene.scale_t2_from_t1 = 1.4;
}

}  // namespace vggtcd
