// SPDX-License-Identifier: Apache-2.0
// torch_checkpoint: containers, the choice of the state dict, strides to C order.
#include "vggtcd/io/torch_checkpoint.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "vggtcd/core/error.h"
#include "vggtcd/io/quote.h"
#include "vggtcd/io/torch_pickle.h"
#include "vggtcd/io/zip_directory.h"

namespace vggtcd {
namespace {

using Kind = PickleValue::Kind;
using Storages = std::map<std::string, std::span<const std::byte>, std::less<>>;

constexpr std::string_view kZipStart = "PK\x03\x04";
// The legacy container starts with a pickle of the number 0x1950a86a20f9469cfc6c.
constexpr std::string_view kLegacyStart{
    "\x80\x02\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19\x2e", 15};

template <typename... Args>
[[noreturn]] void fail(const std::string& name, fmt::format_string<Args...> format,
                       Args&&... args) {
  throw_error(ErrorCode::kWeights, "{}: {}", name,
              fmt::format(format, std::forward<Args>(args)...));
}

bool starts_with(std::span<const std::byte> bytes, std::string_view text) {
  return bytes.size() >= text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
}

// --- which dict ---

bool has_tensors(const PickleValue& value) {
  if (value.kind != Kind::kDict) return false;
  for (size_t i = 1; i < value.items.size(); i += 2) {
    if (value.items[i]->kind == Kind::kTensor) return true;
  }
  return false;
}

const PickleValue& find_state_dict(const PickleValue& root, const std::string& name) {
  if (root.kind != Kind::kDict) {
    fail(name, "expected a state dict, found a pickled {}", pickle_kind_name(root.kind));
  }
  if (has_tensors(root)) return root;
  constexpr size_t kMaxKeys = 1000;
  if (root.items.size() > 2 * kMaxKeys) fail(name, "expected tensors, found a dict without any");
  std::map<std::string_view, const PickleValue*> found;
  for (size_t i = 0; i < root.items.size(); i += 2) {
    if (has_tensors(*root.items[i + 1])) found[root.items[i]->text] = root.items[i + 1];
  }
  for (const std::string_view key : {"model", "state_dict"}) {
    if (found.contains(key)) return *found[key];
  }
  if (found.size() == 1) return *found.begin()->second;
  fail(name, "expected one dict of tensors, found {}; save the state dict alone with torch.save",
       found.size());
}

// --- tensors ---

std::vector<int64_t> integers(const PickleValue& tuple, const std::string& name) {
  constexpr size_t kMaxRank = 16;
  if (tuple.items.size() > kMaxRank) fail(name, "a tensor has more than {} axes", kMaxRank);
  std::vector<int64_t> result;
  for (const PickleValue* item : tuple.items) {
    if (item->kind != Kind::kInt || item->integer < 0) {
      fail(name, "a tensor has a size or stride that is no whole number");
    }
    result.push_back(item->integer);
  }
  return result;
}

// How elements of a storage form a tensor; all values checked to lie inside the storage.
struct Layout {
  std::vector<int64_t> sizes, strides;
  int64_t offset = 0, count = 1;

