// SPDX-License-Identifier: Apache-2.0
// DptHead: reassemble four layers at four scales, fuse them from coarse to fine, and read off the
// result; one frame at a time, so that memory does not grow with the number of frames.
#include "vggtcd/vggt/dpt_head.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "vggtcd/core/parallel.h"
#include "vggtcd/nn/activation.h"
#include "vggtcd/nn/resize.h"
#include "vggtcd/vggt/position_embedding.h"

namespace vggtcd {
namespace {

constexpr int64_t kPixelGrain = 256;  // pixels per chunk of element-wise work

// Per thread and use: rows of working memory, kept from call to call.
template <int kUse>
Rows thread_rows(DType dtype, int64_t columns) {
  thread_local Buffer buffer;
  buffer.reserve(bytes_of(dtype, kRowBlock, columns));
  return Rows(dtype, buffer, columns);
}

int64_t dim(const WeightScope& scope, std::string_view name, size_t index) {
  const auto& shape = scope.shape(name);
  return index < shape.size() ? shape[index] : 0;  // a wrong rank is reported by take()
}

// A transposed convolution whose kernel is its stride is a product per pixel, [in, out, k, k] ->
// [k * k * out, in]: every input pixel makes its own k x k square.
Linear make_transposed(const WeightScope& scope, int64_t channels, int64_t k, ProductTypes types) {
  const auto weight = scope.take_f32("weight", {channels, channels, k, k});
  const auto bias = scope.take_f32("bias", {channels});
  std::vector<float> rows(weight.size()), biases;
  for (int64_t tap = 0; tap < k * k; ++tap) {
    biases.insert(biases.end(), bias.begin(), bias.end());
    for (int64_t o = 0; o < channels; ++o) {
      for (int64_t i = 0; i < channels; ++i) {
        rows[static_cast<size_t>((tap * channels + o) * channels + i)] =
            weight[static_cast<size_t>((i * channels + o) * k * k + tap)];
      }
    }
  }
  return {rows, biases, channels, k * k * channels, {.types = types, .output = types.compute}};
}

// A 1x1 convolution, weight [out, in, 1, 1].
Linear make_pointwise(const WeightScope& scope, int64_t in, int64_t out, ProductTypes types) {
  return {scope.take_f32("weight", {out, in, 1, 1}),
          scope.take_f32("bias", {out}),
          in,
          out,
          {.types = types}};
}

void copy_as(const Rows& source, const Rows& target, int64_t count, int64_t channels) {
  if (target.dtype == DType::kBF16) {
    bf16_from_f32(count * channels, source.f32(), target.bf16());
  } else if (target.data != source.data) {
    std::memcpy(target.data, source.data, bytes_of(DType::kF32, count, channels));
  }
}

// The map as the input of a convolution: itself, or rounded in workspace.input.
Rows as_input(const DptMap& map, DType compute, DptWorkspace& workspace) {
  if (compute == map.dtype) return map.rows();
  workspace.input.resize(compute, map.height, map.width, map.channels);
  const Rows source = map.rows(), target = workspace.input.rows();
  parallel_for(map.pixels(), kPixelGrain, [&](int64_t begin, int64_t end) {
    copy_as(source.at(begin), target.at(begin), end - begin, map.channels);
  });
  return target;
}

void resize_to(const DptMap& source, int64_t height, int64_t width, DptMap& target) {
  target.resize(DType::kF32, height, width, source.channels);
  resize_bilinear_channels_last({source.channels, source.height, source.width, height, width},
                                source.rows().f32(), target.rows().f32());
}

}  // namespace

void DptMap::resize(DType type, int64_t new_height, int64_t new_width, int64_t new_channels) {
  dtype = type;
  height = new_height;
  width = new_width;
  channels = new_channels;
  memory.reserve(bytes_of(dtype, pixels(), channels));
}

struct DptHead::Frame {
  const AggregatedTokens& tokens;
  int64_t index, height, width;
  DptWorkspace& maps;
  const Trace& trace;
  const std::string& head;

