// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/change/instances.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "tests/support/toy_scene.h"
#include "vggtcd/change/free_space.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

using testing_support::flat_relief;
using testing_support::kT2FromT1;
using testing_support::reconstruct;
using testing_support::ToyScene;

// Boxes of 0.5 height on the plane.
bool in_square(double x, double y, double cx, double cy, double half) {
  return std::abs(x - cx) < half && std::abs(y - cy) < half;
}
double left_box(double x, double y) { return in_square(x, y, -0.9, 0, 0.3) ? 0.5 : 0.0; }
double right_box(double x, double y) { return in_square(x, y, 0.9, 0, 0.3) ? 0.5 : 0.0; }
double both_boxes(double x, double y) { return left_box(x, y) + right_box(x, y); }

struct Case {
  Reconstruction before, after;
  ChangeSet changes;
};

Case make_case(double (*before)(double, double), double (*after)(double, double)) {
  const auto scene = [](double (*relief)(double, double), double offset) {
    return ToyScene{
        .frames = 5, .width = 96, .height = 72, .camera_offset = offset, .relief = relief};
  };
  Case c{reconstruct(scene(before, 0), Sim3{}), reconstruct(scene(after, 0.1), kT2FromT1), {}};
  c.changes = detect_changes(c.before, c.after, kT2FromT1, {});
  decide_by_labels(free_space_changes(c.before, c.after, kT2FromT1, {}), c.changes);
  return c;
}

ChangeInstances instances_of(const Case& c, const InstanceOptions& options = {}) {
  return find_instances(c.before, c.after, kT2FromT1, c.changes, options);
}

TEST(FindInstances, ABoxThatAppearedIsOneAddedThingWhereItStands) {
  const Case c = make_case(flat_relief, right_box);
  const ChangeInstances found = instances_of(c);
  ASSERT_EQ(found.instances.size(), 1u);
  const ChangeInstance& box = found.instances[0];
  EXPECT_EQ(box.kind, InstanceClass::kAdded);
  EXPECT_FALSE(box.before);
  // The top of the box is at z = 4.5 in the scene; its sides reach down to 5.
  const Eigen::Vector3d center = kT2FromT1.inverse() * box.after->box.center;
  EXPECT_NEAR(center.x(), 0.9, 0.1);
  EXPECT_NEAR(center.y(), 0.0, 0.1);
  EXPECT_NEAR(center.z(), 4.65, 0.2);
  EXPECT_NEAR(box.after->box.size[0] / kT2FromT1.scale, 0.6, 0.12);
  EXPECT_NEAR(box.after->box.rotation.determinant(), 1, 1e-9);
}

TEST(FindInstances, PixelsCarryTheIdOfTheirThingAndOnlyChangedPixelsDo) {
  const Case c = make_case(flat_relief, both_boxes);
  const ChangeInstances found = instances_of(c);
  ASSERT_EQ(found.instances.size(), 2u);
  std::vector<int64_t> pixels(3);
  for (size_t i = 0; i < found.id_t2.size(); ++i) {
    const int32_t id = found.id_t2[i];
    ASSERT_GE(id, 0);
    ASSERT_LE(id, 2);
    ++pixels[static_cast<size_t>(id)];
    if (id > 0) {
      EXPECT_EQ(c.changes.t2.label[i], ChangeLabel::kAdded);
    }
  }
  EXPECT_EQ(pixels[1], found.instances[0].after->pixels);
  EXPECT_EQ(pixels[2], found.instances[1].after->pixels);
  EXPECT_EQ(std::set<int32_t>(found.id_t1.begin(), found.id_t1.end()), std::set<int32_t>{0});
}

// Gives all changed pixels of an epoch one colour.
void paint_changes(Reconstruction& epoch, const EpochChange& change, uint8_t r, uint8_t g,
                   uint8_t b) {
  for (size_t i = 0; i < epoch.num_pixels(); ++i) {
    if (!is_change(change.label[i])) continue;
    epoch.color[3 * i] = r;
    epoch.color[3 * i + 1] = g;
    epoch.color[3 * i + 2] = b;
  }
}

