// SPDX-License-Identifier: Apache-2.0
// batch_file: the network's input and output as .npz: VGGT's own keys (docs/formats.md).
#pragma once

#include <filesystem>

#include "vggtcd/vggt/image_batch.h"
#include "vggtcd/vggt/model.h"

namespace vggtcd {

// Pre-processed input: the key images, [S, 3, H, W] in [0, 1], and names if there. Throws
// Error{kInput} for another shape, values outside [0, 1] (by more than 1e-3) or not finite.
ImageBatch read_image_batch(const std::filesystem::path& path);

// The keys of VGGT's demo: images, extrinsic, intrinsic, depth, depth_conf, pose_enc; world_points
// and world_points_conf if the prediction has them; and names. f32. Throws Error{kOutput}.
void write_prediction(const std::filesystem::path& path, const ImageBatch& images,
                      const Prediction& prediction);

}  // namespace vggtcd
