// SPDX-License-Identifier: Apache-2.0
// The header of .npy: a Python dict literal, read by a parser for exactly what NumPy writes.
#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <limits>
#include <optional>

#include "vggtcd/core/error.h"
#include "vggtcd/core/number_text.h"
#include "vggtcd/core/tensor_view.h"
#include "vggtcd/io/npy.h"

namespace vggtcd {
namespace {

constexpr size_t kMaxHeaderBytes = size_t{1} << 20;
constexpr size_t kMaxDimensions = 64;  // NumPy 2's own limit

// Parses {'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }. A nullopt says what broke it.
class DictParser {
 public:
  explicit DictParser(std::string_view text) : text_(text) {}

  std::optional<NpyHeader> parse() {
    NpyHeader header;
    bool have_descr = false, have_order = false, have_shape = false;
    if (!accept('{')) return std::nullopt;
    while (!accept('}')) {
      const std::optional<std::string> key = quoted();
      if (!key || !accept(':')) return std::nullopt;
      bool ok = false;
      if (*key == "descr" && !have_descr) {
        ok = have_descr = parse_descr(header.descr);
      } else if (*key == "fortran_order" && !have_order) {
        ok = have_order = parse_bool(header.fortran_order);
      } else if (*key == "shape" && !have_shape) {
        ok = have_shape = parse_shape(header.shape);
      }
      if (!ok) return std::nullopt;
      if (!accept(',') && !peek('}')) return std::nullopt;
    }
    skip_space();
    if (!text_.empty() || !have_descr || !have_order || !have_shape) return std::nullopt;
    return header;
  }

 private:
  void skip_space() {
    while (!text_.empty() && (text_[0] == ' ' || text_[0] == '\n')) text_.remove_prefix(1);
  }
  bool peek(char wanted) {
    skip_space();
    return !text_.empty() && text_[0] == wanted;
  }
  bool accept(char wanted) {
    if (!peek(wanted)) return false;
    text_.remove_prefix(1);
    return true;
  }
  bool accept(std::string_view wanted) {
    skip_space();
    if (!text_.starts_with(wanted)) return false;
    text_.remove_prefix(wanted.size());
    return true;
  }
  std::optional<std::string> quoted() {
    skip_space();
    if (text_.empty() || (text_[0] != '\'' && text_[0] != '"')) return std::nullopt;
    const size_t end = text_.find(text_[0], 1);
    if (end == std::string_view::npos) return std::nullopt;
    std::string value(text_.substr(1, end - 1));
    if (value.find('\n') != std::string::npos) return std::nullopt;
    text_.remove_prefix(end + 1);
    return value;
  }
  bool parse_bool(bool& value) {
    value = accept("True");
    return value || accept("False");
  }
  // A string, or the list of fields of a structure, which is kept as text and never read further.
  bool parse_descr(std::string& descr) {
    if (const std::optional<std::string> simple = quoted()) {
      descr = *simple;
      return true;
    }
    if (!peek('[')) return false;
    int depth = 0;
    for (size_t i = 0; i < text_.size(); ++i) {
      if (text_[i] == '[') ++depth;
      if (text_[i] == ']' && --depth == 0) {
        descr = std::string(text_.substr(0, i + 1));
        if (descr.find('\n') != std::string::npos) return false;
        text_.remove_prefix(i + 1);
        return true;
      }
    }
    return false;
  }
  bool parse_shape(std::vector<int64_t>& shape) {
    if (!accept('(')) return false;
    while (!accept(')')) {
      skip_space();
      int64_t size = 0;
      const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), size);
      if (error != std::errc() || size < 0 || shape.size() == kMaxDimensions) return false;
      text_.remove_prefix(static_cast<size_t>(end - text_.data()));
      if (!text_.empty() && text_[0] == 'L') text_.remove_prefix(1);  // a long of Python 2
      shape.push_back(size);
      if (!accept(',') && !peek(')')) return false;
    }
    return true;
  }

  std::string_view text_;
};

