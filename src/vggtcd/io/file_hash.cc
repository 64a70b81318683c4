// SPDX-License-Identifier: Apache-2.0
// XXH64: four sums over stripes of 32 bytes, then the rest.
#include "vggtcd/io/file_hash.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <vector>

#include "vggtcd/core/interrupt.h"

namespace vggtcd {
namespace {

static_assert(std::endian::native == std::endian::little, "XXH64 reads little-endian words");

constexpr uint64_t kPrime1 = 0x9E3779B185EBCA87u, kPrime2 = 0xC2B2AE3D27D4EB4Fu,
                   kPrime3 = 0x165667B19E3779F9u, kPrime4 = 0x85EBCA77C2B2AE63u,
                   kPrime5 = 0x27D4EB2F165667C5u;
constexpr size_t kStripe = 32;

template <typename T>
T word_at(const std::byte* bytes) {
  T word;
  std::memcpy(&word, bytes, sizeof word);
  return word;
}

uint64_t mixed(uint64_t sum, uint64_t word) {
  return std::rotl(sum + word * kPrime2, 31) * kPrime1;
}

class Xxh64 {
 public:
  // Whole stripes, in order.
  void add(std::span<const std::byte> stripes) {
    for (size_t at = 0; at < stripes.size(); at += kStripe) {
      for (size_t i = 0; i < 4; ++i) {
        sums_[i] = mixed(sums_[i], word_at<uint64_t>(stripes.data() + at + 8 * i));
      }
    }
    length_ += stripes.size();
  }

  // With what is left, less than a stripe.
  uint64_t finish(std::span<const std::byte> rest) const {
    uint64_t hash = length_ > 0 ? of_stripes() : kPrime5;
    hash += length_ + rest.size();
    for (; rest.size() >= 8; rest = rest.subspan(8)) {
      hash ^= mixed(0, word_at<uint64_t>(rest.data()));
      hash = std::rotl(hash, 27) * kPrime1 + kPrime4;
    }
    if (rest.size() >= 4) {
      hash ^= word_at<uint32_t>(rest.data()) * kPrime1;
      hash = std::rotl(hash, 23) * kPrime2 + kPrime3;
      rest = rest.subspan(4);
    }
    for (const std::byte byte : rest) {
      hash ^= static_cast<uint64_t>(byte) * kPrime5;
      hash = std::rotl(hash, 11) * kPrime1;
    }
    hash = (hash ^ hash >> 33) * kPrime2;
    hash = (hash ^ hash >> 29) * kPrime3;
    return hash ^ hash >> 32;
  }

 private:
  uint64_t of_stripes() const {
    uint64_t hash = std::rotl(sums_[0], 1) + std::rotl(sums_[1], 7) + std::rotl(sums_[2], 12) +
                    std::rotl(sums_[3], 18);
    for (const uint64_t sum : sums_) hash = (hash ^ mixed(0, sum)) * kPrime1 + kPrime4;
    return hash;
  }

  std::array<uint64_t, 4> sums_ = {kPrime1 + kPrime2, kPrime2, 0, 0 - kPrime1};
  uint64_t length_ = 0;
};

struct Descriptor {
  int file;
  ~Descriptor() {
    if (file >= 0) close(file);
  }
};

// Fills the buffer as far as the file goes; less than zero if it cannot be read.
ssize_t fill(int file, std::span<std::byte> buffer) {
  size_t count = 0;
  while (count < buffer.size()) {
    const ssize_t got = read(file, buffer.data() + count, buffer.size() - count);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return -1;
    if (got == 0) break;
    count += static_cast<size_t>(got);
  }
  return static_cast<ssize_t>(count);
}

}  // namespace

uint64_t xxh64(std::span<const std::byte> bytes) {
  const size_t whole = bytes.size() / kStripe * kStripe;
  Xxh64 hash;
  hash.add(bytes.first(whole));
  return hash.finish(bytes.subspan(whole));
}

std::optional<FileStamp> stamp_of(const std::filesystem::path& path) {
  // Not blocking: opening a pipe that nobody writes to would wait for ever.
  const Descriptor opened{open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK)};
  struct stat status = {};
  if (opened.file < 0 || fstat(opened.file, &status) != 0 || !S_ISREG(status.st_mode)) return {};
  std::vector<std::byte> buffer(1 << 20);
  FileStamp stamp;
  Xxh64 hash;
  for (;;) {
    throw_if_interrupted();
    const ssize_t count = fill(opened.file, buffer);
    if (count < 0) return {};
    const std::span<const std::byte> got(buffer.data(), static_cast<size_t>(count));
    stamp.bytes += got.size();
    if (got.size() == buffer.size()) {
      hash.add(got);
      continue;
    }
    const size_t whole = got.size() / kStripe * kStripe;
    hash.add(got.first(whole));
    stamp.hash = hash.finish(got.subspan(whole));
    return stamp;
  }
}

std::optional<uint64_t> size_of(const std::filesystem::path& path) {
  struct stat status = {};
  if (lstat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return {};
  return static_cast<uint64_t>(status.st_size);
}

}  // namespace vggtcd
