// SPDX-License-Identifier: Apache-2.0
// NpzWriter: libzip fed piece by piece with what the caller has or makes.
#include <zip.h>

#include <algorithm>
#include <exception>
#include <memory>
#include <string>

#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/io/output_file.h"
#include "vggtcd/io/quote.h"

namespace vggtcd {
namespace {

// 1 January 1980, the first day a zip archive knows, as DOS date and time.
constexpr zip_uint16_t kDosDate = 1 << 5 | 1;
constexpr zip_uint16_t kDosTime = 0;
constexpr size_t kPieceBytes = 1 << 18;  // in which values are made

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

// UTF-8 to code points. A byte that is not UTF-8 (names of files may hold any) becomes the code
// point that Python's os.fsdecode gives it.
std::u32string code_points(std::string_view text) {
  std::u32string result;
  while (!text.empty()) {
    char32_t code = 0;
    const size_t length = utf8_length(text, &code);
    result += length > 0 ? code : kEscapedByte + static_cast<unsigned char>(text[0]);
    text.remove_prefix(std::max<size_t>(1, length));
  }
  return result;
}

void check_size(size_t values, std::span<const int64_t> shape) {
  size_t expected = 1;
  for (const int64_t size : shape) expected *= static_cast<size_t>(size);
  check(values == expected, "NpzWriter: as many values as the shape says");
}

NpzFill<std::byte> copy_of(std::span<const std::byte> bytes) {
  return [bytes](size_t first, std::span<std::byte> values) {
    std::ranges::copy(bytes.subspan(first, values.size()), values.begin());
  };
}

template <typename T>
NpzFill<std::byte> fill_of(NpzFill<T> fill) {
  return [fill = std::move(fill)](size_t first, std::span<std::byte> bytes) {
    // Pieces begin at multiples of kPieceBytes in memory that suits every number.
    fill(first / sizeof(T), {reinterpret_cast<T*>(bytes.data()), bytes.size() / sizeof(T)});
  };
}

// A member as libzip asks for it: the header, then the values piece by piece.
class MemberSource {
 public:
  MemberSource(std::string_view header, uint64_t data_bytes, const NpzFill<std::byte>& fill)
      : header_(header), data_bytes_(data_bytes), fill_(fill) {
    zip_error_init(&error_);
  }
  ~MemberSource() { zip_error_fini(&error_); }
  MemberSource(const MemberSource&) = delete;
  MemberSource& operator=(const MemberSource&) = delete;

  // What fill threw, if it did; it must not pass through libzip.
  std::exception_ptr failure() const { return failure_; }

  static zip_int64_t callback(void* self, void* data, zip_uint64_t length,
                              zip_source_cmd_t command) {
    return static_cast<MemberSource*>(self)->answer(data, length, command);
  }

 private:
  zip_int64_t answer(void* data, zip_uint64_t length, zip_source_cmd_t command) {
    switch (command) {
      case ZIP_SOURCE_OPEN:
        rest_ = std::as_bytes(std::span(header_));
        filled_ = 0;
        return 0;
      case ZIP_SOURCE_READ:
        return read({static_cast<std::byte*>(data), length});
      case ZIP_SOURCE_STAT: {
        zip_stat_t* stat = static_cast<zip_stat_t*>(data);
        zip_stat_init(stat);
        stat->size = header_.size() + data_bytes_;
        stat->valid = ZIP_STAT_SIZE;
        return sizeof(zip_stat_t);
      }
      case ZIP_SOURCE_CLOSE:
      case ZIP_SOURCE_FREE:
        return 0;
      case ZIP_SOURCE_ERROR:
        return zip_error_to_data(&error_, data, length);
      case ZIP_SOURCE_SUPPORTS:
        return zip_source_make_command_bitmap(ZIP_SOURCE_OPEN, ZIP_SOURCE_READ, ZIP_SOURCE_CLOSE,
                                              ZIP_SOURCE_STAT, ZIP_SOURCE_ERROR, ZIP_SOURCE_FREE,
                                              -1);
      default:
        zip_error_set(&error_, ZIP_ER_OPNOTSUPP, 0);
        return -1;
    }
  }

  zip_int64_t read(std::span<std::byte> target) {
    size_t count = 0;
    while (count < target.size()) {
      if (rest_.empty() && !next_piece()) break;
      const size_t part = std::min(rest_.size(), target.size() - count);
      std::ranges::copy(rest_.first(part), target.begin() + static_cast<std::ptrdiff_t>(count));
      rest_ = rest_.subspan(part);
      count += part;
    }
    return failure_ ? -1 : static_cast<zip_int64_t>(count);
  }