// "<f4" -> kind, size and byte order; leaves kOther where it is none of ours.
void decode_type(NpyHeader& header) {
  const std::string_view descr = header.descr;
  if (descr == "O" || descr == "|O") header.kind = NpyKind::kObject;
  if (descr.size() < 3 || std::string_view("<>|=").find(descr[0]) == std::string_view::npos) return;
  const auto count = number_in<uint32_t>(descr.substr(2));
  if (!count) return;

  const auto one_of = [&](std::initializer_list<uint32_t> sizes) {
    return std::find(sizes.begin(), sizes.end(), *count) != sizes.end();
  };
  switch (descr[1]) {
    case 'b':
      if (one_of({1})) header.kind = NpyKind::kBool;
      break;
    case 'i':
      if (one_of({1, 2, 4, 8})) header.kind = NpyKind::kInt;
      break;
    case 'u':
      if (one_of({1, 2, 4, 8})) header.kind = NpyKind::kUnsigned;
      break;
    case 'f':
      if (one_of({2, 4, 8})) header.kind = NpyKind::kFloat;
      break;
    case 'U':
      header.kind = NpyKind::kUnicode;
      break;
    case 'S':
      header.kind = NpyKind::kBytes;
      break;
    case 'O':
      header.kind = NpyKind::kObject;
      break;
    default:
      break;
  }
  if (header.kind == NpyKind::kOther || header.kind == NpyKind::kObject) return;
  header.item_size = header.kind == NpyKind::kUnicode ? size_t{4} * *count : *count;
  header.big_endian = descr[0] == '>' && header.item_size > 1;
}

bool size_overflows(const NpyHeader& header) {
  // Zero sizes do not excuse the others: numel() multiplies in order.
  int64_t bytes = static_cast<int64_t>(std::max<size_t>(header.item_size, 1));
  for (const int64_t size : header.shape) {
    if (__builtin_mul_overflow(bytes, std::max<int64_t>(size, 1), &bytes)) return true;
  }
  return false;
}

}  // namespace

int64_t NpyHeader::numel() const {
  int64_t count = 1;
  for (const int64_t size : shape) count *= size;
  return count;
}

NpyHeader read_npy_header(const ReadBytes& read, std::string_view what) {
  std::array<unsigned char, 12> start{};
  const auto bytes = std::as_writable_bytes(std::span(start));
  read(bytes.first(8));
  if (std::memcmp(start.data(), "\x93NUMPY", 6) != 0) {
    throw_error(ErrorCode::kInput, "{}: expected a NumPy array, found other data", what);
  }
  const int version = start[6];
  if (version < 1 || version > 3) {
    throw_error(ErrorCode::kInput, "{}: expected .npy version 1 to 3, found {}.{}", what, version,
                start[7]);
  }
  const size_t length_bytes = version == 1 ? 2 : 4;
  read(bytes.subspan(8, length_bytes));
  size_t length = 0;
  for (size_t i = length_bytes; i-- > 0;) length = length << 8 | start[8 + i];
  if (length > kMaxHeaderBytes) {
    throw_error(ErrorCode::kInput, "{}: expected an array header below 1 MiB, found {} bytes", what,
                length);
  }
  std::string text(length, '\0');
  read(std::as_writable_bytes(std::span(text)));

  // A type is shown in messages of one line; the final newline is NumPy's.
  const bool printable =
      std::all_of(text.begin(), text.end(), [](unsigned char c) { return c >= 0x20 || c == '\n'; });
  std::optional<NpyHeader> header =
      printable ? DictParser(text).parse() : std::optional<NpyHeader>();
  if (header) decode_type(*header);  // the size in bytes depends on it
  if (!header || size_overflows(*header)) {
    throw_error(ErrorCode::kInput, "{}: expected an array header as NumPy writes it, found {}",
                what,
                header ? "the impossible shape " + shape_string(header->shape) : "other text");
  }
  if (header->shape.size() < 2) header->fortran_order = false;
  return *std::move(header);
}

std::string npy_header(std::string_view descr, std::span<const int64_t> shape) {
  std::string sizes;
  for (const int64_t size : shape) {
    sizes += fmt::format("{}{}", sizes.empty() ? "" : ", ", size);
  }
  if (shape.size() == 1) sizes += ',';
  std::string dict =
      fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", descr, sizes);
  // Magic, version and length take 10 bytes; data begins at a multiple of 64 after a newline.
  dict.append(63 - (10 + dict.size()) % 64, ' ');
  dict += '\n';
  check(dict.size() <= std::numeric_limits<uint16_t>::max(), "npy_header: shape too long");
  std::string header("\x93NUMPY\x01\x00", 8);
  header += static_cast<char>(dict.size() & 0xff);
  header += static_cast<char>(dict.size() >> 8);
  return header + dict;
}

}  // namespace vggtcd
