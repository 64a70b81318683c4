// SPDX-License-Identifier: Apache-2.0
// NpzReader: untrusted zip archives through libzip. Sizes are believed only as far as the number
// of bytes that are really there allows.
#include <zip.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <new>

#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/core/tensor_view.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/input_file.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/io/quote.h"

namespace vggtcd {
namespace {

// Deflate cannot expand by more than this (zlib's technical notes).
constexpr uint64_t kMaxDeflateRatio = 1032;

// libzip says that memory was short like any other failure.
void throw_if_memory(int zip_error) {
  if (zip_error == ZIP_ER_MEMORY) throw std::bad_alloc();
}

// What a file that libzip does not open looks like, so that the message can say it.
std::string describe_bytes(std::string_view start, int zip_error) {
  if (start.empty()) return "an empty file";
  if (start.starts_with("PK\x03\x04")) {
    return "a truncated or damaged zip archive; copy or download it again";
  }
  if (start.starts_with("\x93NUMPY")) return "a single .npy array; save with numpy.savez";
  if (start.starts_with("version https://git-lfs")) return "a Git LFS pointer; run git lfs pull";
  if (start.starts_with("<")) return "a web page or XML; download the file itself";
  zip_error_t error;
  zip_error_init_with_code(&error, zip_error);
  const std::string text = zip_error_strerror(&error);
  zip_error_fini(&error);
  return fmt::format("other data ({})", text);
}

constexpr std::string_view kExpected = "a NumPy .npz file";

std::string start_of_file(const std::filesystem::path& path) {
  InputFile file(path, kExpected);
  std::string start(32, '\0');
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<size_t>(file.gcount()));
  return start;
}

// The side files with which macOS keeps attributes: no arrays, whatever their names end in.
bool is_of_macos(std::string_view member) {
  const std::string_view file = member.substr(member.find_last_of('/') + 1);
  return member.starts_with("__MACOSX/") || file.starts_with("._");
}

[[noreturn]] void throw_not_npz(std::string_view name, std::string_view found) {
  throw_error(ErrorCode::kInput, "{}: expected {}, found {}", name, kExpected, found);
}

// One member of the archive, open for reading from its start.
class Member {
 public:
  Member(zip_t* zip, uint64_t index, std::string what)
      : file_(zip_fopen_index(zip, index, 0)), what_(std::move(what)) {
    if (file_ == nullptr) {
      throw_if_memory(zip_error_code_zip(zip_get_error(zip)));
      throw_error(ErrorCode::kInput, "{}: cannot be unpacked: {}", what_, zip_strerror(zip));
    }
  }
  ~Member() { zip_fclose(file_); }
  Member(const Member&) = delete;
  Member& operator=(const Member&) = delete;

  void read(std::span<std::byte> bytes) {
    while (!bytes.empty()) {
      throw_if_interrupted();
      // In pieces, so that an interrupt does not wait for gigabytes.
      const size_t piece = std::min(bytes.size(), size_t{16} << 20);
      const size_t count = read_some(bytes.first(piece));
      if (count == 0) {
        throw_error(ErrorCode::kInput, "{}: expected {} more bytes, found the end of the data",
                    what_, bytes.size());
      }
      bytes = bytes.subspan(count);
      position_ += count;
    }
  }
  // The checksum is compared when the end is read, so it must be read.
  void expect_end() {
    std::byte extra{};
    if (read_some({&extra, 1}) != 0) {
      throw_error(ErrorCode::kInput, "{}: expected the end of the array, found more data", what_);
    }
  }
  uint64_t position() const { return position_; }

 private:
  size_t read_some(std::span<std::byte> bytes) {
    const zip_int64_t count = zip_fread(file_, bytes.data(), bytes.size());
    if (count < 0) {
      throw_if_memory(zip_error_code_zip(zip_file_get_error(file_)));
      throw_error(ErrorCode::kInput, "{}: damaged data: {}; copy or download the file again", what_,
                  zip_file_strerror(file_));
    }
    return static_cast<size_t>(count);
  }

  zip_file_t* file_;
  std::string what_;
  uint64_t position_ = 0;
};

}  // namespace

