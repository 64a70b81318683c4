// SPDX-License-Identifier: Apache-2.0
// Vggt: aggregator, then camera head, then one dense head per frame.
#include "vggtcd/vggt/model.h"

#include <algorithm>
#include <cmath>

#include "vggtcd/core/parallel.h"
#include "vggtcd/geometry/pose_encoding.h"
#include "vggtcd/io/weight_file.h"

namespace vggtcd {
namespace {

// Heads that this library does not have.
constexpr std::array<std::string_view, 1> kForeignModules = {"track_head."};

void set_views(const ImageBatch& images, Prediction& prediction) {
  Reconstruction& r = prediction.reconstruction;
  r.height = static_cast<int>(images.height);
  r.width = static_cast<int>(images.width);
  for (size_t s = 0; s < prediction.pose_enc.size(); ++s) {
    const PoseEncoding& pose = prediction.pose_enc[s];
    View view{camera_from_world_of(pose), pinhole_of(pose, r.height, r.width),
              s < images.names.size() ? images.names[s] : fmt::format("frame_{:06}", s)};
    if (!view.camera_from_world.rotation.allFinite() ||
        !view.camera_from_world.translation.allFinite()) {
      throw_error(
          ErrorCode::kWeights,
          "the network's camera for {} is not finite: the weights are damaged or not VGGT's",
          view.name);
    }
    r.views.push_back(std::move(view));
  }
}

// [S, 3, H, W] in [0, 1] -> [S, H, W, 3] in 0 .. 255
std::vector<uint8_t> to_color(const ImageBatch& images) {
  const int64_t plane = images.height * images.width;
  std::vector<uint8_t> color(static_cast<size_t>(images.frames * plane * 3));
  parallel_for(images.frames, 1, [&](int64_t frame, int64_t) {
    for (int64_t c = 0; c < 3; ++c) {
      const float* source = images.pixels.data() + (frame * 3 + c) * plane;
      uint8_t* target = color.data() + frame * plane * 3 + c;
      for (int64_t p = 0; p < plane; ++p) {
        const float level = std::clamp(source[p], 0.0f, 1.0f) * 255.0f;
        target[3 * p] = static_cast<uint8_t>(std::lround(level));
      }
    }
  });
  return color;
}

// raw [H, W, 2] -> depth, confidence. A depth that is not finite is no depth: 0.
void split_depth(const std::vector<float>& raw, float* depth, float* confidence) {
  const auto pixels = static_cast<int64_t>(raw.size() / 2);
  parallel_for(pixels, 4096, [&](int64_t begin, int64_t end) {
    for (int64_t p = begin; p < end; ++p) {
      const float value = activate_depth(raw[static_cast<size_t>(2 * p)]);
      depth[p] = std::isfinite(value) ? value : 0.0f;
      confidence[p] = activate_confidence(raw[static_cast<size_t>(2 * p + 1)]);
    }
  });
}

// raw [H, W, 4] -> points, confidence
void split_points(const std::vector<float>& raw, float* points, float* confidence) {
  const auto pixels = static_cast<int64_t>(raw.size() / 4);
  parallel_for(pixels, 4096, [&](int64_t begin, int64_t end) {
    for (int64_t p = begin; p < end; ++p) {
      const float* in = raw.data() + 4 * p;
      for (int64_t c = 0; c < 3; ++c) points[3 * p + c] = activate_point(in[c]);
      confidence[p] = activate_confidence(in[3]);
    }
  });
}

}  // namespace

Vggt::Vggt(const WeightStore& store, const std::string& config_json, const VggtOptions& options)
    : config_(read_config(store, config_json)),
      precision_(resolve_precision(options.precision)),
      aggregator_(store.root().at("aggregator"), config_, product_types(precision_)),
      camera_head_(store.root().at("camera_head"), config_) {
  std::vector<std::string_view> ignored(kForeignModules.begin(), kForeignModules.end());
  const ProductTypes dense = product_types(precision_);
  if (options.depth_head) {
    depth_head_.emplace(store.root().at("depth_head"), config_, 2, dense, "depth_head");
  } else {
    ignored.push_back("depth_head.");
  }
  if (options.point_head) {
    point_head_.emplace(store.root().at("point_head"), config_, 4, dense, "point_head");
  } else {
    ignored.push_back("point_head.");
  }
  superfluous_ = store.untaken(ignored);
}

Vggt Vggt::load(const std::filesystem::path& path, const VggtOptions& options) {
  WeightFile file = open_weight_file(path);
  const auto config = file.metadata.find("config");
  // Tensors of a torch checkpoint may share memory or be copies, so only those of safetensors are
  // let go one by one: the file's pages and their packed copies are never all resident together.
  const bool disjoint = file.format == WeightFormat::kSafetensors;
  return from_tensors(std::move(file.tensors), config == file.metadata.end() ? "" : config->second,
                      path.string(), options, disjoint ? release_pages : ReleaseWeights());
}

Vggt Vggt::from_tensors(std::vector<TensorView> tensors, const std::string& config_json,
                        const std::string& source, const VggtOptions& options,
                        ReleaseWeights release) {
  const WeightStore store(std::move(tensors), source, std::move(release));
  return Vggt(store, config_json, options);
}

void Vggt::check_images(const ImageBatch& images) const {
  const int64_t patch = config_.patch_size;
  if (images.frames < 1 || images.height < patch || images.width < patch ||
      images.height % patch != 0 || images.width % patch != 0) {
    throw_error(ErrorCode::kInput,
                "images: expected at least one frame of a height and width that are multiples of "
                "{}, found {} of {}x{} (width x height); pre-process the photos first",
                patch, images.frames, images.width, images.height);
  }
  check(std::ssize(images.pixels) == images.frames * 3 * images.height * images.width,
        "images: pixels are [S, 3, H, W]");
  check(images.names.empty() || std::ssize(images.names) == images.frames,
        "images: one name per frame");
}

VggtRun Vggt::run_of(const ImageBatch& images) const {
  return {images.frames, images.height,           images.width,
          precision_,    depth_head_.has_value(), point_head_.has_value()};
}

void Vggt::run_dense_heads(const ImageBatch& images, const AggregatedTokens& tokens,
                           Prediction& prediction, ProgressSink& progress,
                           const Trace& trace) const {
  DptWorkspace workspace;
  const size_t pixels = prediction.reconstruction.pixels_per_frame();
  std::vector<float> raw;
  const auto run = [&](const DptHead& head, VggtStage which, auto&& split) {
    ProgressStage stage(progress, std::string(stage_name(which)));
    raw.resize(pixels * static_cast<size_t>(head.outputs()));
    for (int64_t frame = 0; frame < images.frames; ++frame) {
      head.forward(tokens, frame, images.height, images.width, raw.data(), workspace, trace);
      split(static_cast<size_t>(frame) * pixels);
      stage.advance(static_cast<double>(frame + 1) / static_cast<double>(images.frames));
    }
    prediction.seconds[static_cast<size_t>(which)] = stage.seconds();
  };
  Reconstruction& r = prediction.reconstruction;
  r.depth.resize(r.num_pixels());
  r.confidence.resize(r.num_pixels());
  if (depth_head_) {
    run(*depth_head_, VggtStage::kDepth, [&](size_t first) {
      split_depth(raw, r.depth.data() + first, r.confidence.data() + first);
    });
  }
  if (point_head_) {
    prediction.world_points.resize(3 * r.num_pixels());
    prediction.world_points_conf.resize(r.num_pixels());
    run(*point_head_, VggtStage::kPoints, [&](size_t first) {
      split_points(raw, prediction.world_points.data() + 3 * first,
                   prediction.world_points_conf.data() + first);
    });
  }
}

Prediction Vggt::reconstruct(const ImageBatch& images, ProgressSink& progress,
                             const Trace& trace) const {
  check_images(images);
  Prediction prediction;
  // aggregated_tokens_list, patch_start_idx = self.aggregator(images)
  const AggregatedTokens tokens = [&] {
    ProgressStage stage(progress, "network");
    const VggtCost cost = cost_of(config_, run_of(images));
    const double all = cost.flop_of(VggtStage::kPatchEmbed) +
                       cost.flop_of(VggtStage::kFrameAttention) +
                       cost.flop_of(VggtStage::kGlobalAttention);
    double done = 0, last_s = 0;
    return aggregator_.forward(images, trace, [&](VggtStage which) {
      const double now_s = stage.seconds();
      prediction.seconds[static_cast<size_t>(which)] += now_s - last_s;
      last_s = now_s;
      const int blocks = which == VggtStage::kPatchEmbed ? config_.vit_depth : config_.depth;
      done += cost.flop_of(which) / blocks;
      stage.advance(std::min(1.0, done / all));
    });
  }();
  {
    // pose_enc = self.camera_head(aggregated_tokens_list)[-1]
    const ProgressStage stage(progress, std::string(stage_name(VggtStage::kCameras)));
    prediction.pose_enc = camera_head_.forward(tokens, trace);
    prediction.seconds[static_cast<size_t>(VggtStage::kCameras)] = stage.seconds();
  }
  set_views(images, prediction);
  // depth, depth_conf = self.depth_head(...); pts3d, pts3d_conf = self.point_head(...)
  run_dense_heads(images, tokens, prediction, progress, trace);
  prediction.reconstruction.color = to_color(images);
  check_consistent(prediction.reconstruction);
  return prediction;
}

}  // namespace vggtcd
