// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/reconstruction/photo_cameras.h"

#include <gmock/gmock.h>

namespace vggtcd {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;

Exif of(const char* lens, double focal_mm, double focal_35mm, double zoom = 0) {
  return {.make = "Maker",
          .model = "Phone",
          .lens = lens,
          .focal_mm = focal_mm,
          .focal_35mm = focal_35mm,
          .digital_zoom = zoom};
}

TEST(PhotoCameras, OneLensIsOneCameraOfUnknownFocalLength) {
  const Exif photos[] = {of("wide", 6.9, 26), of("wide", 6.9, 26, 1), of("wide", 6.9, 26)};
  const PhotoCameras cameras = photo_cameras(photos);
  EXPECT_THAT(cameras.camera_of, ElementsAre(0, 0, 0));
  EXPECT_THAT(cameras.focal_of, ElementsAre(0));
  const Exif without[2] = {};
  EXPECT_THAT(photo_cameras(without).camera_of, ElementsAre(0, 0));
  EXPECT_THAT(photo_cameras(without).focal_of, ElementsAre(0));
}

TEST(PhotoCameras, LensFocalLengthAndZoomTellCamerasApart) {
  const Exif photos[] = {of("wide", 6.9, 26),    of("tele", 9, 77), of("wide", 6.9, 26), Exif(),
                         of("wide", 6.9, 52, 2), of("wide", 7.9, 0)};
  const PhotoCameras cameras = photo_cameras(photos);
  EXPECT_THAT(cameras.camera_of, ElementsAre(0, 1, 0, 2, 3, 4));
  EXPECT_THAT(cameras.focal_of,
              ElementsAre(DoubleNear(26 / 36.0, 1e-12), DoubleNear(77 / 36.0, 1e-12), 0,
                          DoubleNear(52 / 36.0, 1e-12), 0));
}

}  // namespace
}  // namespace vggtcd
