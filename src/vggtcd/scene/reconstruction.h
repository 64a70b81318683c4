// SPDX-License-Identifier: Apache-2.0
// Reconstruction: what one forward pass gives: cameras, depth and confidence per pixel, in a frame
// and scale of its own ("model units", _u).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/geometry/pinhole.h"
#include "vggtcd/geometry/rigid3.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/image.h"

namespace vggtcd {

// One photo: where it was taken and how it projects.
struct View {
  Rigid3 camera_from_world;
  Pinhole pinhole;
  std::string name;  // the photo's file name, or "frame_000012" if it is not known
};

// All frames have one size. A pixel without depth has depth 0.
struct Reconstruction {
  int height = 0, width = 0;
  std::vector<View> views;   // S of them
  std::vector<float> depth;  // [S, H, W], z along the optical axis in model units, >= 0, finite
  std::vector<float> confidence;  // [S, H, W], only ever ranked; not a probability
  std::vector<uint8_t> color;     // [S, H, W, 3] RGB
  // [S, H, W]: which pixels without depth show the sky (scene/sky.h); empty: none, or nobody
  // looked.
  std::vector<uint8_t> sky{};
  // Where this frame's origin lies in the world of the file that was read; the axes and the unit
  // are the file's. Not zero only where the file's own origin is far away (local_frame.h).
  Eigen::Vector3d origin_in_world = Eigen::Vector3d::Zero();
  // Frames that the prediction file has and this has not (nobody knows where they were taken), by
  // their numbers in the file, ascending. Whoever names a frame by a number means the file's.
  std::vector<int> left_out{};

  int frames_in_file() const { return num_frames() + static_cast<int>(left_out.size()); }
  std::optional<int> frame_of_number(int number_in_file) const;  // nothing: left out, or not there
  int number_of_frame(int frame) const;

  int num_frames() const { return static_cast<int>(views.size()); }
  size_t pixels_per_frame() const {
    return static_cast<size_t>(height) * static_cast<size_t>(width);
  }
  size_t num_pixels() const { return pixels_per_frame() * views.size(); }

  std::span<const float> frame_depth(int frame) const { return frame_of(depth, frame, 1); }
  std::span<const float> frame_confidence(int frame) const {
    return frame_of(confidence, frame, 1);
  }
  std::span<const uint8_t> frame_color(int frame) const { return frame_of(color, frame, 3); }
  std::span<const uint8_t> frame_sky(int frame) const {  // empty where sky is
    return sky.empty() ? std::span<const uint8_t>() : frame_of(sky, frame, 1);
  }

 private:
  template <typename T>
  std::span<const T> frame_of(const std::vector<T>& array, int frame, size_t channels) const {
    const size_t size = pixels_per_frame() * channels;
    return std::span(array).subspan(static_cast<size_t>(frame) * size, size);
  }
};

// The reconstruction of K keyframes of each epoch in one pass: T1's frames first, then T2's.
struct JointReconstruction {
  Reconstruction reconstruction;
  std::vector<int> keyframes_t1;  // 0-based frame numbers in the before epoch
  std::vector<int> keyframes_t2;  // 0-based frame numbers in the after epoch
};

// The frame that shows the photo of this name; or, if no photo is called so, the frame of this
// number in the file from 0 (a name wins over a number: photos may be named 0, 1, 2 anyhow).
std::optional<int> find_frame(const Reconstruction& reconstruction, std::string_view photo);

// Removes the frames k with remove[k] and notes them in left_out, which must be empty.
void remove_frames(Reconstruction& reconstruction, const std::vector<bool>& remove);

// Throws Error{kInternal} unless the arrays have the sizes that the header promises. For readers
// and generators of reconstructions: what they hand over has passed this.
void check_consistent(const Reconstruction& reconstruction);

}  // namespace vggtcd