  bool in_c_order() const {
    int64_t expected = 1;
    for (size_t i = sizes.size(); i-- > 0;) {
      if (sizes[i] != 1 && strides[i] != expected) return false;
      expected *= sizes[i];
    }
    return true;
  }
};

Layout checked_layout(const PickleValue& tensor, std::string_view key, const std::string& name) {
  Layout layout;
  layout.offset = tensor.items[1]->integer;
  layout.sizes = integers(*tensor.items[2], name);
  layout.strides = integers(*tensor.items[3], name);
  const int64_t capacity = tensor.items[0]->integer;
  if (layout.sizes.size() != layout.strides.size()) {
    fail(name, "tensor {} has {} sizes and {} strides", quote(key), layout.sizes.size(),
         layout.strides.size());
  }
  const bool empty = std::ranges::find(layout.sizes, 0) != layout.sizes.end();
  bool overflow = layout.offset < 0;
  int64_t last = layout.offset;
  for (size_t i = 0; i < layout.sizes.size(); ++i) {
    int64_t step = 0;
    overflow |= __builtin_mul_overflow(layout.count, layout.sizes[i], &layout.count);
    if (layout.sizes[i] == 1) layout.strides[i] = 0;  // any stride may stand there
    if (empty) continue;
    overflow |= __builtin_mul_overflow(layout.sizes[i] - 1, layout.strides[i], &step);
    overflow |= __builtin_add_overflow(last, step, &last);
  }
  if (empty) layout.count = 0;
  if (overflow || (!empty && last >= capacity)) {
    fail(name, "tensor {} {} reaches beyond its storage of {} elements", quote(key),
         shape_string(layout.sizes), capacity);
  }
  if (layout.count > capacity) {
    fail(name, "tensor {} {} repeats elements of its storage; save it with contiguous()",
         quote(key), shape_string(layout.sizes));
  }
  return layout;
}

void copy_to_c_order(const Layout& layout, size_t element_size, const std::byte* source,
                     std::byte* target) {
  std::vector<int64_t> index(layout.sizes.size(), 0);
  int64_t from = 0;
  for (int64_t i = 0; i < layout.count; ++i) {
    std::memcpy(target, source + static_cast<size_t>(from) * element_size, element_size);
    target += element_size;
    for (size_t axis = index.size(); axis-- > 0;) {
      from += layout.strides[axis];
      if (++index[axis] < layout.sizes[axis]) break;
      from -= layout.strides[axis] * layout.sizes[axis];
      index[axis] = 0;
    }
  }
}

// Turns the entries of the state dict into views, copying what cannot be viewed.
class TensorBuilder {
 public:
  using Find = std::function<std::span<const std::byte>(const PickleValue& storage)>;

  TensorBuilder(const std::string& name, size_t max_copied_bytes, Find find)
      : name_(name), max_copied_bytes_(max_copied_bytes), find_(std::move(find)) {}

  void add_all(const PickleValue& state_dict, WeightFile& file) {
    std::set<std::string_view> names;
    for (size_t i = 0; i < state_dict.items.size(); i += 2) {
      const PickleValue& key = *state_dict.items[i];
      const PickleValue& value = *state_dict.items[i + 1];
      if (value.kind != Kind::kTensor) continue;
      if (key.kind != Kind::kString) {
        fail(name_, "a tensor is named by a {}, expected a string", pickle_kind_name(key.kind));
      }
      if (!names.insert(key.text).second) fail(name_, "tensor {} is there twice", quote(key.text));
      file.tensors.push_back(build(key.text, value));
    }
    file.storage = copies_;
  }

 private:
  TensorView build(std::string_view key, const PickleValue& tensor) {
    const PickleValue& storage = *tensor.items[0];
    const size_t element_size = dtype_size(storage.dtype);
    Layout layout = checked_layout(tensor, key, name_);
    const std::span<const std::byte> data = find_(storage);
    if (data.size() / element_size < static_cast<size_t>(storage.integer)) {
      fail(name_, "tensor {}: storage {} should have {} bytes, found {}; download the file again",
           quote(key), quote(storage.text), static_cast<size_t>(storage.integer) * element_size,
           data.size());
    }
    TensorView view{std::string(key), storage.dtype, layout.sizes, {}};
    if (layout.count == 0) return view;
    const size_t size = static_cast<size_t>(layout.count) * element_size;
    const std::byte* source = data.data() + static_cast<size_t>(layout.offset) * element_size;
    const bool aligned = reinterpret_cast<uintptr_t>(source) % element_size == 0;
    if (aligned && layout.in_c_order()) {
      view.data = {source, size};
      return view;
    }
    if (size > max_copied_bytes_ - copied_bytes_) {
      fail(name_, "its tensors share storages more than {} bytes allow", max_copied_bytes_);
    }
    copied_bytes_ += size;
    std::vector<std::byte>& copy = copies_->emplace_back(size);
    copy_to_c_order(layout, element_size, source, copy.data());
    view.data = copy;
    return view;
  }

