// SPDX-License-Identifier: Apache-2.0
// Frames of a video as photos, by OpenCV's reader where the build has it.
#pragma once

#include <string>
#include <vector>

#include "vggtcd/io/photo_source.h"

namespace vggtcd {

// The sharpest frame of each of `frames` equal stretches of the video, in order. Two passes: the
// first measures sharpness, the second decodes the chosen frames. Throws Error{kInput} for a file
// without frames, Error{kUnavailable} in a build without video.
std::vector<PhotoRef> read_video(const std::string& path, int frames, ProgressSink& progress);

}  // namespace vggtcd
