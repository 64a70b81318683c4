// SPDX-License-Identifier: Apache-2.0
// NumPy's .npz: a zip archive (stored or deflated, ZIP64 or not) with one .npy member per array.
// Source: numpy.savez; the zip itself is libzip's business.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/io/npy.h"

namespace vggtcd {

// An open .npz. Opening reads the directory and every array's header, no data. Everything throws
// Error{kInput} naming the file and the array. Not for use by two threads at a time.
class NpzReader {
 public:
  explicit NpzReader(const std::filesystem::path& path);
  // From memory that outlives the reader; `name` stands for the file name in errors.
  NpzReader(std::span<const std::byte> bytes, std::string name);
  ~NpzReader();
  NpzReader(const NpzReader&) = delete;
  NpzReader& operator=(const NpzReader&) = delete;

  const std::string& name() const { return name_; }

  // The keys of the arrays that can be read, in file order. Object arrays (pickles), members that
  // are not .npy and what macOS adds when it packs a folder (__MACOSX/, ._NAME) are left out.
  const std::vector<std::string>& keys() const { return keys_; }
  bool has(std::string_view key) const { return find(key) != nullptr; }
  const NpyHeader& header(std::string_view key) const;

  // The array in C order; conversions as read_npy_slabs says.
  template <typename T>
  std::vector<T> read(std::string_view key) const {
    expect_numbers(key);
    std::vector<T> values(static_cast<size_t>(header(key).numel()));
    read_into<T>(key, values);
    return values;
  }
  template <typename T>
  void read_into(std::string_view key, std::span<T> target) const;
  // In C order runs through a small buffer: for arrays that are wanted in another form.
  template <typename T>
  void read_slabs(std::string_view key, const NpySlabs<T>& sink) const;
  std::vector<std::string> read_strings(std::string_view key) const;

  // Throws unless its elements are numbers or bool: only then the size in bytes of an array of this
  // shape was compared with what is in the file.
  void expect_numbers(std::string_view key) const;
  // Throws unless the array is there and has this shape; -1 matches any size.
  void expect_shape(std::string_view key, std::span<const int64_t> shape) const;

 private:
  struct Zip;
  struct Entry;
  void index();
  const Entry* find(std::string_view key) const;
  const Entry& at(std::string_view key) const;
  template <typename Use>
  void with_data(std::string_view key, const Use& use) const;

  std::string name_;
  std::unique_ptr<Zip> zip_;
  std::vector<Entry> entries_;
  std::map<std::string, size_t, std::less<>> entry_of_key_;
  std::vector<std::string> keys_;
};

// Sets values to elements first, first + 1, ... of an array in C order. Called from the first to
// the last, perhaps more than once.
template <typename T>
using NpzFill = std::function<void(size_t first, std::span<T> values)>;

enum class NpzCompression { kStored, kDeflate };

// Collects arrays and writes them all in finish(). The bytes depend on the arrays alone: no clock,
// no user. Members of 4 GiB and more become ZIP64. Written aside and renamed, so that the path has
// the old file or the complete new one. Throws Error{kOutput}.
class NpzWriter {
 public:
  explicit NpzWriter(std::filesystem::path path,
                     NpzCompression compression = NpzCompression::kStored);
  ~NpzWriter();  // without finish(): nothing is written
  NpzWriter(const NpzWriter&) = delete;
  NpzWriter& operator=(const NpzWriter&) = delete;

  // C order; a key may be added once. The values are read in finish() and must live until then.
  // T: float, double, int32_t, int64_t, uint8_t. Call as add<float>("depth", {s, h, w}, depth).
  template <typename T>
  void add(std::string_view key, std::vector<int64_t> shape, std::span<const T> values);
  // The same of values that are made when they are written; what fill throws, finish() throws.
  // T as above.
  template <typename T>
  void add(std::string_view key, std::vector<int64_t> shape, NpzFill<T> fill);
  // Bytes 0 and 1, written as NumPy's bool.
  void add_mask(std::string_view key, std::vector<int64_t> shape, std::span<const uint8_t> mask);
  void add_mask(std::string_view key, std::vector<int64_t> shape, NpzFill<uint8_t> fill);
  // A list of text, written as <U; copied. read_strings gives the same bytes, UTF-8 or not.
  void add_strings(std::string_view key, std::span<const std::string> utf8);

  void finish();

 private:
  struct Member;
  void add_member(std::string_view key, std::string_view descr, std::span<const int64_t> shape,
                  size_t item_size, NpzFill<std::byte> fill);

  std::filesystem::path path_;
  NpzCompression compression_;
  std::vector<Member> members_;
};

}  // namespace vggtcd
