// SPDX-License-Identifier: Apache-2.0
// WeightFile: which format the bytes are, and what failed downloads look like.
#include "vggtcd/io/weight_file.h"

#include <algorithm>
#include <array>
#include <regex>

#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/mapped_file.h"
#include "vggtcd/io/safetensors.h"
#include "vggtcd/io/torch_checkpoint.h"
#include "vggtcd/io/weight_shards.h"

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

// One of several files is taken for the whole only when its tensors are missed: say it at once.
void throw_if_shard(const std::filesystem::path& path) {
  static const std::regex kShard("-[0-9]{5}-of-([0-9]{5})\\.[a-z]+$");
  std::smatch match;
  const std::string name = path.filename().string();
  if (!std::regex_search(name, match, kShard) || match[1] == "00001") return;
  throw_error(ErrorCode::kWeights,
              "{}: expected a whole checkpoint, found one of {} shards; name the folder, or the "
              "index (model.safetensors.index.json) beside it",
              path.string(), std::stoi(match[1]));
}

// Without what wrappers put before every name; torch.compile also wraps parts of a network.
void remove_wrappers(WeightFile& file) {
  constexpr std::array<std::string_view, 3> kWrappers = {"module.", "_orig_mod.", "model."};
  const auto all_begin_with = [&](std::string_view prefix) {
    return std::ranges::all_of(file.tensors, [&](const TensorView& tensor) {
      return tensor.name.size() > prefix.size() && tensor.name.starts_with(prefix);
    });
  };
  for (bool more = !file.tensors.empty(); more;) {
    const auto* wrapper = std::ranges::find_if(kWrappers, all_begin_with);
    more = wrapper != kWrappers.end();
    if (!more) break;
    for (TensorView& tensor : file.tensors) tensor.name.erase(0, wrapper->size());
    file.removed_prefix += *wrapper;
  }
  constexpr std::string_view kCompiledPart = "._orig_mod.";
  for (TensorView& tensor : file.tensors) {
    for (size_t at; (at = tensor.name.find(kCompiledPart)) != std::string::npos;) {
      tensor.name.erase(at, kCompiledPart.size() - 1);
    }
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

WeightFile open_weight_file(const std::filesystem::path& given) try {
  const std::filesystem::path path = weight_path(given);
  if (!is_file(path)) {
    throw_error(ErrorCode::kWeights, "{}: expected network weights, found {}", path.string(),
                what_stands_at(path));
  }
  if (const auto index = read_shard_index(path)) {
    WeightFile file = open_shards(*index);
    remove_wrappers(file);
    return file;
  }
  throw_if_shard(path);
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
  remove_wrappers(file);
  return file;
} catch (...) {
  rethrow_naming(given);
}

}  // namespace vggtcd
