// SPDX-License-Identifier: Apache-2.0
// WeightStore: the tensors of a checkpoint by name, all or nothing: a layer takes what it needs by
// name and shape and gets it or throws; what nobody took can be listed.
//
//   WeightStore store(tensors, "model.safetensors");
//   Linear(store.root().at("aggregator.frame_blocks.0.attn.qkv"), ...)   // takes "weight", "bias"
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "vggtcd/core/tensor_view.h"

namespace vggtcd {

class WeightScope;

// Called with the bytes of a tensor when its values have been copied to where they are used: the
// owner may give the memory back to the system.
using ReleaseWeights = std::function<void(std::span<const std::byte>)>;

// Gives the whole pages inside these bytes back to the system: a file mapped read-only would read
// them again, anonymous memory becomes zeros. For tensors that share no memory.
void release_pages(std::span<const std::byte> bytes);

class WeightStore {
 public:
  // The memory behind the tensors must live until the last take(). source names the file in errors.
  WeightStore(std::vector<TensorView> tensors, std::string source, ReleaseWeights release = {});

  WeightScope root() const;
  const std::string& source() const { return source_; }

  // Names that were never taken and do not begin with one of the prefixes, in file order.
  std::vector<std::string> untaken(std::span<const std::string_view> except_prefixes = {}) const;

 private:
  friend class WeightScope;
  struct Entry {
    TensorView view;
    mutable std::atomic<bool> taken{false};
  };
  const Entry* find(const std::string& name) const;

  std::string source_;
  ReleaseWeights release_;
  std::vector<std::unique_ptr<Entry>> entries_;
  std::unordered_map<std::string_view, const Entry*> by_name_;
};

// The tensors below one dotted prefix. Cheap to copy; valid as long as the store is. All functions
// may be called from several threads.
class WeightScope {
 public:
  WeightScope(const WeightStore& store, std::string prefix)
      : store_(&store), prefix_(std::move(prefix)) {}

  // at("trunk.0").at("attn") is at("trunk.0.attn").
  WeightScope at(std::string_view name) const { return {*store_, full_name(name)}; }
  std::string full_name(std::string_view name) const;

  bool contains(std::string_view name) const;
  // The shape as stored; Error{kWeights} if there is no such tensor.
  const std::vector<int64_t>& shape(std::string_view name) const;
  // The depth of a stack of layers: one more than the largest i of which there is a tensor
  // name.i.SOMETHING, so that a layer with a hole counts, and is missed when it is taken.
  int count(std::string_view name) const;

  // The tensor of exactly this name and shape and of a floating-point type, else Error{kWeights}.
  TensorView take(std::string_view name, std::span<const int64_t> shape) const;
  TensorView take(std::string_view name, std::initializer_list<int64_t> shape) const {
    return take(name, std::span(shape.begin(), shape.size()));
  }
  // The same as floats, for the small ones: biases, norms, tokens.
  std::vector<float> take_f32(std::string_view name, std::initializer_list<int64_t> shape) const;
  // Says that the bytes of a taken tensor are not needed any more.
  void release(const TensorView& taken) const;

 private:
  const WeightStore* store_;
  std::string prefix_;
};

}  // namespace vggtcd
