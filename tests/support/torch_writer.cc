// SPDX-License-Identifier: Apache-2.0
// Pickle protocol 2 with Python's memo numbers, and a minimal zip.
#include "tests/support/torch_writer.h"

#include <zlib.h>

#include <numeric>

#include "vggtcd/core/error.h"

namespace vggtcd::testing {
namespace {

template <typename T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

class PickleWriter {
 public:
  std::string bytes = "\x80\x02";

  uint32_t put() {
    if (memo_ < 256) {
      op('q');
      append(bytes, static_cast<uint8_t>(memo_));
    } else {
      op('r');
      append(bytes, memo_);
    }
    return memo_++;
  }
  void get(uint32_t index) {
    check(index < 256, "PickleWriter: only early values are shared");
    op('h');
    append(bytes, static_cast<uint8_t>(index));
  }
  void op(char opcode) { bytes += opcode; }
  uint32_t global(std::string_view module, std::string_view name) {
    op('c');
    bytes.append(module).append("\n").append(name).append("\n");
    return put();
  }
  uint32_t text(std::string_view text) {
    op('X');
    append(bytes, static_cast<uint32_t>(text.size()));
    bytes.append(text);
    return put();
  }
  void integer(int64_t value) {
    if (value < 0x100) {
      op('K');
      append(bytes, static_cast<uint8_t>(value));
    } else if (value < 0x10000) {
      op('M');
      append(bytes, static_cast<uint16_t>(value));
    } else {
      op('J');
      append(bytes, static_cast<int32_t>(value));
    }
  }
  void tuple(std::span<const int64_t> values) {
    if (values.empty()) return op(')');
    if (values.size() > 3) op('(');
    for (const int64_t value : values) integer(value);
    op(values.size() > 3 ? 't' : static_cast<char>(0x84 + values.size()));
    put();
  }

 private:
  uint32_t memo_ = 0;
};

std::string_view storage_name(DType dtype) {
  switch (dtype) {
    case DType::kF32:
      return "FloatStorage";
    case DType::kF16:
      return "HalfStorage";
    case DType::kBF16:
      return "BFloat16Storage";
    default:
      check(false, "storage_name: a floating-point type");
      return {};
  }
}

std::vector<int64_t> c_order_strides(std::span<const int64_t> shape) {
  std::vector<int64_t> strides(shape.size(), 1);
  for (size_t i = shape.size(); i-- > 1;) strides[i - 1] = strides[i] * shape[i];
  return strides;
}

}  // namespace

std::string state_dict_pickle(std::span<const TensorView> tensors) {
  PickleWriter out;
  const uint32_t ordered_dict = out.global("collections", "OrderedDict");
  out.op(')');
  out.op('R');
  out.put();
  out.op('(');
  // What the pickler remembers from the first tensor.
  uint32_t rebuild = 0, storage = 0, type = 0, cpu = 0;
  for (size_t i = 0; i < tensors.size(); ++i) {
    const TensorView& tensor = tensors[i];
    check(tensor.dtype == tensors[0].dtype, "state_dict_pickle: one type");
    const bool first = i == 0;
    out.text(tensor.name);
    if (first) rebuild = out.global("torch._utils", "_rebuild_tensor_v2");
    if (!first) out.get(rebuild);
    out.op('(');
    out.op('(');
    if (first) storage = out.text("storage");
    if (!first) out.get(storage);
    if (first) type = out.global("torch", storage_name(tensor.dtype));
    if (!first) out.get(type);
    out.text(std::to_string(i));
    if (first) cpu = out.text("cpu");
    if (!first) out.get(cpu);
    out.integer(tensor.numel());
    out.op('t');
    out.put();
    out.op('Q');
    out.integer(0);  // offset
    out.tuple(tensor.shape);
    out.tuple(c_order_strides(tensor.shape));
    out.op(static_cast<char>(0x89));  // requires_grad = False
    out.get(ordered_dict);            // no backward hooks
    out.op(')');
    out.op('R');
    out.put();
    out.op('t');
    out.put();
    out.op('R');
    out.put();
  }
  out.op('u');
  out.op('.');
  return std::move(out.bytes);
}

std::string stored_zip(std::span<const std::pair<std::string, std::string>> members) {
  std::string file, directory;
  for (const auto& [name, data] : members) {
    constexpr size_t kLocalSize = 30, kAlignment = 64;
    const size_t offset = file.size();
    const uint32_t crc =
        static_cast<uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(data.data()), data.size()));
    const size_t unpadded = offset + kLocalSize + name.size() + 4;
    const size_t padding = (kAlignment - unpadded % kAlignment) % kAlignment;
    // Fields common to the local and the central header, from "version needed" to "name length".
    std::string common;  // version, flags, method "stored", time, date are 0
    common.append(10, '\0');
    append(common, crc);
    append(common, static_cast<uint32_t>(data.size()));
    append(common, static_cast<uint32_t>(data.size()));
    append(common, static_cast<uint16_t>(name.size()));

    file += std::string("PK\x03\x04") + common;
    append(file, static_cast<uint16_t>(4 + padding));
    file += name + "FB";
    append(file, static_cast<uint16_t>(padding));
    file.append(padding, 'Z').append(data);

    directory += std::string("PK\x01\x02") + std::string(2, '\0') + common;
    directory.append(12, '\0');  // no extra field, no comment, no attributes
    append(directory, static_cast<uint32_t>(offset));
    directory += name;
  }
  const size_t directory_offset = file.size();
  file += directory + "PK\x05\x06" + std::string(4, '\0');
  append(file, static_cast<uint16_t>(members.size()));
  append(file, static_cast<uint16_t>(members.size()));
  append(file, static_cast<uint32_t>(directory.size()));
  append(file, static_cast<uint32_t>(directory_offset));
  append(file, uint16_t{0});
  return file;
}

std::string torch_zip_file(const std::string& archive_name, std::span<const TensorView> tensors) {
  std::vector<std::pair<std::string, std::string>> members;
  members.emplace_back(archive_name + "/data.pkl", state_dict_pickle(tensors));
  for (size_t i = 0; i < tensors.size(); ++i) {
    members.emplace_back(
        archive_name + "/data/" + std::to_string(i),
        std::string(reinterpret_cast<const char*>(tensors[i].data.data()), tensors[i].data.size()));
  }
  members.emplace_back(archive_name + "/version", "3\n");
  return stored_zip(members);
}

}  // namespace vggtcd::testing