struct NpzReader::Zip {
  zip_t* handle = nullptr;
  uint64_t file_bytes = 0;
  ~Zip() {
    if (handle != nullptr) zip_discard(handle);
  }
};

struct NpzReader::Entry {
  std::string key;
  uint64_t index = 0;  // in the archive
  NpyHeader header;
};

NpzReader::NpzReader(const std::filesystem::path& path) try
    : name_(path.string()), zip_(std::make_unique<Zip>()) {
  if (!is_file(path)) throw_not_npz(name_, what_stands_at(path));
  zip_->file_bytes = size_of_file(path);
  int zip_error = 0;
  zip_->handle = zip_open(path.c_str(), ZIP_RDONLY, &zip_error);
  throw_if_memory(zip_->handle == nullptr ? zip_error : 0);
  if (zip_->handle == nullptr || zip_->file_bytes == 0) {
    throw_not_npz(name_, zip_error == ZIP_ER_OPEN ? std::string("a file that cannot be opened")
                                                  : describe_bytes(start_of_file(path), zip_error));
  }
  index();
} catch (...) {
  rethrow_naming(path);
}

NpzReader::NpzReader(std::span<const std::byte> bytes, std::string name)
    : name_(std::move(name)), zip_(std::make_unique<Zip>()) {
  zip_->file_bytes = bytes.size();
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  if (source == nullptr) throw std::bad_alloc();
  zip_->handle = zip_open_from_source(source, ZIP_RDONLY, &error);
  const int code = zip_error_code_zip(&error);
  zip_error_fini(&error);
  if (zip_->handle == nullptr) zip_source_free(source);
  throw_if_memory(zip_->handle == nullptr ? code : 0);
  if (zip_->handle == nullptr || bytes.empty()) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    throw_not_npz(name_, describe_bytes(text, code));
  }
  index();
}

NpzReader::~NpzReader() = default;

void NpzReader::index() {
  const zip_int64_t members = zip_get_num_entries(zip_->handle, 0);
  for (uint64_t i = 0; i < static_cast<uint64_t>(members); ++i) {
    zip_stat_t stat;
    constexpr zip_uint64_t kNeeded =
        ZIP_STAT_NAME | ZIP_STAT_SIZE | ZIP_STAT_COMP_SIZE | ZIP_STAT_COMP_METHOD;
    if (zip_stat_index(zip_->handle, i, 0, &stat) != 0 || (stat.valid & kNeeded) != kNeeded) {
      throw_not_npz(name_, "a damaged zip directory; copy or download it again");
    }
    const std::string_view member = stat.name;
    if (!member.ends_with(".npy") || is_of_macos(member)) continue;
    Entry entry{std::string(member.substr(0, member.size() - 4)), i, {}};
    const std::string what = name_ + ": " + entry.key;
    // Keys go into messages of one line.
    if (std::any_of(member.begin(), member.end(), [](unsigned char c) { return c < 0x20; })) {
      throw_error(ErrorCode::kInput, "{}: expected an array's name, found {}", name_,
                  quote(entry.key));
    }
    const bool stored = stat.comp_method == ZIP_CM_STORE;
    if (!stored && stat.comp_method != ZIP_CM_DEFLATE) {
      throw_error(ErrorCode::kInput, "{}: expected stored or deflated data, found zip method {}",
                  what, stat.comp_method);
    }
    const uint64_t possible = stored ? stat.comp_size : stat.comp_size * kMaxDeflateRatio;
    if (stat.comp_size > zip_->file_bytes || stat.size > possible) {
      throw_error(ErrorCode::kInput, "{}: expected at most {} bytes, found a claim of {}; damaged",
                  what, std::min(possible, zip_->file_bytes * kMaxDeflateRatio), stat.size);
    }
    Member stream(zip_->handle, i, what);
    entry.header = read_npy_header([&](std::span<std::byte> b) { stream.read(b); }, what);
    if (entry.header.kind == NpyKind::kObject) continue;
    const uint64_t found = stat.size - stream.position();
    if (entry.header.item_size > 0 && static_cast<uint64_t>(entry.header.data_bytes()) != found) {
      throw_error(ErrorCode::kInput, "{}: expected {} bytes of data for shape {}, found {}", what,
                  entry.header.data_bytes(), shape_string(entry.header.shape), found);
    }
    if (!entry_of_key_.emplace(entry.key, entries_.size()).second) {
      throw_error(ErrorCode::kInput, "{}: is in the file twice", what);
    }
    keys_.push_back(entry.key);
    entries_.push_back(std::move(entry));
  }
  if (members == 0) throw_not_npz(name_, "an empty archive");
}

