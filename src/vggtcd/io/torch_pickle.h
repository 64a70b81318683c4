// SPDX-License-Identifier: Apache-2.0
// torch_pickle: the part of Python's pickle that PyTorch checkpoints consist of, read as data.
// A pickle is a program for a stack machine that may call anything; this machine knows numbers,
// text, containers and tensors, and throws at everything else. Nothing is ever called.
// Source: Python's pickletools (opcodes); torch.serialization (persistent ids, rebuild functions).
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/core/tensor_view.h"

namespace vggtcd {

struct PickleValue {
  enum class Kind {
    kNone,
    kBool,     // integer
    kInt,      // integer
    kFloat,    // real
    kString,   // text; bytes, too
    kList,     // items
    kTuple,    // items
    kDict,     // items: key, value, key, value, ...
    kGlobal,   // text: "module name", one of the accepted ones
    kStorage,  // text: key; integer: number of elements; dtype
    kTensor    // items: storage, offset, sizes, strides (kStorage, kInt, kTuple, kTuple)
  };
  Kind kind = Kind::kNone;
  DType dtype = DType::kF32;
  int64_t integer = 0;
  double real = 0;
  std::string_view text;  // into the pickle's bytes
  std::vector<const PickleValue*> items;
};

std::string_view pickle_kind_name(PickleValue::Kind kind);  // "int", "dict", ...

struct Pickle {
  // Owns all values, so that cycles and sharing need no thought; addresses do not change.
  std::deque<PickleValue> values;
  const PickleValue* root = nullptr;
  size_t size = 0;  // bytes up to and including STOP
};

// Reads one pickle at the start of `bytes`, which must outlive the result. Bounded: 64 MB, a
// million values. Throws Error{kWeights} naming the opcode or global that is not accepted.
Pickle read_torch_pickle(std::span<const std::byte> bytes, const std::string& name);

}  // namespace vggtcd