  bool next_piece() {
    if (failure_ || filled_ == data_bytes_) return false;
    piece_.resize(std::min<uint64_t>(kPieceBytes, data_bytes_ - filled_));
    try {
      fill_(filled_, piece_);
    } catch (...) {
      failure_ = std::current_exception();
      zip_error_set(&error_, ZIP_ER_READ, 0);
      return false;
    }
    filled_ += piece_.size();
    rest_ = piece_;
    return true;
  }

  std::string_view header_;
  uint64_t data_bytes_;
  const NpzFill<std::byte>& fill_;
  uint64_t filled_ = 0;
  std::vector<std::byte> piece_;
  std::span<const std::byte> rest_;  // of the header or the piece, not yet asked for
  std::exception_ptr failure_;
  zip_error_t error_;
};

}  // namespace

struct NpzWriter::Member {
  std::string key;
  std::string header;
  uint64_t data_bytes = 0;
  NpzFill<std::byte> fill;
};

NpzWriter::NpzWriter(std::filesystem::path path, NpzCompression compression)
    : path_(std::move(path)), compression_(compression) {}

NpzWriter::~NpzWriter() = default;

void NpzWriter::add_member(std::string_view key, std::string_view descr,
                           std::span<const int64_t> shape, size_t item_size,
                           NpzFill<std::byte> fill) {
  uint64_t bytes = item_size;
  for (const int64_t size : shape) bytes *= static_cast<uint64_t>(size);
  for (const Member& member : members_) check(member.key != key, "NpzWriter: a key added once");
  members_.push_back({std::string(key), npy_header(descr, shape), bytes, std::move(fill)});
}

template <typename T>
void NpzWriter::add(std::string_view key, std::vector<int64_t> shape, std::span<const T> values) {
  check_size(values.size(), shape);
  add_member(key, npy_descr<T>(), shape, sizeof(T), copy_of(std::as_bytes(values)));
}

template <typename T>
void NpzWriter::add(std::string_view key, std::vector<int64_t> shape, NpzFill<T> fill) {
  add_member(key, npy_descr<T>(), shape, sizeof(T), fill_of(std::move(fill)));
}

template void NpzWriter::add(std::string_view, std::vector<int64_t>, std::span<const float>);
template void NpzWriter::add(std::string_view, std::vector<int64_t>, NpzFill<float>);
template void NpzWriter::add(std::string_view, std::vector<int64_t>, std::span<const double>);
template void NpzWriter::add(std::string_view, std::vector<int64_t>, NpzFill<double>);
template void NpzWriter::add(std::string_view, std::vector<int64_t>, std::span<const int32_t>);
template void NpzWriter::add(std::string_view, std::vector<int64_t>, NpzFill<int32_t>);
template void NpzWriter::add(std::string_view, std::vector<int64_t>, std::span<const int64_t>);
template void NpzWriter::add(std::string_view, std::vector<int64_t>, NpzFill<int64_t>);
template void NpzWriter::add(std::string_view, std::vector<int64_t>, std::span<const uint8_t>);
template void NpzWriter::add(std::string_view, std::vector<int64_t>, NpzFill<uint8_t>);

void NpzWriter::add_mask(std::string_view key, std::vector<int64_t> shape,
                         std::span<const uint8_t> mask) {
  check_size(mask.size(), shape);
  add_member(key, "|b1", shape, 1, copy_of(std::as_bytes(mask)));
}

void NpzWriter::add_mask(std::string_view key, std::vector<int64_t> shape, NpzFill<uint8_t> fill) {
  add_member(key, "|b1", shape, 1, fill_of(std::move(fill)));
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
  add_member(key, fmt::format("<U{}", longest), {&count, 1}, 4 * longest,
             [padded = std::move(padded)](size_t first, std::span<std::byte> values) {
               copy_of(std::as_bytes(std::span(padded)))(first, values);
             });
}

void NpzWriter::finish() {
  check(!members_.empty(), "NpzWriter: at least one array");
  const auto fail = [&](std::string_view reason) {
    throw_error(ErrorCode::kOutput, "{}: cannot be written: {}", path_.string(), reason);
  };
  const std::filesystem::path target = output_file_target(path_);
  int open_error = 0;
  zip_t* zip = zip_open(target.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &open_error);
  if (zip == nullptr) {
    zip_error_t error;
    zip_error_init_with_code(&error, open_error);
    const std::string text = zip_error_strerror(&error);
    zip_error_fini(&error);
    fail(text);
  }
  std::vector<std::unique_ptr<MemberSource>> sources;
  for (const Member& member : members_) {
    sources.push_back(
        std::make_unique<MemberSource>(member.header, member.data_bytes, member.fill));
    zip_source_t* source = zip_source_function(zip, MemberSource::callback, sources.back().get());
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
    for (const auto& source : sources) {
      if (source->failure()) std::rethrow_exception(source->failure());
    }
    fail(text);
  }
}

}  // namespace vggtcd