TEST(FindInstances, ABoxThatWentFromLeftToRightMoved) {
  Case c = make_case(left_box, right_box);
  paint_changes(c.before, c.changes.t1, 200, 30, 30);
  paint_changes(c.after, c.changes.t2, 200, 30, 30);
  const ChangeInstances found = instances_of(c);
  ASSERT_EQ(found.instances.size(), 1u);
  const ChangeInstance& box = found.instances[0];
  EXPECT_EQ(box.kind, InstanceClass::kMoved);
  ASSERT_TRUE(box.before && box.after);
  const Eigen::Vector3d way =
      kT2FromT1.inverse().rotation * (box.after->box.center - box.before->box.center);
  EXPECT_NEAR(way.x() / kT2FromT1.scale, 1.8, 0.15);
  for (const auto* ids : {&found.id_t1, &found.id_t2}) {
    EXPECT_GT(std::ranges::count(*ids, 1), 200);  // of some 300 in five photos
  }
}

TEST(FindInstances, WithoutTheSameColoursNothingMoved) {
  Case c = make_case(left_box, right_box);
  paint_changes(c.before, c.changes.t1, 30, 30, 200);
  paint_changes(c.after, c.changes.t2, 200, 30, 30);
  const ChangeInstances found = instances_of(c);
  ASSERT_EQ(found.instances.size(), 2u);
  EXPECT_NE(found.instances[0].kind, InstanceClass::kMoved);
}

TEST(FindInstances, VolumeIsThatOfTheBoxWithinItsUncertaintyAndACell) {
  const Case c = make_case(flat_relief, right_box);
  const ChangeInstances found = instances_of(c);
  ASSERT_EQ(found.instances.size(), 1u);
  const InstancePart& part = *found.instances[0].after;
  const double truth = 0.6 * 0.6 * 0.5 * std::pow(kT2FromT1.scale, 3);
  // Cells of 1/32 of the edge, pixels of 1/30: each face may be off by one of either.
  EXPECT_NEAR(part.volume_u3, truth, 0.2 * truth);
  EXPECT_GT(part.volume_sigma_u3, 0);
}

TEST(FindInstances, TheBestPhotoShowsTheMostOfIt) {
  const Case c = make_case(flat_relief, right_box);
  const ChangeInstances found = instances_of(c);
  ASSERT_EQ(found.instances.size(), 1u);
  const size_t per_frame = c.after.pixels_per_frame();
  std::vector<int64_t> pixels(c.after.views.size());
  for (size_t i = 0; i < found.id_t2.size(); ++i) pixels[i / per_frame] += found.id_t2[i] == 1;
  const InstancePhoto& best = found.instances[0].after->photos.front();
  EXPECT_EQ(best.pixels, pixels[static_cast<size_t>(best.frame)]);
  EXPECT_EQ(found.instances[0].after->photos.size(), 3u);
}

TEST(FindInstances, ThingsBelowTheMinimumSizeAreLeftOut) {
  const Case c = make_case(flat_relief, right_box);
  EXPECT_FALSE(instances_of(c).instances.empty());
  EXPECT_TRUE(instances_of(c, {.min_size_fraction = 0.9}).instances.empty());
  EXPECT_TRUE(instances_of(c, {.min_width_fraction = 0.9}).instances.empty());
  EXPECT_TRUE(instances_of(c, {.min_photos = c.after.num_frames() + 1}).instances.empty());
}

TEST(FindInstances, ThingsOfWhichTheVotesAreUnsureAreLeftOut) {
  Case c = make_case(flat_relief, right_box);
  std::ranges::fill(c.changes.t2.changed_confidence, 0.5f);
  const ChangeInstances found = instances_of(c);
  EXPECT_TRUE(found.instances.empty());
  EXPECT_EQ(found.unsure, 0);  // too unsure to speak of
  EXPECT_EQ(instances_of(c, {.min_confidence = 0}).instances.size(), 1u);
}

TEST(FindInstances, WhatIsNearlySureEnoughIsCounted) {
  const Case c = make_case(flat_relief, right_box);
  const ChangeInstances listed = instances_of(c);
  ASSERT_EQ(listed.instances.size(), 1u);
  EXPECT_EQ(listed.unsure, 0);
  const ChangeInstances counted = instances_of(c, {.min_confidence = 1});
  EXPECT_TRUE(counted.instances.empty());
  EXPECT_EQ(counted.unsure, 1);
  EXPECT_DOUBLE_EQ(counted.unsure_confidence, listed.instances[0].confidence());
}