const NpzReader::Entry* NpzReader::find(std::string_view key) const {
  const auto found = entry_of_key_.find(key);
  return found == entry_of_key_.end() ? nullptr : &entries_[found->second];
}

const NpzReader::Entry& NpzReader::at(std::string_view key) const {
  const Entry* entry = find(key);
  if (entry == nullptr) {
    std::string all;
    for (const std::string& other : keys_) all += (all.empty() ? "" : ", ") + other;
    throw_error(ErrorCode::kInput, "{}: expected an array {}, found {}", name_, key,
                all.empty() ? "no array" : all);
  }
  return *entry;
}

const NpyHeader& NpzReader::header(std::string_view key) const { return at(key).header; }

template <typename Use>
void NpzReader::with_data(std::string_view key, const Use& use) const {
  const Entry& entry = at(key);
  const std::string what = fmt::format("{}: {}", name_, key);
  Member stream(zip_->handle, entry.index, what);
  const ReadBytes read = [&](std::span<std::byte> bytes) { stream.read(bytes); };
  const NpyHeader header = read_npy_header(read, what);
  use(header, read, what);
  stream.expect_end();
}

template <typename T>
void NpzReader::read_into(std::string_view key, std::span<T> target) const {
  with_data(key, [&](const NpyHeader& header, const ReadBytes& read, std::string_view what) {
    read_npy_array<T>(header, read, what, target);
  });
}

template <typename T>
void NpzReader::read_slabs(std::string_view key, const NpySlabs<T>& sink) const {
  expect_numbers(key);
  with_data(key, [&](const NpyHeader& header, const ReadBytes& read, std::string_view what) {
    read_npy_slabs<T>(header, read, what, sink);
  });
}

#define VGGTCD_INSTANTIATE(T)                                                  \
  template void NpzReader::read_into<T>(std::string_view, std::span<T>) const; \
  template void NpzReader::read_slabs<T>(std::string_view, const NpySlabs<T>&) const;
VGGTCD_INSTANTIATE(float)
VGGTCD_INSTANTIATE(double)
VGGTCD_INSTANTIATE(int64_t)
VGGTCD_INSTANTIATE(uint8_t)
#undef VGGTCD_INSTANTIATE

std::vector<std::string> NpzReader::read_strings(std::string_view key) const {
  std::vector<std::string> strings;
  with_data(key, [&](const NpyHeader& header, const ReadBytes& read, std::string_view what) {
    strings = read_npy_strings(header, read, what);
  });
  return strings;
}

void NpzReader::expect_numbers(std::string_view key) const {
  const NpyHeader& found = header(key);
  if (found.kind == NpyKind::kBool || found.kind == NpyKind::kInt ||
      found.kind == NpyKind::kUnsigned || found.kind == NpyKind::kFloat) {
    return;
  }
  throw_error(ErrorCode::kInput, "{}: {}: expected numbers, found type {}", name_, key,
              found.descr);
}

void NpzReader::expect_shape(std::string_view key, std::span<const int64_t> shape) const {
  const std::vector<int64_t>& found = header(key).shape;
  bool matches = found.size() == shape.size();
  for (size_t i = 0; matches && i < shape.size(); ++i) {
    matches = shape[i] == -1 || shape[i] == found[i];
  }
  if (!matches) {
    throw_error(ErrorCode::kInput, "{}: {}: expected shape {}, found {}", name_, key,
                shape_string(shape), shape_string(found));
  }
}

}  // namespace vggtcd
