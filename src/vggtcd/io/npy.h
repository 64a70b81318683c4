// SPDX-License-Identifier: Apache-2.0
// NumPy's .npy format: the header, and reading and writing one array.
// Source: NumPy Enhancement Proposal 1 (versions 1.0 and 2.0) and numpy.lib.format (3.0).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace vggtcd {

// What the elements are. Types we never compute with (complex, dates, structures, ...) are kOther.
enum class NpyKind { kBool, kInt, kUnsigned, kFloat, kUnicode, kBytes, kObject, kOther };

struct NpyHeader {
  std::string descr;  // as the file has it: "<f4"
  NpyKind kind = NpyKind::kOther;
  size_t item_size = 0;  // bytes of one element; 0 for objects and kOther
  bool big_endian = false;
  bool fortran_order = false;  // first index fastest; set for two dimensions and more only
  std::vector<int64_t> shape;  // [] is a scalar

  int64_t numel() const;
  int64_t data_bytes() const { return numel() * static_cast<int64_t>(item_size); }
};

// Hands over exactly as many bytes as asked for, or throws the error of a truncated file.
using ReadBytes = std::function<void(std::span<std::byte>)>;

// Reads the header from the start of a .npy stream; afterwards `read` stands at the first element.
// Throws Error{kInput} naming `what` ("a.npz: depth") if it is not a header that NumPy writes. The
// size in bytes of an accepted array fits an int64.
NpyHeader read_npy_header(const ReadBytes& read, std::string_view what);

// The header that NumPy writes for little-endian data in C order (version 1.0, padded to 64 bytes).
std::string npy_header(std::string_view descr, std::span<const int64_t> shape);

// Called with runs of elements in C order: the C order index of the first one, and the elements.
template <typename T>
using NpySlabs = std::function<void(int64_t first, std::span<const T> values)>;

// Streams the elements that follow a header through a small buffer. Data in Fortran order is first
// gathered into one temporary array, since C order is not known before the end.
// T is float, double, int64_t or uint8_t. Conversions: any number to double or float (rounding to
// nearest); integers that fit to int64_t; u8 and bool (as 0 and 1) to uint8_t. Others, and
// big-endian data, throw Error{kInput}.
template <typename T>
void read_npy_slabs(const NpyHeader& header, const ReadBytes& read, std::string_view what,
                    const NpySlabs<T>& sink);

// The same into an array of numel() elements, without a second copy.
template <typename T>
void read_npy_array(const NpyHeader& header, const ReadBytes& read, std::string_view what,
                    std::span<T> target);

// The strings of a <U or |S array as UTF-8 without the padding; what is no character (a single
// surrogate) becomes U+FFFD.
std::vector<std::string> read_npy_strings(const NpyHeader& header, const ReadBytes& read,
                                          std::string_view what);

// A whole .npy file of numbers, C order. Throws Error{kInput}.
struct NpyDoubles {
  std::vector<int64_t> shape;
  std::vector<double> values;
};
NpyDoubles read_npy_file(const std::filesystem::path& path);

// Writes a .npy file of f64, C order; aside and renamed. Throws Error{kOutput}.
void write_npy_file(const std::filesystem::path& path, std::span<const int64_t> shape,
                    std::span<const double> values);

}  // namespace vggtcd
