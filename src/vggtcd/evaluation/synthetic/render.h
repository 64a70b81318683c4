// SPDX-License-Identifier: Apache-2.0
// Photos, depth maps and change labels of a generated scene (definitions in docs/synthetic.md).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "vggtcd/core/progress.h"
#include "vggtcd/evaluation/synthetic/scene.h"
#include "vggtcd/scene/image.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct RenderOptions {
  int frames = 0;
  int width = 518;
  int photo_scale = 2;
  int samples = 2;
  double label_resolution = 0.003;
  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("frames", self.frames, "frames per epoch; 0: the scene's own number (20 to 100)");
    field("width", self.width,
          "width of depth maps and labels in px, even; height is 392/518 of it");
    field("photo_scale", self.photo_scale, "photos are this many times larger; 1 to 4");
    field("samples", self.samples, "rays per photo pixel and axis; 1 to 4");
    field(
        "label_resolution", self.label_resolution,
        "share of the scene extent: a changed object's surface closer than this to any surface of "
        "the other epoch is not evaluated; > 0");
  };
  void validate() const;
};

// Values of the label maps.
constexpr uint8_t kLabelUnchanged = 0, kLabelChanged = 1, kLabelVoid = 255;

// What is known of one epoch. Depth, labels and colours are [S, H, W] at `width`; views are in
// world metres.
struct EpochTruth {
  int height = 0, width = 0;
  std::vector<View> views;
  std::vector<float> depth_m;         // z along the optical axis; 0: sky
  std::vector<uint8_t> color;         // [S, H, W, 3], the photo averaged down
  std::vector<uint16_t> object;       // 1 + index into the scene's objects; 0: sky
  std::vector<uint8_t> label;         // unchanged, changed, void
  std::vector<uint8_t> other_looked;  // 1: some camera of the other epoch sees this place

  int num_frames() const { return static_cast<int>(views.size()); }
  size_t pixels_per_frame() const {
    return static_cast<size_t>(height) * static_cast<size_t>(width);
  }
};

struct SceneTruth {
  EpochTruth epoch[2];
  double extent_m = 0;  // largest axis of the 1st to 99th percentile box of all visible points

  const EpochTruth& of(Epoch which) const { return epoch[static_cast<int>(which)]; }
};

// Share of the pixels that show a surface, both epochs together, that are labelled changed.
double changed_share(const SceneTruth& truth);

// Called for each photo in order: T1's frames, then T2's.
using PhotoSink = std::function<void(Epoch, int frame, const Image& photo)>;

SceneTruth render(const SyntheticScene& scene, const RenderOptions& options, ProgressSink& progress,
                  const PhotoSink& photo_sink = {});

// The pinhole of a photo that is `scale` times the size of a depth map.
Pinhole scaled_pinhole(const Pinhole& pinhole, int scale);

}  // namespace vggtcd