TEST(FindInstances, WhatOnlyAFewPhotosOfItsEpochCallChangedIsLessLikely) {
  Case c = make_case(flat_relief, right_box);
  const ChangeInstances all = instances_of(c);
  ASSERT_EQ(all.instances.size(), 1u);
  // The last two of five photos take it all back.
  EpochChange& change = c.changes.t2;
  std::vector<float> confidence, evidence;
  for (size_t i = 0, k = 0; i < change.label.size(); ++i) {
    if (!is_change(change.label[i])) continue;
    if (i < 3 * c.after.pixels_per_frame()) {
      confidence.push_back(change.changed_confidence[k]);
      evidence.push_back(change.changed_evidence[k]);
    } else {
      change.label[i] = ChangeLabel::kUnchanged;
    }
    ++k;
  }
  change.changed_confidence = confidence;
  change.changed_evidence = evidence;
  const ChangeInstances fewer = instances_of(c, {.min_confidence = 0});
  ASSERT_EQ(fewer.instances.size(), 1u);
  const ThingSigns& signs = fewer.instances[0].after->signs;
  EXPECT_EQ(signs.photos, 3);
  EXPECT_LT(signs.called_changed, 0.7);
  EXPECT_LT(fewer.instances[0].confidence(), all.instances[0].confidence());
}

TEST(FindInstances, SpecksThatAreFarApartForTheirNumberAreLeftOut) {
  Case c = make_case(flat_relief, right_box);
  EXPECT_EQ(instances_of(c, {.min_fill = 0.5}).instances.size(), 1u);
  // A box has three times the surface of its largest face at most in sight.
  EXPECT_TRUE(instances_of(c, {.min_fill = 4}).instances.empty());
}

TEST(FindInstances, WithoutChangeThereAreNone) {
  const Case c = make_case(right_box, right_box);
  EXPECT_TRUE(instances_of(c).instances.empty());
}

TEST(FindInstances, SameIdsForAnyNumberOfThreads) {
  const Case c = make_case(left_box, both_boxes);
  set_num_threads(1);
  const ChangeInstances one = instances_of(c);
  set_num_threads(5);
  const ChangeInstances five = instances_of(c);
  set_num_threads(2);
  EXPECT_EQ(one.id_t1, five.id_t1);
  EXPECT_EQ(one.id_t2, five.id_t2);
  ASSERT_EQ(one.instances.size(), five.instances.size());
  for (size_t i = 0; i < one.instances.size(); ++i) {
    EXPECT_EQ(one.instances[i].volume_u3(), five.instances[i].volume_u3());
  }
}

// A camera of 90 degrees at the origin looking along z at a plane at z = 2 tilted about y by
// `slope`.
struct Plane {
  std::vector<float> depth;
  PosedView view;
  explicit Plane(double slope) : depth(41 * 41) {
    view.pinhole = {20, 20, 20, 20, 41, 41};
    for (int v = 0; v < 41; ++v) {
      for (int u = 0; u < 41; ++u) {  // z = 2 + slope x, x = z (u - cx) / fx
        depth[static_cast<size_t>(41 * v + u)] =
            static_cast<float>(2 / (1 - slope * (u - 20) / 20.0));
      }
    }
    view.depth = depth;
  }
};

TEST(PixelArea, OfAPlaneIsThatOfThePlane) {
  for (const double slope : {0.0, 0.4}) {
    const Plane plane(slope);
    double sum = 0, z_lo = 1e9;
    for (int v = 10; v <= 30; ++v) {
      for (int u = 18; u <= 22; ++u) {
        sum += pixel_area(plane.view, u, v);
        z_lo = std::min(z_lo, static_cast<double>(plane.depth[static_cast<size_t>(41 * v + u)]));
      }
    }
    // The trapezium between the rays of columns 17.5 and 22.5, rows 9.5 to 30.5, by integration.
    double truth = 0;
    for (int k = 0; k < 5000; ++k) {
      const double u = 17.5 + (k + 0.5) / 1000, z = 2 / (1 - slope * (u - 20) / 20.0);
      const double dz = z * z / 2 * slope / 20, dx = z / 20 + dz * (u - 20) / 20;
      truth += std::hypot(dx, dz) * (21.0 * z / 20) / 1000;
    }
    EXPECT_NEAR(sum, truth, 0.02 * truth);  // central differences over two pixels
  }
}