  const std::string& name_;
  size_t max_copied_bytes_, copied_bytes_ = 0;
  Find find_;
  std::shared_ptr<std::vector<std::vector<std::byte>>> copies_ =
      std::make_shared<std::vector<std::vector<std::byte>>>();
};

// --- containers ---

WeightFile parse_zip(std::span<const std::byte> bytes, const std::string& name) {
  std::map<std::string, std::span<const std::byte>, std::less<>> members;
  std::string prefix;
  for (ZipMember& member : read_zip_directory(bytes, name, ErrorCode::kWeights)) {
    if (member.name.ends_with("/data.pkl")) {
      prefix = member.name.substr(0, member.name.size() - std::string_view("data.pkl").size());
    }
    members.emplace(std::move(member.name), member.data);
  }
  if (prefix.empty()) fail(name, "expected a PyTorch checkpoint, found a zip without data.pkl");
  if (members.contains(prefix + "constants.pkl")) {
    fail(name, "expected a state dict, found a TorchScript program; save model.state_dict()");
  }
  const auto order = members.find(prefix + "byteorder");
  if (order != members.end() && !starts_with(order->second, "little")) {
    fail(name, "expected little-endian numbers, found another byte order");
  }
  const Pickle pickle = read_torch_pickle(members[prefix + "data.pkl"], name);
  const auto find = [&](const PickleValue& storage) {
    const auto member = members.find(prefix + "data/" + std::string(storage.text));
    if (member == members.end()) fail(name, "storage {} is missing", quote(storage.text));
    return member->second;
  };
  WeightFile file;
  file.format = WeightFormat::kTorchZip;
  TensorBuilder(name, bytes.size(), find).add_all(find_state_dict(*pickle.root, name), file);
  return file;
}

const PickleValue* dict_item(const PickleValue& dict, std::string_view key) {
  for (size_t i = 0; dict.kind == Kind::kDict && i < dict.items.size(); i += 2) {
    if (dict.items[i]->text == key) return dict.items[i + 1];
  }
  return nullptr;
}

// Pickles one after the other: magic number, protocol, system, the object, the list of storage
// keys; then for each key the number of elements and the elements.
WeightFile parse_legacy(std::span<const std::byte> bytes, const std::string& name) {
  std::span<const std::byte> rest = bytes.subspan(kLegacyStart.size());
  const auto next_pickle = [&] {
    Pickle pickle = read_torch_pickle(rest, name);
    rest = rest.subspan(pickle.size);
    return pickle;
  };
  next_pickle();  // protocol version: 1001 since 2017
  const Pickle system = next_pickle();
  const PickleValue* little_endian = dict_item(*system.root, "little_endian");
  if (little_endian == nullptr || little_endian->integer != 1) {
    fail(name, "expected little-endian numbers, found another byte order");
  }
  const Pickle object = next_pickle();
  const Pickle keys = next_pickle();

  std::map<std::string_view, size_t> element_sizes;
  for (const PickleValue& value : object.values) {
    if (value.kind == Kind::kStorage) element_sizes[value.text] = dtype_size(value.dtype);
  }
  Storages storages;
  for (const PickleValue* key : keys.root->items) {
    uint64_t count = 0, size = 0;
    if (rest.size() < sizeof(count)) fail(name, "cut off; download it again");
    std::memcpy(&count, rest.data(), sizeof(count));
    rest = rest.subspan(sizeof(count));
    if (!element_sizes.contains(key->text) ||
        __builtin_mul_overflow(count, element_sizes[key->text], &size) || size > rest.size()) {
      fail(name, "storage {} is cut off or unknown; download it again", quote(key->text));
    }
    storages.emplace(std::string(key->text), rest.first(size));
    rest = rest.subspan(size);
  }
  const auto find = [&](const PickleValue& storage) {
    const auto found = storages.find(storage.text);
    if (found == storages.end()) fail(name, "storage {} is missing", quote(storage.text));
    return found->second;
  };
  WeightFile file;
  file.format = WeightFormat::kTorchLegacy;
  TensorBuilder(name, bytes.size(), find).add_all(find_state_dict(*object.root, name), file);
  return file;
}

}  // namespace

bool is_torch_checkpoint(std::span<const std::byte> bytes) {
  return starts_with(bytes, kZipStart) || starts_with(bytes, kLegacyStart);
}

WeightFile parse_torch_checkpoint(std::span<const std::byte> bytes, const std::string& name) {
  return starts_with(bytes, kZipStart) ? parse_zip(bytes, name) : parse_legacy(bytes, name);
}

}  // namespace vggtcd
