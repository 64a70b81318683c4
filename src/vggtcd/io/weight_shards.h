// SPDX-License-Identifier: Apache-2.0
// weight_shards: checkpoints that are saved as several files with an index, or named by their
// folder. Source: save_pretrained of the transformers and huggingface_hub projects.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vggtcd/io/weight_file.h"

namespace vggtcd {

// The file that a folder stands for: its model.safetensors, or the one *.index.json beside shards.
// Other paths stand for themselves. Throws Error{kWeights} for a folder without either.
std::filesystem::path weight_path(const std::filesystem::path& path);

// Which tensor is in which file.
struct ShardIndex {
  std::filesystem::path path;
  std::vector<std::string> files;                       // names, in the index's folder
  std::vector<std::pair<std::string, size_t>> tensors;  // name, number of its file
};

// Nothing if the file is no JSON with a "weight_map". Throws Error{kWeights} if it names files that
// are not beside it.
std::optional<ShardIndex> read_shard_index(const std::filesystem::path& path);

// All shards as one file. Throws Error{kWeights} if a shard is missing, lacks a tensor that the
// index says it has, or has one that another has, too.
WeightFile open_shards(const ShardIndex& index);

// The files that make up the checkpoint: path itself, or the index and its shards.
std::vector<std::filesystem::path> weight_files(const std::filesystem::path& path);

}  // namespace vggtcd