// How far along a ray a body at the origin is; 0: misses it.
using Body = double (*)(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray);
double ball(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {  // radius 0.5
  const double half = -ray.dot(origin) / ray.squaredNorm();
  const double under = half * half - (origin.squaredNorm() - 0.25) / ray.squaredNorm();
  return under < 0 ? 0 : half - std::sqrt(under);
}
double cube(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {  // edges of 0.8
  const Eigen::Array3d a = (-0.4 - origin.array()) / ray.array(),
                       b = (0.4 - origin.array()) / ray.array();
  const double first = a.min(b).maxCoeff(), last = a.max(b).minCoeff();
  return first < last ? first : 0;
}

// A body seen by eight cameras from 3 away, a little above; each puts it at `misplaced` of its
// depth too far, every second one too near. It is some 50 pixels across.
struct Seen {
  static constexpr int kSize = 101;
  std::vector<std::vector<float>> depth;
  std::vector<PosedView> views;
  std::vector<SeenPixel> pixels;

  Seen(Body body, double misplaced) {
    for (int k = 0; k < 8; ++k) {
      const double turn = (k + 0.3) * M_PI / 4;
      const Eigen::Vector3d center =
          3 * Eigen::Vector3d(std::cos(turn), 0.5, std::sin(turn)).normalized();
      const Eigen::Vector3d z = -center.normalized();
      const Eigen::Vector3d x = Eigen::Vector3d::UnitY().cross(z).normalized();
      PosedView view;
      view.pinhole = {150, 150, 50, 50, kSize, kSize};
      view.camera_from_t2.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
      view.camera_from_t2.translation = -view.camera_from_t2.rotation * center;
      depth.emplace_back(kSize * kSize, 0.0f);
      const double factor = 1 + (k % 2 == 0 ? misplaced : -misplaced);
      for (int v = 0; v < kSize; ++v) {
        for (int u = 0; u < kSize; ++u) {
          const Eigen::Vector3d ray =
              view.camera_from_t2.rotation.transpose() * view.pinhole.unproject(u, v, 1.0);
          const double at = factor * body(center, ray);
          if (!(at > 0)) continue;
          depth.back()[static_cast<size_t>(kSize * v + u)] = static_cast<float>(at);
          pixels.push_back({(center + at * ray).cast<float>(), static_cast<size_t>(k), u, v});
        }
      }
      views.push_back(view);
    }
    for (size_t k = 0; k < views.size(); ++k) views[k].depth = depth[k];
  }
  SeenSurface surface(size_t step = 1) const {
    std::vector<SeenPixel> sample;
    for (size_t i = 0; i < pixels.size(); i += step) sample.push_back(pixels[i]);
    return seen_surface(sample,
                        static_cast<double>(pixels.size()) / static_cast<double>(sample.size()),
                        views, [&](size_t view, size_t pixel) { return depth[view][pixel] > 0; });
  }
};

TEST(SeenSurface, OfACubeIsThatOfTheFiveFacesInSight) {
  const double truth = 5 * 0.8 * 0.8;
  const Seen exact(cube, 0);
  // A pixel is a fiftieth of an edge, and the slope of one that holds an edge is that of one side.
  EXPECT_NEAR(exact.surface().area_u2, truth, 0.1 * truth);
  EXPECT_NEAR(exact.surface().area_u2, truth, 1.96 * exact.surface().sigma_u2);
  EXPECT_NEAR(exact.surface(7).area_u2, exact.surface().area_u2, 0.03 * truth);  // a sample
}

TEST(SeenSurface, IsNotCountedAgainWherePhotosMisplaceIt) {
  const Seen exact(cube, 0), misplaced(cube, 0.02);  // surfaces 0.12 apart, a seventh of an edge
  const double area = exact.surface().area_u2;
  EXPECT_NEAR(misplaced.surface().area_u2, area, 0.15 * area);
}

TEST(SeenSurface, OfABallIsThatOfThePartThatFacesACamera) {
  // By brute force: points evenly on the ball that face one of the cameras.
  const Seen seen(ball, 0);
  int in_sight = 0;
  constexpr int kPoints = 100000;
  for (int i = 0; i < kPoints; ++i) {
    const double y = 1 - 2 * (i + 0.5) / kPoints, turn = i * M_PI * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - y * y);
    const Eigen::Vector3d normal(r * std::cos(turn), y, r * std::sin(turn));
    in_sight += std::ranges::any_of(seen.views, [&](const PosedView& view) {
      const Eigen::Vector3d center =
          -view.camera_from_t2.rotation.transpose() * view.camera_from_t2.translation;
      return normal.dot(center - 0.5 * normal) > 0;
    });
  }
  const double truth = 4 * M_PI * 0.25 * in_sight / kPoints;
  // The rim of a view is lost where no other view looks at it.
  EXPECT_NEAR(seen.surface().area_u2, truth, 0.1 * truth);
}

TEST(FindInstances, SurfaceIsThatOfTheBoxThatPhotosSee) {
  const Case c = make_case(flat_relief, right_box);
  const ChangeInstances found = instances_of(c);
  ASSERT_EQ(found.instances.size(), 1u);
  const InstancePart& part = *found.instances[0].after;
  // The top is seen, one of the two sides across the walk, and two halves of those along it that
  // the middle of the walk looks past.
  const double unit = kT2FromT1.scale * kT2FromT1.scale;
  EXPECT_GT(part.surface_u2, 0.9 * 0.36 * unit);
  EXPECT_LT(part.surface_u2, (0.36 + 3 * 0.3) * unit);
  EXPECT_GT(part.surface_sigma_u2, 0);
  EXPECT_LT(part.surface_sigma_u2, part.surface_u2);
}

TEST(PrincipalBox, OfARotatedBoxOfPointsHasItsSizes) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-0.5, 0.5);
  const Eigen::Matrix3d axes =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d x(1.0 * unit(random), 3.0 * unit(random), 2.0 * unit(random));
    points.push_back((axes * x + Eigen::Vector3d(5, 6, 7)).cast<float>());
  }
  const OrientedBox box = principal_box(points);
  // 98 % of a uniform edge; the axes of 20 000 points are off by about a percent.
  EXPECT_TRUE(box.size.isApprox(0.98 * Eigen::Vector3d(3, 2, 1), 0.02)) << box.size.transpose();
  EXPECT_TRUE(box.center.isApprox(Eigen::Vector3d(5, 6, 7), 0.01));
  EXPECT_NEAR(std::abs(box.rotation.col(0).dot(axes.col(1))), 1, 1e-3);
}

