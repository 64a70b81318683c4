// SPDX-License-Identifier: Apache-2.0
// checkpoint: converting holds one tensor at a time.
#include "vggtcd/vggt/checkpoint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/io/quote.h"
#include "vggtcd/io/safetensors.h"
#include "vggtcd/io/weight_file.h"

namespace vggtcd {
namespace {

std::string config_json(const WeightFile& file) {
  const auto config = file.metadata.find("config");
  return config == file.metadata.end() ? "" : config->second;
}

bool is_float(DType dtype) {
  return dtype == DType::kF64 || dtype == DType::kF32 || dtype == DType::kF16 ||
         dtype == DType::kBF16;
}

DType target_dtype(const TensorView& tensor, WeightPrecision precision) {
  if (!is_float(tensor.dtype)) return tensor.dtype;
  const bool matrix = tensor.shape.size() >= 2 && tensor.name.ends_with(".weight");
  if (!matrix || precision == WeightPrecision::kF32) return DType::kF32;
  return precision == WeightPrecision::kF16 ? DType::kF16 : DType::kBF16;
}

// count values to f32, bf16 or f16. False if a finite value became infinite.
bool convert_values(const TensorView& tensor, int64_t first, int64_t count, DType dtype,
                    std::byte* out) {
  std::array<float, 1024> values;
  bool fits = true;
  const std::byte* in = tensor.data.data() + static_cast<size_t>(first) * dtype_size(tensor.dtype);
  while (count > 0) {
    const int64_t n = std::min<int64_t>(count, std::ssize(values));
    convert_to_float(tensor.dtype, in, values.data(), n);
    for (int64_t i = 0; i < n; ++i) {
      const float value = values[static_cast<size_t>(i)];
      if (dtype == DType::kF32) {
        std::memcpy(out + 4 * i, &value, 4);
        continue;
      }
      const bool half = dtype == DType::kF16;
      const uint16_t bits = half ? half_from_float(value) : bfloat16_from_float(value);
      const float back = half ? float_from_half(bits) : float_from_bfloat16(bits);
      fits = fits && std::isfinite(back) == std::isfinite(value);
      std::memcpy(out + 2 * i, &bits, 2);
    }
    in += static_cast<size_t>(n) * dtype_size(tensor.dtype);
    out += static_cast<size_t>(n) * dtype_size(dtype);
    count -= n;
  }
  return fits;
}

}  // namespace

VggtConfig read_checkpoint_config(const std::filesystem::path& path) {
  const WeightFile file = open_weight_file(path);
  return read_config(WeightStore(file.tensors, path.string()), config_json(file));
}

std::span<const EnumName<WeightPrecision>> enum_names(WeightPrecision) {
  static constexpr std::array<EnumName<WeightPrecision>, 3> kNames = {
      {{WeightPrecision::kF32, "f32"},
       {WeightPrecision::kF16, "f16"},
       {WeightPrecision::kBF16, "bf16"}}};
  return kNames;
}

void convert_weights(const std::filesystem::path& from, const std::filesystem::path& to,
                     const ConvertOptions& options, ProgressSink& progress) {
  ProgressStage stage(progress, "convert");
  const WeightFile file = open_weight_file(from);
  std::vector<TensorInfo> infos;
  double all_values = 0, done_values = 0;
  for (const TensorView& tensor : file.tensors) {
    infos.push_back({tensor.name, target_dtype(tensor, options.precision), tensor.shape});
    all_values += static_cast<double>(tensor.numel());
  }
  write_safetensors(to, infos, file.metadata, [&](size_t i, std::span<std::byte> out) {
    const TensorView& tensor = file.tensors[i];
    if (!is_float(tensor.dtype)) {
      std::memcpy(out.data(), tensor.data.data(), out.size());
    } else {
      constexpr int64_t kGrain = 1 << 16;
      const size_t out_size = dtype_size(infos[i].dtype);
      parallel_for(tensor.numel(), kGrain, [&](int64_t begin, int64_t end) {
        std::byte* target = out.data() + static_cast<size_t>(begin) * out_size;
        if (convert_values(tensor, begin, end - begin, infos[i].dtype, target)) return;
        throw_error(ErrorCode::kWeights,
                    "{}: tensor {} has values too large for {}; convert to bf16", from.string(),
                    quote(tensor.name), dtype_name(infos[i].dtype));
      });
    }
    // A converted tensor's pages need not stay; others may share a storage or be copies of ours.
    if (file.format == WeightFormat::kSafetensors) release_pages(tensor.data);
    done_values += static_cast<double>(tensor.numel());
    stage.advance(done_values / all_values);
  });
}

}  // namespace vggtcd
