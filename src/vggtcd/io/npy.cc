// SPDX-License-Identifier: Apache-2.0
// The elements of .npy: streaming, conversion, Fortran order.
#include "vggtcd/io/npy.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>

#include "vggtcd/core/error.h"
#include "vggtcd/core/tensor_view.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/input_file.h"
#include "vggtcd/io/output_file.h"

namespace vggtcd {
namespace {

constexpr size_t kSlabBytes = size_t{1} << 20;

struct Half {
  uint16_t bits;
};

// Calls use(Source{}) with the C++ type of the elements; false if it is not a number.
template <typename Use>
bool with_number_type(const NpyHeader& header, const Use& use) {
  switch (header.kind) {
    case NpyKind::kBool:
      return use(bool{}), true;
    case NpyKind::kFloat:
      if (header.item_size == 2) return use(Half{}), true;
      if (header.item_size == 4) return use(float{}), true;
      return use(double{}), true;
    case NpyKind::kInt:
      if (header.item_size == 1) return use(int8_t{}), true;
      if (header.item_size == 2) return use(int16_t{}), true;
      if (header.item_size == 4) return use(int32_t{}), true;
      return use(int64_t{}), true;
    case NpyKind::kUnsigned:
      if (header.item_size == 1) return use(uint8_t{}), true;
      if (header.item_size == 2) return use(uint16_t{}), true;
      if (header.item_size == 4) return use(uint32_t{}), true;
      return use(uint64_t{}), true;
    default:
      return false;
  }
}

template <typename Target, typename Source>
constexpr bool convertible() {
  if constexpr (std::is_floating_point_v<Target>) return true;
  if constexpr (std::is_same_v<Target, int64_t>) {
    return std::is_integral_v<Source> && !std::is_same_v<Source, bool>;
  }
  return std::is_same_v<Target, uint8_t> &&
         (std::is_same_v<Source, uint8_t> || std::is_same_v<Source, bool>);
}

template <typename Source>
Source load(const std::byte* source) {
  if constexpr (std::is_same_v<Source, bool>) {
    return *source != std::byte{0};  // any other byte in a bool would be undefined behaviour
  } else {
    Source value;
    std::memcpy(&value, source, sizeof(Source));
    return value;
  }
}

template <typename Target, typename Source>
Target convert(Source value, std::string_view what) {
  if constexpr (std::is_same_v<Source, Half>) {
    return static_cast<Target>(float_from_half(value.bits));
  } else {
    if constexpr (std::is_same_v<Target, int64_t> && std::is_same_v<Source, uint64_t>) {
      if (value > static_cast<uint64_t>(std::numeric_limits<int64_t>::max())) {
        throw_error(ErrorCode::kInput, "{}: expected integers below 2^63, found {}", what, value);
      }
    }
    return static_cast<Target>(value);
  }
}

template <typename T>
std::string_view wanted_name() {
  if constexpr (std::is_floating_point_v<T>) return "numbers";
  if constexpr (std::is_same_v<T, int64_t>) return "integers";
  return "8-bit unsigned integers or bool";
}

[[noreturn]] void throw_wrong_type(std::string_view what, std::string_view wanted,
                                   const NpyHeader& header) {
  throw_error(ErrorCode::kInput, "{}: expected {}, found {}", what, wanted,
              header.kind == NpyKind::kObject ? "Python objects" : "type " + header.descr);
}

// The elements in file order, converted, in runs of at most kSlabBytes.
template <typename T>
void read_in_file_order(const NpyHeader& header, const ReadBytes& read, std::string_view what,
                        const NpySlabs<T>& sink) {
  const auto with_type = [&]<typename Source>(Source) {
    if constexpr (!convertible<T, Source>()) {
      throw_wrong_type(what, wanted_name<T>(), header);
    } else {
      const int64_t total = header.numel();
      const int64_t slab = static_cast<int64_t>(kSlabBytes / sizeof(double));
      const size_t capacity = static_cast<size_t>(std::min(total, slab));
      std::vector<std::byte> bytes(capacity * sizeof(Source));
      std::vector<T> values(capacity);
      for (int64_t first = 0; first < total; first += slab) {
        const size_t count = static_cast<size_t>(std::min(slab, total - first));
        read(std::span(bytes).first(count * sizeof(Source)));
        for (size_t i = 0; i < count; ++i) {
          values[i] = convert<T>(load<Source>(bytes.data() + i * sizeof(Source)), what);
        }
        sink(first, std::span<const T>(values).first(count));
      }
    }
  };
  if (header.big_endian) {
    throw_error(ErrorCode::kInput,
                "{}: expected little-endian data, found type {}; save it with "
                "array.astype(array.dtype.newbyteorder('<'))",
                what, header.descr);
  }
  if (!with_number_type(header, with_type)) throw_wrong_type(what, wanted_name<T>(), header);
}

// Walks the C order indices of elements that come in Fortran order.
class FortranWalk {
 public:
  explicit FortranWalk(std::span<const int64_t> shape) : shape_(shape), index_(shape.size(), 0) {
    strides_.resize(shape.size());
    int64_t stride = 1;
    for (size_t axis = shape.size(); axis-- > 0;) {
      strides_[axis] = stride;
      stride *= shape[axis];
    }
  }
  size_t next() {
    const size_t result = static_cast<size_t>(offset_);
    for (size_t axis = 0; axis < shape_.size(); ++axis) {
      offset_ += strides_[axis];
      if (++index_[axis] < shape_[axis]) break;
      offset_ -= strides_[axis] * shape_[axis];
      index_[axis] = 0;
    }
    return result;
  }

