// SPDX-License-Identifier: Apache-2.0
// Buffer and Rows: the memory of activations, and the view of it that every layer reads and writes:
// a matrix of f32 or bf16, one row per token or pixel, channels contiguous.
#pragma once

#include <cstddef>
#include <cstdint>

#include "vggtcd/core/error.h"
#include "vggtcd/core/tensor_view.h"

namespace vggtcd {

// Uninitialised memory, aligned to 64 bytes; large ones ask the kernel for huge pages. The contents
// do not survive reserve().
class Buffer {
 public:
  Buffer() = default;
  explicit Buffer(size_t bytes) { reserve(bytes); }
  ~Buffer() { reset(); }
  Buffer(Buffer&& other) noexcept;
  Buffer& operator=(Buffer&& other) noexcept;
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  // Makes room for at least this many bytes; Error{kMemory} if there is none.
  void reserve(size_t bytes);
  void reset();
  std::byte* data() const { return data_; }
  size_t size() const { return size_; }

 private:
  std::byte* data_ = nullptr;
  size_t size_ = 0;
};

// A view of rows of activations. Element (row, column) is at data + (row * stride + column).
struct Rows {
  DType dtype = DType::kF32;  // kF32 or kBF16
  std::byte* data = nullptr;
  int64_t stride = 0;  // elements from one row to the next

  Rows() = default;
  Rows(float* f32, int64_t row_stride)
      : dtype(DType::kF32), data(reinterpret_cast<std::byte*>(f32)), stride(row_stride) {}
  Rows(uint16_t* bf16, int64_t row_stride)
      : dtype(DType::kBF16), data(reinterpret_cast<std::byte*>(bf16)), stride(row_stride) {}
  Rows(DType type, const Buffer& buffer, int64_t row_stride)
      : dtype(type), data(buffer.data()), stride(row_stride) {}

  // The view that begins at (row, column).
  Rows at(int64_t row, int64_t column = 0) const {
    Rows moved = *this;
    moved.data += (row * stride + column) * static_cast<int64_t>(dtype == DType::kF32 ? 4 : 2);
    return moved;
  }
  float* f32() const {
    check(dtype == DType::kF32, "rows: f32 expected");
    return reinterpret_cast<float*>(data);
  }
  uint16_t* bf16() const {
    check(dtype == DType::kBF16, "rows: bf16 expected");
    return reinterpret_cast<uint16_t*>(data);
  }
};

// Bytes of a [rows, columns] matrix.
inline size_t bytes_of(DType dtype, int64_t rows, int64_t columns) {
  return static_cast<size_t>(rows * columns) * dtype_size(dtype);
}

}  // namespace vggtcd