  // Traces a map as upstream has it: [1, channels, height, width].
  void show(const char* name, const DptMap& map) const {
    if (trace) show(name, map.height, map.width, map.channels, map.rows().f32());
  }
  void show(const char* name, int64_t map_height, int64_t map_width, int64_t channels,
            const float* values) const {
    if (!trace) return;
    const int64_t pixels = map_height * map_width;
    std::vector<float> planes(static_cast<size_t>(pixels * channels));
    for (int64_t p = 0; p < pixels; ++p) {
      for (int64_t c = 0; c < channels; ++c) {
        planes[static_cast<size_t>(c * pixels + p)] = values[p * channels + c];
      }
    }
    trace_tensor(trace, fmt::format("{}.{}.{}", head, index, name),
                 {1, channels, map_height, map_width}, planes.data());
  }
};

ResidualUnit::ResidualUnit(const WeightScope& scope, int64_t features, ProductTypes types)
    : conv1_(scope.at("conv1"), features, features, 1,
             {.types = types, .output = types.compute, .activation = Activation::kRelu}),
      conv2_(scope.at("conv2"), features, features, 1, {.types = types, .accumulate = true}) {}

void ResidualUnit::add_to(DptMap& x, DptMap& into, DptWorkspace& workspace) const {
  const Rows values = x.rows(), sum = into.rows();
  const int64_t channels = x.channels;
  // x = relu(x), in place, so the skip connection has it too
  parallel_for(x.pixels(), kPixelGrain, [&](int64_t begin, int64_t end) {
    float* value = values.at(begin).f32();
    const int64_t count = (end - begin) * channels;
    for (int64_t i = 0; i < count; ++i) value[i] = std::max(value[i], 0.0f);
    if (&x == &into) return;
    float* target = sum.at(begin).f32();
    for (int64_t i = 0; i < count; ++i) target[i] += value[i];
  });
  DptMap& hidden = workspace.hidden;
  const DType compute = conv1_.compute();
  hidden.resize(compute, x.height, x.width, channels);
  conv1_.run(x.height, x.width, as_input(x, compute, workspace), hidden.rows());
  conv2_.run(x.height, x.width, hidden.rows(), sum);
}

DptHead::Fusion DptHead::make_fusion(const WeightScope& scope, int64_t features,
                                     bool coarsest) const {
  std::optional<ResidualUnit> unit1;
  if (!coarsest) unit1.emplace(scope.at("resConfUnit1"), features, types_);
  return {std::move(unit1), ResidualUnit(scope.at("resConfUnit2"), features, types_),
          make_pointwise(scope.at("out_conv"), features, features, types_)};
}

DptHead::DptHead(const WeightScope& scope, const VggtConfig& config, int64_t outputs,
                 ProductTypes types, std::string name)
    : name_(std::move(name)),
      types_(types),
      norm_(scope.at("norm"), 2 * config.channels, kEps),
      output_conv1_(scope.at("scratch.output_conv1"), dim(scope, "scratch.output_conv1.weight", 1),
                    dim(scope, "scratch.output_conv1.weight", 0), 1, {.types = types}),
      output_conv2_first_(scope.at("scratch.output_conv2.0"), output_conv1_.out(),
                          dim(scope, "scratch.output_conv2.0.weight", 0), 1,
                          {.types = types, .activation = Activation::kRelu}),
      output_conv2_last_(make_pointwise(scope.at("scratch.output_conv2.2"),
                                        output_conv2_first_.out(), outputs, ProductTypes{})) {
  const int64_t features = dim(scope, "scratch.layer1_rn.weight", 0);
  for (int level = 0; level < 4; ++level) {
    const WeightScope project = scope.at(fmt::format("projects.{}", level));
    const int64_t channels = dim(project, "weight", 0);
    projects_.push_back(make_pointwise(project, 2 * config.channels, channels, types));
    const WeightScope resize = scope.at(fmt::format("resize_layers.{}", level));
    if (level < 2) {
      resize_layers_.push_back(make_transposed(resize, channels, level == 0 ? 4 : 2, types));
    } else if (level == 3) {
      downsample_.emplace(resize, channels, channels, 2,
                          LinearOptions{.types = types, .output = types.compute});
    }
    layer_rn_.emplace_back(scope.at(fmt::format("scratch.layer{}_rn", level + 1)), channels,
                           features, 1, LinearOptions{.types = types}, false);
    fusions_.push_back(
        make_fusion(scope.at(fmt::format("scratch.refinenet{}", level + 1)), features, level == 3));
  }
}

// x = projects[i](norm(tokens)) + position, as the input of what follows
void DptHead::project(const Frame& frame, size_t level, DptMap& target) const {
  const AggregatedTokens& tokens = frame.tokens;
  const Linear& linear = projects_[level];
  const DptPositions positions(tokens.grid_height, tokens.grid_width, linear.out(), frame.height,
                               frame.width);
  target.resize(types_.compute, tokens.grid_height, tokens.grid_width, linear.out());
  const Rows patches = tokens.frame(level, frame.index).at(tokens.special), out = target.rows();
  parallel_for(target.pixels(), kRowBlock, [&](int64_t begin, int64_t end) {
    const int64_t count = end - begin;
    const Rows normal = thread_rows<0>(types_.compute, tokens.channels);
    const Rows projected = thread_rows<1>(DType::kF32, linear.out());
    norm_.run(count, patches.at(begin), normal);
    linear.run(count, normal, projected);  // [count, 2C] -> [count, channels of this level]
    positions.add(begin, count, projected.f32(), projected.stride);
    copy_as(projected, out.at(begin), count, linear.out());
  });
}

// Transposed convolution: pixel (y, x) of source becomes the factor x factor square at (y, x) *
// factor of target.
void DptHead::upsample(const Frame&, const Linear& linear, int64_t factor, const DptMap& source,
                       DptMap& target) const {
  const int64_t channels = source.channels;
  target.resize(types_.compute, source.height * factor, source.width * factor, channels);
  const Rows in = source.rows(), out = target.rows();
  const size_t run_bytes = bytes_of(types_.compute, factor, channels);
  parallel_for(source.pixels(), kRowBlock, [&](int64_t begin, int64_t end) {
    const Rows squares = thread_rows<2>(types_.compute, factor * factor * channels);
    linear.run(end - begin, in.at(begin), squares);  // [count, c] -> [count, k * k * c]
    for (int64_t pixel = begin; pixel < end; ++pixel) {
      const int64_t y = pixel / source.width * factor, x = pixel % source.width * factor;
      for (int64_t dy = 0; dy < factor; ++dy) {
        std::memcpy(out.at((y + dy) * target.width + x).data,
                    squares.at(pixel - begin, dy * factor * channels).data, run_bytes);
      }
    }
  });
}

// x = layerN_rn(resize_layers[i](x))
void DptHead::reassemble(const Frame& frame, size_t level) const {
  DptWorkspace& maps = frame.maps;
  project(frame, level, maps.projected);
  const DptMap* resized = &maps.projected;
  if (level < 2) {
    upsample(frame, resize_layers_[level], level == 0 ? 4 : 2, maps.projected, maps.stage);
    resized = &maps.stage;
  } else if (level == 3) {
    const DptMap& x = maps.projected;
    maps.stage.resize(types_.compute, downsample_->out_size(x.height),
                      downsample_->out_size(x.width), x.channels);
    downsample_->run(x.height, x.width, x.rows(), maps.stage.rows());
    resized = &maps.stage;
  }
  DptMap& out = maps.reassembled[level];
  out.resize(DType::kF32, resized->height, resized->width, layer_rn_[level].out());
  layer_rn_[level].run(resized->height, resized->width, resized->rows(), out.rows());
  constexpr std::array names{"layer1_rn", "layer2_rn", "layer3_rn", "layer4_rn"};
  frame.show(names[level], out);
}

// path = refinenetN(path, layer_N): FeatureFusionBlock. Upstream resizes, then applies the 1x1
// out_conv; the two commute (bilinear weights sum to one), and this order has a quarter of the
// work.
void DptHead::fuse(const Frame& frame, size_t level) const {
  DptWorkspace& maps = frame.maps;
  const Fusion& fusion = fusions_[level];
  DptMap& layer = maps.reassembled[level];
  DptMap& path = fusion.unit1 ? maps.path : layer;  // the coarsest: its layer is the path
  if (fusion.unit1) fusion.unit1->add_to(layer, path, maps);
  fusion.unit2.add_to(path, path, maps);

  const Rows input = as_input(path, types_.compute, maps);
  maps.narrow.resize(DType::kF32, path.height, path.width, path.channels);
  const Rows narrow = maps.narrow.rows();
  parallel_for(path.pixels(), kRowBlock, [&](int64_t begin, int64_t end) {
    fusion.out_conv.run(end - begin, input.at(begin), narrow.at(begin));
  });
  const bool finest = level == 0;
  const int64_t height = finest ? 2 * path.height : maps.reassembled[level - 1].height;
  const int64_t width = finest ? 2 * path.width : maps.reassembled[level - 1].width;
  resize_to(maps.narrow, height, width, maps.path);
  constexpr std::array names{"refinenet1", "refinenet2", "refinenet3", "refinenet4"};
  frame.show(names[level], maps.path);
}

// output_conv2(interpolate(output_conv1(path), (H, W)) + position)
void DptHead::output(const Frame& frame, float* out) const {
  DptWorkspace& maps = frame.maps;
  DptMap& path = maps.path;
  maps.narrow.resize(DType::kF32, path.height, path.width, output_conv1_.out());
  output_conv1_.run(path.height, path.width, as_input(path, types_.compute, maps),
                    maps.narrow.rows());
  frame.show("output_conv1", maps.narrow);

  resize_to(maps.narrow, frame.height, frame.width, maps.wide);
  const DptPositions positions(frame.height, frame.width, maps.wide.channels, frame.height,
                               frame.width);
  const Rows wide = maps.wide.rows();
  parallel_for(maps.wide.pixels(), kPixelGrain, [&](int64_t begin, int64_t end) {
    positions.add(begin, end - begin, wide.at(begin).f32(), wide.stride);
  });

  DptMap& hidden = maps.narrow;
  const Rows input = as_input(maps.wide, types_.compute, maps);
  hidden.resize(DType::kF32, frame.height, frame.width, output_conv2_first_.out());
  output_conv2_first_.run(frame.height, frame.width, input, hidden.rows());
  const Rows result(out, outputs());
  parallel_for(hidden.pixels(), kRowBlock, [&](int64_t begin, int64_t end) {
    output_conv2_last_.run(end - begin, hidden.rows().at(begin), result.at(begin));
  });
  frame.show("output_conv2", frame.height, frame.width, outputs(), out);
}

void DptHead::forward(const AggregatedTokens& tokens, int64_t frame_index, int64_t height,
                      int64_t width, float* out, DptWorkspace& workspace,
                      const Trace& trace) const {
  const Frame frame{tokens, frame_index, height, width, workspace, trace, name_};
  for (size_t level = 0; level < 4; ++level) reassemble(frame, level);
  for (size_t level = 4; level-- > 0;) fuse(frame, level);
  output(frame, out);
}

float activate_depth(float raw) { return std::exp(raw); }
float activate_point(float raw) { return std::copysign(std::expm1(std::abs(raw)), raw); }
float activate_confidence(float raw) { return 1.0f + std::exp(raw); }

}  // namespace vggtcd