 private:
  std::span<const int64_t> shape_;
  std::vector<int64_t> index_;
  std::vector<int64_t> strides_;
  int64_t offset_ = 0;
};

template <typename T>
bool is_exactly(const NpyHeader& header) {
  bool same = false;
  with_number_type(header, [&]<typename S>(S) { same = std::is_same_v<S, T>; });
  return same && !header.big_endian;
}

void append_utf8(std::string& text, uint32_t code, std::string_view what) {
  if (code > 0x10ffff) {
    throw_error(ErrorCode::kInput, "{}: expected Unicode text, found code point {:#x}", what, code);
  }
  // Python keeps bytes of names that are not UTF-8 as single surrogates, which no UTF-8 can hold.
  constexpr uint32_t kReplacement = 0xfffd;
  if (code >= 0xd800 && code < 0xe000) code = kReplacement;
  const auto tail = [&](unsigned shift) {
    text += static_cast<char>(0x80 | ((code >> shift) & 0x3f));
  };
  if (code < 0x80) {
    text += static_cast<char>(code);
  } else if (code < 0x800) {
    text += static_cast<char>(0xc0 | (code >> 6));
    tail(0);
  } else if (code < 0x10000) {
    text += static_cast<char>(0xe0 | (code >> 12));
    tail(6), tail(0);
  } else {
    text += static_cast<char>(0xf0 | (code >> 18));
    tail(12), tail(6), tail(0);
  }
}

}  // namespace

template <typename T>
void read_npy_array(const NpyHeader& header, const ReadBytes& read, std::string_view what,
                    std::span<T> target) {
  check(static_cast<int64_t>(target.size()) == header.numel(), "read_npy_array: target size");
  if (header.fortran_order) {
    FortranWalk walk(header.shape);
    read_in_file_order<T>(header, read, what, [&](int64_t, std::span<const T> values) {
      for (const T value : values) target[walk.next()] = value;
    });
  } else if (is_exactly<T>(header)) {
    read(std::as_writable_bytes(target));
  } else {
    read_in_file_order<T>(header, read, what, [&](int64_t first, std::span<const T> values) {
      std::copy(values.begin(), values.end(), target.begin() + first);
    });
  }
}

template <typename T>
void read_npy_slabs(const NpyHeader& header, const ReadBytes& read, std::string_view what,
                    const NpySlabs<T>& sink) {
  if (!header.fortran_order) return read_in_file_order<T>(header, read, what, sink);
  std::vector<T> values(static_cast<size_t>(header.numel()));
  read_npy_array<T>(header, read, what, values);
  sink(0, values);
}

#define VGGTCD_INSTANTIATE(T)                                                           \
  template void read_npy_array<T>(const NpyHeader&, const ReadBytes&, std::string_view, \
                                  std::span<T>);                                        \
  template void read_npy_slabs<T>(const NpyHeader&, const ReadBytes&, std::string_view, \
                                  const NpySlabs<T>&);
VGGTCD_INSTANTIATE(float)
VGGTCD_INSTANTIATE(double)
VGGTCD_INSTANTIATE(int64_t)
VGGTCD_INSTANTIATE(uint8_t)
#undef VGGTCD_INSTANTIATE

std::vector<std::string> read_npy_strings(const NpyHeader& header, const ReadBytes& read,
                                          std::string_view what) {
  if ((header.kind != NpyKind::kUnicode && header.kind != NpyKind::kBytes) || header.big_endian ||
      header.shape.size() > 1) {
    throw_wrong_type(what, "a list of text", header);
  }
  const size_t count = static_cast<size_t>(header.numel());
  std::vector<std::string> strings(header.item_size == 0 ? 0 : count);
  std::vector<std::byte> bytes(header.item_size);
  for (std::string& text : strings) {
    read(bytes);
    const size_t step = header.kind == NpyKind::kUnicode ? 4 : 1;
    for (size_t i = 0; i < bytes.size(); i += step) {
      const uint32_t code = step == 4 ? load<uint32_t>(bytes.data() + i)
                                      : static_cast<uint32_t>(load<uint8_t>(bytes.data() + i));
      if (code == 0) break;  // padding
      if (code >= kEscapedByte + 0x80 && code <= kEscapedByte + 0xff) {
        text += static_cast<char>(code - kEscapedByte);
      } else {
        append_utf8(text, code, what);
      }
    }
  }
  return strings;
}

NpyDoubles read_npy_file(const std::filesystem::path& path) try {
  const std::string what = path.string();
  InputFile file(path, "a readable .npy file");
  const ReadBytes read = [&](std::span<std::byte> bytes) {
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (static_cast<size_t>(file.gcount()) != bytes.size()) {
      throw_error(ErrorCode::kInput, "{}: expected more data, found the end of the file", what);
    }
  };
  const NpyHeader header = read_npy_header(read, what);
  // Before memory is reserved: the file must have what the header promises.
  const auto position = static_cast<int64_t>(file.tellg());
  const auto left = static_cast<int64_t>(file.size()) - position;
  if (header.item_size > 0 && header.data_bytes() != left) {
    throw_error(ErrorCode::kInput, "{}: expected {} bytes of data, found {}", what,
                header.data_bytes(), left);
  }
  NpyDoubles result{header.shape, {}};
  if (header.item_size == 0) throw_wrong_type(what, "numbers", header);
  result.values.resize(static_cast<size_t>(header.numel()));
  read_npy_array<double>(header, read, what, result.values);
  return result;
} catch (...) {
  rethrow_naming(path);
}

void write_npy_file(const std::filesystem::path& path, std::span<const int64_t> shape,
                    std::span<const double> values) {
  OutputFile file(path);
  file.write(npy_header("<f8", shape));
  file.write(std::as_bytes(values));
  file.commit();
}

}  // namespace vggtcd
