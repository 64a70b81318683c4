// SPDX-License-Identifier: Apache-2.0
// WeightFile: which format the bytes are, and what failed downloads look like.
#include "vggtcd/io/weight_file.h"

#include <algorithm>
#include <array>

#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/mapped_file.h"
#include "vggtcd/io/safetensors.h"
#include "vggtcd/io/torch_checkpoint.h"

namespace vggtcd {
namespace {

// Failed downloads are the usual bad weights: say so instead of complaining about a header.
void throw_if_text(std::string_view start, const std::string& name) {
  std::string_view text = start;
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  while (!text.empty() && std::string_view(" \t\r\n").find(text[0]) != std::string_view::npos) {
    text.remove_prefix(1);
  }
  if (text.starts_with('<')) {
    throw_error(ErrorCode::kWeights,
                "{}: expected weights, found a web page; download the file itself", name);
  }
  if (text.starts_with("version https://git-lfs")) {
    throw_error(ErrorCode::kWeights,
                "{}: expected weights, found a Git LFS pointer; fetch the file with git lfs pull",
                name);
  }
  const bool printable = std::ranges::all_of(
      text, [](char c) { return (c >= 0x20 && c < 0x7f) || c == '\n' || c == '\r' || c == '\t'; });
  if (printable) {
    throw_error(ErrorCode::kWeights, "{}: expected weights, found text; download the file again",
                name);
  }
}

}  // namespace

std::string_view weight_format_name(WeightFormat format) {
  switch (format) {
    case WeightFormat::kSafetensors:
      return "safetensors";
    case WeightFormat::kTorchZip:
      return "PyTorch checkpoint (zip)";
    case WeightFormat::kTorchLegacy:
      return "PyTorch checkpoint (legacy)";
  }
  return "?";
}

const TensorView* WeightFile::find(std::string_view name) const {
  const auto found = std::ranges::find(tensors, name, &TensorView::name);
  return found == tensors.end() ? nullptr : &*found;
}

WeightFile parse_weight_file(std::span<const std::byte> bytes, const std::string& name) {
  if (bytes.empty()) {
    throw_error(ErrorCode::kWeights, "{}: expected weights, found an empty file; download it again",
                name);
  }
  const std::string_view start(reinterpret_cast<const char*>(bytes.data()),
                               std::min<size_t>(bytes.size(), 512));
  // After the header's length comes its brace; no other format has one there.
  if (start.size() > 8 && start[8] == '{' && start[7] == '\0') {
    return parse_safetensors(bytes, name);
  }
  if (is_torch_checkpoint(bytes)) return parse_torch_checkpoint(bytes, name);
  throw_if_text(start, name);
  if (start.size() > 8 && start[8] == '{') return parse_safetensors(bytes, name);
  throw_error(ErrorCode::kWeights,
              "{}: expected safetensors or a PyTorch checkpoint, found neither", name);
}

WeightFile open_weight_file(const std::filesystem::path& path) try {
  if (!is_file(path)) {
    throw_error(ErrorCode::kWeights, "{}: expected network weights, found {}", path.string(),
                what_stands_at(path));
  }
  const auto mapped = std::make_shared<const MappedFile>(path);
  WeightFile file = [&] {
    try {
      return parse_weight_file(mapped->bytes(), path.string());
    } catch (const Error&) {
      throw_if_interrupted();  // a file that was cut off meanwhile explains it better
      throw;
    }
  }();
  // Both the mapping and what the parser had to copy must live as long as the tensors.
  file.storage = std::make_shared<const std::array<std::shared_ptr<const void>, 2>>(
      std::array<std::shared_ptr<const void>, 2>{mapped, file.storage});
  return file;
} catch (...) {
  rethrow_naming(path);
}

}  // namespace vggtcd