const PixelVerdict kNothingJudged = [](size_t, size_t) { return std::optional<bool>(); };

TEST(OwnTestimony, SeenThroughIsTheShareOfTheViewsThatThePointIsNotHiddenFrom) {
  const Plane near(0), far(0);  // both at z = 2
  Plane nearer(0);
  for (float& depth : nearer.depth) depth = 1.0f;
  const PosedView plane[] = {near.view, far.view};
  const PosedView mixed[] = {near.view, far.view, nearer.view};
  const SeenPoint on{{0, 0, 2}, 0}, before{{0, 0, 1.5f}, 0}, just{{0, 0, 1.95f}, 0};
  const auto share = [](const std::vector<SeenPoint>& points, std::span<const PosedView> views) {
    return own_testimony(points, views, kNothingJudged).seen_through;
  };
  EXPECT_EQ(share({on}, plane), 0);
  EXPECT_EQ(share({before}, plane), 1);
  EXPECT_EQ(share({just}, plane), 0);  // within 3 %
  EXPECT_EQ(share({before, on}, plane), 0.5);
  EXPECT_EQ(share({before}, mixed), 1);                      // hidden from the third
  EXPECT_EQ(share({before}, std::span(plane).first(1)), 0);  // its own
}

TEST(OwnTestimony, CalledChangedIsTheShareOfTheViewsThatSeeThePointsSurface) {
  const Plane first(0), second(0), third(0);
  const PosedView views[] = {first.view, second.view, third.view};
  // Every view calls the left half of its photo changed; the third judges nothing.
  const PixelVerdict left = [](size_t view, size_t pixel) {
    return view == 2 ? std::optional<bool>() : std::optional(pixel % 41 < 20);
  };
  const SeenPoint on_left{{-0.5f, 0, 2}, 0}, on_right{{0.5f, 0, 2}, 0}, flying{{-0.4f, 0, 1.5f}, 0};
  const auto share = [&](const std::vector<SeenPoint>& points) {
    return own_testimony(points, views, left).called_changed;
  };
  EXPECT_EQ(share({on_left}), 1);
  EXPECT_EQ(share({on_right}), 0);
  EXPECT_EQ(share({on_left, on_right}), 0.5);
  EXPECT_EQ(share({on_left, flying}), 1);  // nobody sees a surface where that flies
  EXPECT_EQ(share({flying}), 0);
}

