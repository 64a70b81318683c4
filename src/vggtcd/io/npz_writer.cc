// SPDX-License-Identifier: Apache-2.0
// NpzWriter: libzip fed straight from the caller's arrays.
#include <zip.h>

#include <algorithm>
#include <cstring>
#include <string>

#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/io/npz.h"

namespace vggtcd {
namespace {

// 1 January 1980, the first day a zip archive knows, as DOS date and time.
constexpr zip_uint16_t kDosDate = 1 << 5 | 1;
constexpr zip_uint16_t kDosTime = 0;

template <typename T>
std::string_view npy_descr();
template <>
std::string_view npy_descr<float>() {
  return "<f4";
}
template <>
std::string_view npy_descr<double>() {
  return "<f8";
}
template <>
std::string_view npy_descr<int32_t>() {
  return "<i4";
}
template <>
std::string_view npy_descr<int64_t>() {
  return "<i8";
}
template <>
std::string_view npy_descr<uint8_t>() {
  return "|u1";
}

// UTF-8 to code points; bytes that are not UTF-8 (file names may hold any) become U+FFFD.
std::u32string code_points(std::string_view utf8) {
  std::u32string result;
  for (size_t i = 0; i < utf8.size();) {
    const auto lead = static_cast<unsigned char>(utf8[i]);
    const size_t length = lead < 0x80             ? 1
                          : (lead & 0xe0) == 0xc0 ? 2
                          : (lead & 0xf0) == 0xe0 ? 3
                          : (lead & 0xf8) == 0xf0 ? 4
                                                  : 0;
    bool valid = length > 0 && i + length <= utf8.size();
    char32_t code = length == 1 ? lead : lead & (0xffu >> (length + 1));
    for (size_t k = 1; valid && k < length; ++k) {
      const auto tail = static_cast<unsigned char>(utf8[i + k]);
      valid = (tail & 0xc0) == 0x80;
      code = code << 6 | (tail & 0x3fu);
    }
    valid = valid && code <= 0x10ffff && (code < 0xd800 || code >= 0xe000);
    result += valid ? code : U'\ufffd';
    i += valid ? length : 1;
  }
  return result;
}

}  // namespace

struct NpzWriter::Member {
  std::string key;
  std::string header;
  std::span<const std::byte> bytes;
  std::vector<char32_t> owned{};  // what `bytes` points to, for text
};

NpzWriter::NpzWriter(std::filesystem::path path, NpzCompression compression)
    : path_(std::move(path)), compression_(compression) {}

NpzWriter::~NpzWriter() = default;

void NpzWriter::add_bytes(std::string_view key, std::string_view descr,
                          std::span<const int64_t> shape, size_t item_size,
                          std::span<const std::byte> bytes) {
  size_t expected = item_size;
  for (const int64_t size : shape) expected *= static_cast<size_t>(size);
  check(bytes.size() == expected, "NpzWriter: as many values as the shape says");
  for (const Member& member : members_) check(member.key != key, "NpzWriter: a key added once");
  members_.push_back({std::string(key), npy_header(descr, shape), bytes});
}

template <typename T>
void NpzWriter::add(std::string_view key, std::vector<int64_t> shape, std::span<const T> values) {
  add_bytes(key, npy_descr<T>(), shape, sizeof(T), std::as_bytes(values));
}
template void NpzWriter::add(std::string_view, std::vector<int64_t>, std::span<const float>);
template void NpzWriter::add(std::string_view, std::vector<int64_t>, std::span<const double>);
template void NpzWriter::add(std::string_view, std::vector<int64_t>, std::span<const int32_t>);
template void NpzWriter::add(std::string_view, std::vector<int64_t>, std::span<const int64_t>);
template void NpzWriter::add(std::string_view, std::vector<int64_t>, std::span<const uint8_t>);

void NpzWriter::add_mask(std::string_view key, std::vector<int64_t> shape,
                         std::span<const uint8_t> mask) {
  add_bytes(key, "|b1", shape, 1, std::as_bytes(mask));
}

void NpzWriter::add_strings(std::string_view key, std::span<const std::string> utf8) {
  std::vector<std::u32string> texts;
  size_t longest = 1;
  for (const std::string& text : utf8) {
    texts.push_back(code_points(text));
    longest = std::max(longest, texts.back().size());
  }
  std::vector<char32_t> padded(utf8.size() * longest, 0);
  for (size_t i = 0; i < texts.size(); ++i) {
    std::copy(texts[i].begin(), texts[i].end(),
              padded.begin() + static_cast<std::ptrdiff_t>(i * longest));
  }
  const int64_t count = static_cast<int64_t>(utf8.size());
  add_bytes(key, fmt::format("<U{}", longest), {&count, 1}, 4 * longest,
            std::as_bytes(std::span(padded)));
  members_.back().owned = std::move(padded);  // moving a vector keeps its elements in place
}

void NpzWriter::finish() {
  check(!members_.empty(), "NpzWriter: at least one array");
  const auto fail = [&](std::string_view reason) {
    throw_error(ErrorCode::kOutput, "{}: cannot be written: {}", path_.string(), reason);
  };
  if (std::filesystem::is_directory(path_)) fail("is a directory");
  int open_error = 0;
  zip_t* zip = zip_open(path_.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &open_error);
  if (zip == nullptr) {
    zip_error_t error;
    zip_error_init_with_code(&error, open_error);
    const std::string text = zip_error_strerror(&error);
    zip_error_fini(&error);
    fail(text);
  }
  for (const Member& member : members_) {
    const auto length = [](auto& bytes) { return static_cast<zip_uint64_t>(bytes.size()); };
    // libzip takes pointers to non-const but, with freep 0, only reads.
    const auto data = [](auto& bytes) {
      return reinterpret_cast<zip_uint8_t*>(
          const_cast<void*>(static_cast<const void*>(bytes.data())));
    };
    const zip_buffer_fragment_t parts[] = {{data(member.header), length(member.header)},
                                           {data(member.bytes), length(member.bytes)}};
    zip_source_t* source = zip_source_buffer_fragment(zip, parts, member.bytes.empty() ? 1 : 2, 0);
    const std::string name = member.key + ".npy";
    const zip_int64_t index =
        source == nullptr ? -1 : zip_file_add(zip, name.c_str(), source, ZIP_FL_ENC_UTF_8);
    const int method = compression_ == NpzCompression::kDeflate ? ZIP_CM_DEFLATE : ZIP_CM_STORE;
    if (index < 0 ||
        zip_set_file_compression(zip, static_cast<zip_uint64_t>(index), method, 0) != 0 ||
        zip_file_set_dostime(zip, static_cast<zip_uint64_t>(index), kDosTime, kDosDate, 0) != 0) {
      const std::string text = zip_strerror(zip);
      if (index < 0 && source != nullptr) zip_source_free(source);
      zip_discard(zip);
      fail(text);
    }
  }
  const auto interrupted = [](zip_t*, void*) { return interrupt_requested() ? 1 : 0; };
  zip_register_cancel_callback_with_state(zip, interrupted, nullptr, nullptr);
  // Writes to a temporary file beside the target and renames it.
  if (zip_close(zip) != 0) {
    const std::string text = zip_strerror(zip);
    zip_discard(zip);
    throw_if_interrupted();
    fail(text);
  }
}

}  // namespace vggtcd
