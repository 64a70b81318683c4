// SPDX-License-Identifier: Apache-2.0
// Product on our own kernel: packs the weights into its panels.
#include <algorithm>
#include <cstring>

#include "vggtcd/core/cpu_features.h"
#include "vggtcd/nn/panel_kernel.h"
#include "vggtcd/nn/product.h"
#include "vggtcd/nn/row_kernels.h"

namespace vggtcd {
namespace {

const PanelKernel& kernel_of_this_processor() {
  check(cpu_level() >= CpuLevel::kAvx2, "panel product: needs AVX2");
  return cpu_level() >= CpuLevel::kAvx512 ? panel_kernel_avx512() : panel_kernel_avx2();
}

int64_t whole_vectors(const PanelKernel& kernel, int64_t channels) {
  return (channels + kernel.vector_channels - 1) / kernel.vector_channels * kernel.vector_channels;
}

void convert_row(int64_t size, const float* x, float* y) { std::copy_n(x, size, y); }
void convert_row(int64_t size, const uint16_t* x, uint16_t* y) { std::copy_n(x, size, y); }
void convert_row(int64_t size, const float* x, uint16_t* y) {
  row_kernels()->bf16_from_f32(size, x, y);
}
void convert_row(int64_t size, const uint16_t* x, float* y) {
  row_kernels()->f32_from_bf16(size, x, y);
}

// Rows [0, count) of weight, turned into [in, width]; the other columns are left as they are.
template <typename In, typename Out>
void pack_panel(int64_t in, const In* weight, int64_t count, int64_t width, Out* panel) {
  constexpr int64_t kTile = 64;  // input channels: what is read and written stays in the cache
  for (int64_t begin = 0; begin < in; begin += kTile) {
    const int64_t size = std::min(kTile, in - begin);
    for (int64_t o = 0; o < count; ++o) {
      Out row[kTile];
      convert_row(size, weight + o * in + begin, row);
      for (int64_t i = 0; i < size; ++i) panel[(begin + i) * width + o] = row[i];
    }
  }
}

// weight [out, in] -> panels; their memory is zero before.
template <typename In, typename Out>
void pack_panels(const PanelKernel& kernel, int64_t in, int64_t out, const std::byte* weight,
                 std::byte* panels) {
  const auto* from = reinterpret_cast<const In*>(weight);
  auto* to = reinterpret_cast<Out*>(panels);
  for (int64_t first = 0; first < out; first += kernel.panel_channels) {
    const int64_t count = std::min(kernel.panel_channels, out - first);
    const int64_t width = whole_vectors(kernel, count);
    pack_panel(in, from + first * in, count, width, to);
    to += width * in;
  }
}

// Working memory of one thread, for widened blocks.
float* scratch() {
  thread_local Buffer buffer;
  buffer.reserve(kPanelScratchFloats * sizeof(float));
  return reinterpret_cast<float*>(buffer.data());
}

class PanelProduct : public Product {
 public:
  PanelProduct(ProductSpec given, DType dtype, const std::byte* weight)
      : Product(std::move(given)), kernel_(kernel_of_this_processor()) {
    const DType kept = spec().options.types.weights;
    check(spec().options.types.compute == DType::kF32, "panel product: x is f32");
    // Fresh pages of a Buffer are zero.
    packed_.reserve(bytes_of(kept, whole_vectors(kernel_, spec().out), spec().in));
    const bool from_f32 = dtype == DType::kF32, to_f32 = kept == DType::kF32;
    const auto pack =
        from_f32 ? (to_f32 ? pack_panels<float, float> : pack_panels<float, uint16_t>)
                 : (to_f32 ? pack_panels<uint16_t, float> : pack_panels<uint16_t, uint16_t>);
    pack(kernel_, spec().in, spec().out, weight, packed_.data());
  }

  void run(int64_t rows, const Rows& x, const Rows& y) const override {
    const LinearOptions& options = spec().options;
    kernel_.run({.rows = rows,
                 .in = spec().in,
                 .out = spec().out,
                 .x = x.f32(),
                 .x_stride = x.stride,
                 .panels = packed_.data(),
                 .bf16 = options.types.weights == DType::kBF16,
                 .bias = spec().bias.empty() ? nullptr : spec().bias.data(),
                 .gamma = options.gamma.empty() ? nullptr : options.gamma.data(),
                 .accumulate = spec().accumulates(),
                 .activation = options.activation,
                 .y = y.f32(),
                 .y_stride = y.stride,
                 .scratch = scratch()});
  }

  size_t packed_bytes() const override { return packed_.size(); }

 private:
  const PanelKernel& kernel_;
  Buffer packed_;
};

}  // namespace

std::unique_ptr<const Product> make_panel_product(ProductSpec spec, DType dtype,
                                                  const std::byte* weight) {
  return std::make_unique<PanelProduct>(std::move(spec), dtype, weight);
}

}  // namespace vggtcd
