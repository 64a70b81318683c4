// SPDX-License-Identifier: Apache-2.0
// LargeArray: uninitialised memory for millions of elements, on huge pages where the system has
// them. std::vector would first write zeros on one thread, a page fault every 4 KiB. Elements are
// to be assigned before they are read.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <span>
#include <type_traits>

namespace vggtcd {

template <typename T>
class LargeArray {
  // Nothing is constructed; Eigen's vectors do not mind, although they are not formally trivial.
  static_assert(std::is_trivially_destructible_v<T>);

 public:
  LargeArray() = default;
  explicit LargeArray(size_t size) : size_(size) {
    if (size == 0) return;
    constexpr size_t kHugePage = size_t{1} << 21, kCacheLine = 64;
    const bool large = size * sizeof(T) >= kHugePage;
    const size_t alignment = large ? kHugePage : kCacheLine;
    const size_t bytes = (size * sizeof(T) + alignment - 1) / alignment * alignment;
    data_.reset(static_cast<T*>(std::aligned_alloc(alignment, bytes)));
    if (!data_) throw std::bad_alloc();
    if (large) madvise(data_.get(), bytes, MADV_HUGEPAGE);  // only a hint
  }

  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  T* data() { return data_.get(); }
  const T* data() const { return data_.get(); }
  T& operator[](size_t i) { return data_.get()[i]; }
  const T& operator[](size_t i) const { return data_.get()[i]; }
  T* begin() { return data(); }
  T* end() { return data() + size_; }
  const T* begin() const { return data(); }
  const T* end() const { return data() + size_; }

 private:
  struct Free {
    void operator()(T* data) const { std::free(data); }
  };
  std::unique_ptr<T, Free> data_;
  size_t size_ = 0;
};

}  // namespace vggtcd
