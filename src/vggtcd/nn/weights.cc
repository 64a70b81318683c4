// SPDX-License-Identifier: Apache-2.0
// WeightStore: tensors by name, all or nothing.
#include "vggtcd/nn/weights.h"

#include <sys/mman.h>

#include <algorithm>
#include <charconv>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

bool is_floating(DType dtype) {
  return dtype == DType::kF64 || dtype == DType::kF32 || dtype == DType::kF16 ||
         dtype == DType::kBF16;
}

}  // namespace

void release_pages(std::span<const std::byte> bytes) {
  constexpr uintptr_t kPage = 4096;
  const auto begin = reinterpret_cast<uintptr_t>(bytes.data());
  const uintptr_t first = (begin + kPage - 1) / kPage * kPage;
  const uintptr_t last = (begin + bytes.size()) / kPage * kPage;
  if (first < last) madvise(reinterpret_cast<void*>(first), last - first, MADV_DONTNEED);
}

WeightStore::WeightStore(std::vector<TensorView> tensors, std::string source,
                         ReleaseWeights release)
    : source_(std::move(source)), release_(std::move(release)) {
  entries_.reserve(tensors.size());
  for (TensorView& tensor : tensors) {
    auto entry = std::make_unique<Entry>();
    entry->view = std::move(tensor);
    if (!by_name_.emplace(entry->view.name, entry.get()).second) {
      throw_error(ErrorCode::kWeights, "{}: tensor {} appears twice; download the file again",
                  source_, entry->view.name);
    }
    entries_.push_back(std::move(entry));
  }
}

WeightScope WeightStore::root() const { return {*this, ""}; }

const WeightStore::Entry* WeightStore::find(const std::string& name) const {
  const auto found = by_name_.find(name);
  return found == by_name_.end() ? nullptr : found->second;
}

std::vector<std::string> WeightStore::untaken(
    std::span<const std::string_view> except_prefixes) const {
  std::vector<std::string> names;
  for (const auto& entry : entries_) {
    bool excepted = entry->taken.load();
    for (const std::string_view prefix : except_prefixes) {
      excepted = excepted || entry->view.name.starts_with(prefix);
    }
    if (!excepted) names.push_back(entry->view.name);
  }
  return names;
}

std::string WeightScope::full_name(std::string_view name) const {
  return prefix_.empty() ? std::string(name) : prefix_ + "." + std::string(name);
}

bool WeightScope::contains(std::string_view name) const {
  return store_->find(full_name(name)) != nullptr;
}

const std::vector<int64_t>& WeightScope::shape(std::string_view name) const {
  const std::string full = full_name(name);
  const WeightStore::Entry* entry = store_->find(full);
  if (entry == nullptr) {
    throw_error(ErrorCode::kWeights,
                "{}: expected tensor {}, found none; VGGT weights are needed, e.g. the official "
                "model.safetensors of VGGT-1B",
                store_->source_, full);
  }
  return entry->view.shape;
}

int WeightScope::count(std::string_view name) const {
  const std::string prefix = full_name(name) + ".";
  int depth = 0;
  for (const auto& [tensor, entry] : store_->by_name_) {
    if (!tensor.starts_with(prefix)) continue;
    int layer = -1;
    const char* const end = tensor.data() + tensor.size();
    const auto number = std::from_chars(tensor.data() + prefix.size(), end, layer);
    if (number.ec == std::errc() && number.ptr != end && *number.ptr == '.') {
      depth = std::max(depth, layer + 1);
    }
  }
  return depth;
}

TensorView WeightScope::take(std::string_view name, std::span<const int64_t> expected) const {
  const std::string full = full_name(name);
  const WeightStore::Entry* entry = store_->find(full);
  if (entry == nullptr) {
    throw_error(ErrorCode::kWeights,
                "{}: expected tensor {} {}, found none; the file is not a complete VGGT checkpoint",
                store_->source_, full, shape_string(expected));
  }
  const TensorView& view = entry->view;
  if (!std::equal(view.shape.begin(), view.shape.end(), expected.begin(), expected.end())) {
    throw_error(ErrorCode::kWeights,
                "{}: expected tensor {} of shape {}, found {}; the file is not a VGGT checkpoint "
                "of this architecture",
                store_->source_, full, shape_string(expected), shape_string(view.shape));
  }
  if (!is_floating(view.dtype)) {
    throw_error(ErrorCode::kWeights,
                "{}: expected tensor {} of a floating-point type, found {}; quantised checkpoints "
                "are not supported",
                store_->source_, full, dtype_name(view.dtype));
  }
  check(!entry->taken.exchange(true), "weights: a tensor was taken twice");
  return view;
}

std::vector<float> WeightScope::take_f32(std::string_view name,
                                         std::initializer_list<int64_t> shape) const {
  const TensorView view = take(name, shape);
  std::vector<float> values(static_cast<size_t>(view.numel()));
  convert_to_float(view.dtype, view.data.data(), values.data(), view.numel());
  return values;
}

void WeightScope::release(const TensorView& taken) const {
  if (store_->release_) store_->release_(taken.data);
}

}  // namespace vggtcd
