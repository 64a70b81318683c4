// SPDX-License-Identifier: Apache-2.0
// Buffer: anonymous pages, huge ones where the kernel has them: a page fault per 4 KiB costs more
// than much of the arithmetic done on it.
#include "vggtcd/nn/tensor.h"

#include <sys/mman.h>

#include <utility>

namespace vggtcd {

Buffer::Buffer(Buffer&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

Buffer& Buffer::operator=(Buffer&& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  return *this;
}

void Buffer::reserve(size_t bytes) {
  if (bytes <= size_) return;
  reset();
  constexpr size_t kHugePage = size_t{2} << 20;
  const size_t unit = bytes >= 2 * kHugePage ? kHugePage : size_t{4096};
  const size_t rounded = (bytes + unit - 1) / unit * unit;
  void* pages = mmap(nullptr, rounded, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (pages == MAP_FAILED) {
    throw_error(ErrorCode::kMemory, "a buffer of {:.1f} MB cannot be had: use fewer photos",
                static_cast<double>(bytes) * 1e-6);
  }
  if (unit == kHugePage) madvise(pages, rounded, MADV_HUGEPAGE);  // a wish: failing is harmless
  data_ = static_cast<std::byte*>(pages);
  size_ = rounded;
}

void Buffer::reset() {
  if (data_ != nullptr) munmap(data_, size_);
  data_ = nullptr;
  size_ = 0;
}

}  // namespace vggtcd
