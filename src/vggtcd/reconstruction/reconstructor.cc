// SPDX-License-Identifier: Apache-2.0
// Reconstructor: what all of them share.
#include "vggtcd/reconstruction/reconstructor.h"

#include "vggtcd/scene/keyframes.h"

namespace vggtcd {
namespace {

void append_frame(const Reconstruction& from, int frame, Reconstruction& to) {
  const auto append = [](auto& target, const auto& values) {
    target.insert(target.end(), values.begin(), values.end());
  };
  to.views.push_back(from.views[static_cast<size_t>(frame)]);
  append(to.depth, from.frame_depth(frame));
  append(to.confidence, from.frame_confidence(frame));
  append(to.color, from.frame_color(frame));
}

}  // namespace

std::vector<int> numbers_in_file(const EpochPhotos& epoch, const std::vector<int>& keyframes) {
  std::vector<int> numbers = keyframes;
  for (int& number : numbers) {
    if (epoch.given) number = epoch.given->number_of_frame(number);
  }
  return numbers;
}

JointReconstruction joint_of_keyframes(const Reconstruction& before, const Reconstruction& after,
                                       int keyframes) {
  check(before.width == after.width && before.height == after.height,
        "joint_of_keyframes: one frame size");
  JointReconstruction joint;
  joint.keyframes_t1 = select_keyframes(before.num_frames(), keyframes);
  joint.keyframes_t2 = select_keyframes(after.num_frames(), keyframes);
  joint.reconstruction.width = before.width;
  joint.reconstruction.height = before.height;
  for (const int frame : joint.keyframes_t1) append_frame(before, frame, joint.reconstruction);
  for (const int frame : joint.keyframes_t2) append_frame(after, frame, joint.reconstruction);
  check_consistent(joint.reconstruction);
  return joint;
}

}  // namespace vggtcd
