// SPDX-License-Identifier: Apache-2.0
// weight_shards: an index is untrusted JSON; every tensor must be where it says.
#include "vggtcd/io/weight_shards.h"

#include <map>
#include <string_view>

#include "vggtcd/core/error.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/io/mapped_file.h"
#include "vggtcd/io/quote.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kIndexEnding = ".index.json";

[[noreturn]] void fail(const fs::path& path, std::string_view what) {
  throw_error(ErrorCode::kWeights, "{}: {}", path.string(), what);
}

std::vector<fs::path> indices_in(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (at->path().filename().string().ends_with(kIndexEnding)) found.push_back(at->path());
  }
  return found;
}

// A plain file name: an index must not lead anywhere else.
bool is_plain(const std::string& name) {
  return !name.empty() && name != "." && name != ".." &&
         name.find_first_of(std::string_view("/\0", 2)) == std::string::npos;
}

// JSON begins with a brace; safetensors may, too, by the length of its header, but has another one
// behind the length.
bool may_be_index(const fs::path& path) {
  constexpr size_t kMaxBytes = 100'000'000;
  if (!is_file(path)) return false;
  const MappedFile file(path);
  const std::string_view text(reinterpret_cast<const char*>(file.bytes().data()),
                              file.bytes().size());
  if (text.size() > kMaxBytes) return false;
  if (text.size() > 8 && text[7] == '\0' && text[8] == '{') return false;
  const size_t start = text.find_first_not_of(" \t\r\n");
  return start != std::string_view::npos && text[start] == '{';
}

// Null for what is no JSON: the reader of weights says what a failed download looks like.
Json index_json(const fs::path& path) {
  if (!may_be_index(path)) return nullptr;
  try {
    return read_json_file(path);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kInput) throw;
    return nullptr;
  }
}

}  // namespace

fs::path weight_path(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) return path;
  const fs::path whole = path / "model.safetensors";
  if (fs::exists(whole, ignored)) return whole;
  const std::vector<fs::path> indices = indices_in(path);
  for (const fs::path& index : indices) {
    if (index.filename() == "model.safetensors.index.json") return index;
  }
  if (indices.size() == 1) return indices.front();
  throw_error(ErrorCode::kWeights,
              "{}: expected network weights, found a folder without model.safetensors and "
              "model.safetensors.index.json; name the file",
              path.string());
}

std::optional<ShardIndex> read_shard_index(const fs::path& path) {
  const Json json = index_json(path);
  const auto map = json.find("weight_map");
  if (map == json.end() || !map->is_object() || map->empty()) return {};
  ShardIndex index{path, {}, {}};
  std::map<std::string, size_t> number_of_file;
  for (const auto& [tensor, file] : map->items()) {
    const std::string name = file.is_string() ? file.get<std::string>() : "";
    if (!is_plain(name)) {
      fail(path, fmt::format("tensor {}: expected the name of a file beside the index, found {}",
                             quote(tensor), quote(file.dump().substr(0, 60))));
    }
    const auto [at, is_new] = number_of_file.emplace(name, index.files.size());
    if (is_new) index.files.push_back(name);
    index.tensors.emplace_back(tensor, at->second);
  }
  return index;
}

WeightFile open_shards(const ShardIndex& index) {
  const fs::path folder = index.path.parent_path();
  WeightFile whole;
  std::map<std::string, size_t, std::less<>> file_of_tensor;
  auto storage = std::make_shared<std::vector<std::shared_ptr<const void>>>();
  for (size_t i = 0; i < index.files.size(); ++i) {
    const fs::path path = folder / index.files[i];
    std::error_code ignored;
    if (!fs::exists(path, ignored)) {
      fail(index.path, fmt::format("expected its shard {} beside it, found none; download all {} "
                                   "files",
                                   quote(index.files[i]), index.files.size()));
    }
    const auto mapped = std::make_shared<const MappedFile>(path);
    WeightFile shard = parse_weight_file(mapped->bytes(), path.string());
    // The file's own format decides whether its pages may be given back.
    if (i == 0 || shard.format != WeightFormat::kSafetensors) whole.format = shard.format;
    whole.metadata.merge(shard.metadata);
    storage->insert(storage->end(), {mapped, shard.storage});
    for (TensorView& tensor : shard.tensors) {
      if (!file_of_tensor.emplace(tensor.name, i).second) {
        fail(path, fmt::format("tensor {} is in another shard, too", quote(tensor.name)));
      }
      whole.tensors.push_back(std::move(tensor));
    }
  }
  for (const auto& [tensor, file] : index.tensors) {
    const auto found = file_of_tensor.find(tensor);
    if (found == file_of_tensor.end() || found->second != file) {
      fail(folder / index.files[file],
           fmt::format("expected tensor {} as {} says, found none; download the files again",
                       quote(tensor), index.path.filename().string()));
    }
  }
  whole.storage = storage;
  return whole;
}

std::vector<fs::path> weight_files(const fs::path& path) {
  const fs::path file = weight_path(path);
  std::vector<fs::path> files{file};
  if (const auto index = read_shard_index(file)) {
    for (const std::string& name : index->files) files.push_back(file.parent_path() / name);
  }
  return files;
}

}  // namespace vggtcd
