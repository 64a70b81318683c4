// SPDX-License-Identifier: Apache-2.0
// Embeddings of position: the ViT's resampled grid and the DPT head's waves.
#include "vggtcd/vggt/position_embedding.h"

#include <algorithm>
#include <cmath>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

// Keys' cubic convolution kernel with a = -0.5.
double cubic(double x) {
  constexpr double a = -0.5;
  x = std::abs(x);
  if (x < 1) return ((a + 2) * x - (a + 3)) * x * x + 1;
  if (x < 2) return ((a * x - 5 * a) * x + 8 * a) * x - 4 * a;
  return 0;
}

// The input samples that make one output sample.
struct Window {
  int64_t first;
  std::vector<double> weights;  // sum to 1
};

std::vector<Window> bicubic_windows(int64_t in, int64_t out) {
  const double scale = static_cast<double>(in) / static_cast<double>(out);
  const double stretch = std::max(scale, 1.0);
  std::vector<Window> windows;
  for (int64_t i = 0; i < out; ++i) {
    const double centre = scale * (static_cast<double>(i) + 0.5);
    const auto first = std::max<int64_t>(0, static_cast<int64_t>(centre - 2 * stretch + 0.5));
    const auto end = std::min<int64_t>(in, static_cast<int64_t>(centre + 2 * stretch + 0.5));
    Window window{first, {}};
    double sum = 0;
    for (int64_t j = first; j < end; ++j) {
      window.weights.push_back(cubic((static_cast<double>(j) - centre + 0.5) / stretch));
      sum += window.weights.back();
    }
    for (double& weight : window.weights) weight /= sum;
    windows.push_back(std::move(window));
  }
  return windows;
}

// out[c] = sum over the window of in[j * step + c].
void gather(const Window& window, const float* in, int64_t step, int64_t channels, float* out) {
  for (int64_t c = 0; c < channels; ++c) {
    double sum = 0;
    for (size_t j = 0; j < window.weights.size(); ++j) {
      sum += window.weights[j] * in[(window.first + static_cast<int64_t>(j)) * step + c];
    }
    out[c] = static_cast<float>(sum);
  }
}

// [size, channels / 2] waves of positions that span +-extent * (size - 1) / size.
std::vector<float> waves(int64_t size, int64_t channels, double extent) {
  const int64_t quarter = channels / 4;
  std::vector<float> result(static_cast<size_t>(size * 2 * quarter));
  for (int64_t i = 0; i < size; ++i) {
    const double position =
        extent * static_cast<double>(2 * i - (size - 1)) / static_cast<double>(size);
    float* row = result.data() + i * 2 * quarter;
    for (int64_t k = 0; k < quarter; ++k) {
      const double frequency =
          std::pow(100.0, -static_cast<double>(k) / static_cast<double>(quarter));
      row[k] = static_cast<float>(0.1 * std::sin(position * frequency));
      row[quarter + k] = static_cast<float>(0.1 * std::cos(position * frequency));
    }
  }
  return result;
}

}  // namespace

std::vector<float> resample_position_grid(std::span<const float> grid, int64_t side,
                                          int64_t channels, int64_t height, int64_t width) {
  check(std::ssize(grid) == side * side * channels, "position grid is [side, side, channels]");
  if (height == side && width == side) return {grid.begin(), grid.end()};
  const std::vector<Window> rows = bicubic_windows(side, height);
  const std::vector<Window> columns = bicubic_windows(side, width);
  std::vector<float> narrow(static_cast<size_t>(side * width * channels));  // [side, width, C]
  for (int64_t y = 0; y < side; ++y) {
    for (int64_t x = 0; x < width; ++x) {
      gather(columns[static_cast<size_t>(x)], grid.data() + y * side * channels, channels, channels,
             narrow.data() + (y * width + x) * channels);
    }
  }
  std::vector<float> result(static_cast<size_t>(height * width * channels));
  for (int64_t y = 0; y < height; ++y) {
    gather(rows[static_cast<size_t>(y)], narrow.data(), width * channels, width * channels,
           result.data() + y * width * channels);
  }
  return result;
}

DptPositions::DptPositions(int64_t map_height, int64_t map_width, int64_t map_channels,
                           int64_t image_height, int64_t image_width)
    : width(map_width), channels(map_channels) {
  check(channels % 4 == 0, "DPT positions: a multiple of 4 channels");
  const double diagonal = std::hypot(image_height, image_width);
  x_waves = waves(map_width, channels, static_cast<double>(image_width) / diagonal);
  y_waves = waves(map_height, channels, static_cast<double>(image_height) / diagonal);
}

void DptPositions::add(int64_t first, int64_t count, float* features, int64_t stride) const {
  const int64_t half = channels / 2;
  for (int64_t i = 0; i < count; ++i) {
    const float* x = x_waves.data() + (first + i) % width * half;
    const float* y = y_waves.data() + (first + i) / width * half;
    float* cell = features + i * stride;
    for (int64_t c = 0; c < half; ++c) cell[c] += x[c];
    for (int64_t c = 0; c < half; ++c) cell[half + c] += y[c];
  }
}

}  // namespace vggtcd
