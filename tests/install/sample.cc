// SPDX-License-Identifier: Apache-2.0
// Uses the installed library as a stranger would: headers and targets only.
#include <vggtcd/change/nearest_distance.h>
#include <vggtcd/core/version.h>
#include <vggtcd/scene/keyframes.h>

#include <cstdio>

int main() {
  const auto keyframes = vggtcd::select_keyframes(84, 5);
  vggtcd::ChangeOptions().validate();
  std::printf("vggtcd %s: last keyframe %d\n", vggtcd::kVersion, keyframes.back());
  return keyframes.back() == 83 ? 0 : 1;
}