TEST(ChangedSpace, IsWhatOneEpochSeesThroughAndTheOtherDoesNot) {
  Plane near(0), far(0);
  for (float& depth : near.depth) depth = 1.5f;
  const PosedView own[] = {near.view}, other[] = {far.view};  // far: at z = 2
  OrientedBox box;
  box.size = {0.4, 0.4, 0.4};
  box.center = {0, 0, 1.0};
  EXPECT_EQ(changed_space(box, own, other, 0, 16).volume_u3, 0);  // both see through
  box.center = {0, 0, 1.75};
  EXPECT_NEAR(changed_space(box, own, other, 0, 16).volume_u3, 0.064, 1e-9);
  box.center = {0, 0, 2.5};
  EXPECT_EQ(changed_space(box, own, other, 0, 16).volume_u3, 0);  // neither
  box.center = {0, 0, 2.0};                                       // half before the far wall
  EXPECT_NEAR(changed_space(box, own, other, 0, 16).volume_u3, 0.032, 1e-9);
  EXPECT_NEAR(changed_space(box, own, {}, 0, 16).volume_u3, 0.064, 1e-9);
}

TEST(ChangedSpace, GrowsAThinBoxToWhatTheOtherEpochSeesBehindIt) {
  Plane near(0), far(0);
  for (float& depth : near.depth) depth = 1.5f;
  const PosedView own[] = {near.view}, other[] = {far.view};
  OrientedBox sheet;
  sheet.size = {0.6, 0.6, 0.001};
  sheet.center = {0, 0, 1.5};
  const ChangedSpace space = changed_space(sheet, own, other, 0, 30);
  EXPECT_NEAR(space.volume_u3, 0.6 * 0.6 * 0.5, 0.6 * 0.6 * 0.02);  // a cell is 0.02
  EXPECT_NEAR(space.box.size[2], 0.5, 0.021);
  EXPECT_NEAR(space.box.center.z(), 1.75, 0.011);
}

TEST(ChangedSpace, KeepsTheEdgesOfAGrownBoxInTheOrderOfTheirLengths) {
  Plane near(0), far(0);
  for (float& depth : near.depth) depth = 1.5f;
  const PosedView own[] = {near.view}, other[] = {far.view};
  OrientedBox sheet;
  sheet.size = {0.6, 0.4, 0.001};
  sheet.center = {0, 0, 1.75};
  const OrientedBox box = changed_space(sheet, own, other, 0, 30).box;
  // Along z it now reaches from the near surface to the far one, in cells of 0.02.
  EXPECT_TRUE(box.size.isApprox(Eigen::Vector3d(0.6, 0.5, 0.4), 0.05)) << box.size.transpose();
  EXPECT_EQ(std::abs(box.rotation(2, 1)), 1);
  EXPECT_EQ(box.rotation.determinant(), 1);
}

TEST(InstanceOptions, RefuseAVoxelWithoutSize) {
  EXPECT_THROW(InstanceOptions{.link_fraction = 0}.validate(), Error);
}

}  // namespace
}  // namespace vggtcd
