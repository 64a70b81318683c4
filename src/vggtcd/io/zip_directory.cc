// SPDX-License-Identifier: Apache-2.0
// zip_directory: end record, central directory, local headers; every offset checked before use.
#include "vggtcd/io/zip_directory.h"

#include <cstdint>
#include <cstring>
#include <set>

#include "vggtcd/io/quote.h"

namespace vggtcd {
namespace {

constexpr uint32_t kEndSignature = 0x06054b50, kEnd64Signature = 0x06064b50,
                   kEnd64LocatorSignature = 0x07064b50, kCentralSignature = 0x02014b50,
                   kLocalSignature = 0x04034b50;
constexpr size_t kEndSize = 22, kEnd64Size = 56, kEnd64LocatorSize = 20, kCentralSize = 46,
                 kLocalSize = 30;
constexpr uint16_t kZip64Extra = 0x0001;

class Reader {
 public:
  Reader(std::span<const std::byte> bytes, const std::string& file, ErrorCode code)
      : bytes_(bytes), file_(file), code_(code) {}

  std::vector<ZipMember> read() {
    const Directory directory = find_directory();
    // The smallest entry bounds the count before anything is allocated by it.
    if (directory.count > directory.size / kCentralSize) fail("its directory is cut off");
    std::vector<ZipMember> members;
    std::set<std::string> names;
    uint64_t at = directory.offset;
    for (uint64_t i = 0; i < directory.count; ++i) {
      members.push_back(member(at));
      if (!names.insert(members.back().name).second) {
        fail("it has two members {}", quote(members.back().name));
      }
    }
    return members;
  }

 private:
  struct Directory {
    uint64_t count, size, offset;
  };

  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
    throw_error(code_, "{}: broken zip archive: {}; copy or download it again", file_,
                fmt::format(format, std::forward<Args>(args)...));
  }

  std::span<const std::byte> range(uint64_t offset, uint64_t size) const {
    if (offset > bytes_.size() || size > bytes_.size() - offset) {
      fail("bytes {} to {} are beyond its end", offset, offset + size);
    }
    return bytes_.subspan(offset, size);
  }

  template <typename T>
  T get(uint64_t offset) const {
    T value;
    std::memcpy(&value, range(offset, sizeof(T)).data(), sizeof(T));
    return value;
  }

  Directory find_directory() const {
    constexpr uint64_t kMaxComment = 0xffff;
    const uint64_t size = bytes_.size();
    if (size < kEndSize) fail("it ends after {} bytes", size);
    const uint64_t last = size - kEndSize;
    const uint64_t first = last > kMaxComment ? last - kMaxComment : 0;
    for (uint64_t at = last + 1; at-- > first;) {
      if (get<uint32_t>(at) == kEndSignature && at + kEndSize + get<uint16_t>(at + 20) == size) {
        return end_record(at);
      }
    }
    fail("no directory at its end, so it is cut off");
  }

  Directory end_record(uint64_t at) const {
    Directory directory{get<uint16_t>(at + 10), get<uint32_t>(at + 12), get<uint32_t>(at + 16)};
    const bool zip64 =
        at >= kEnd64LocatorSize && get<uint32_t>(at - kEnd64LocatorSize) == kEnd64LocatorSignature;
    if (zip64) {
      const uint64_t end64 = get<uint64_t>(at - kEnd64LocatorSize + 8);
      range(end64, kEnd64Size);
      if (get<uint32_t>(end64) != kEnd64Signature)
        fail("its ZIP64 end record is not where it says");
      directory = {get<uint64_t>(end64 + 32), get<uint64_t>(end64 + 40), get<uint64_t>(end64 + 48)};
    }
    range(directory.offset, directory.size);
    return directory;
  }

  // Reads the central entry at `at` and moves `at` to the next one.
  ZipMember member(uint64_t& at) const {
    range(at, kCentralSize);
    if (get<uint32_t>(at) != kCentralSignature) fail("its directory is damaged");
    const uint16_t flags = get<uint16_t>(at + 8), method = get<uint16_t>(at + 10);
    uint64_t compressed = get<uint32_t>(at + 20), size = get<uint32_t>(at + 24);
    uint64_t local = get<uint32_t>(at + 42);
    const uint16_t name_size = get<uint16_t>(at + 28), extra_size = get<uint16_t>(at + 30);
    const std::span name = range(at + kCentralSize, name_size);
    const uint64_t extra = at + kCentralSize + name_size;
    range(extra, extra_size);
    read_zip64(extra, extra_size, size, compressed, local);
    at = extra + extra_size + get<uint16_t>(at + 32);

    ZipMember member{{reinterpret_cast<const char*>(name.data()), name.size()}, {}};
    constexpr uint16_t kEncrypted = 1;
    if ((flags & kEncrypted) != 0) fail("member {} is encrypted", quote(member.name));
    if (method != 0 || compressed != size) {
      throw_error(code_, "{}: member {} is compressed, expected stored; save it with torch.save",
                  file_, quote(member.name));
    }
    range(local, kLocalSize);
    if (get<uint32_t>(local) != kLocalSignature) {
      fail("member {} is not where it says", quote(member.name));
    }
    const uint64_t header =
        kLocalSize + uint64_t{get<uint16_t>(local + 26)} + get<uint16_t>(local + 28);
    member.data = range(local + header, size);
    return member;
  }

  // 4.5.3: 64-bit values, present only for the fields that are all ones, in this order.
  void read_zip64(uint64_t extra, uint64_t extra_size, uint64_t& size, uint64_t& compressed,
                  uint64_t& local) const {
    const uint64_t end = extra + extra_size;
    while (extra + 4 <= end) {
      const uint16_t id = get<uint16_t>(extra);
      const uint64_t next = extra + 4 + get<uint16_t>(extra + 2);
      if (next > end) fail("an extra field of its directory is cut off");
      if (id == kZip64Extra) {
        uint64_t at = extra + 4;
        for (uint64_t* field : {&size, &compressed, &local}) {
          if (*field != 0xffffffffu) continue;
          if (at + 8 > next) fail("a ZIP64 field of its directory is cut off");
          *field = get<uint64_t>(at);
          at += 8;
        }
      }
      extra = next;
    }
  }

  std::span<const std::byte> bytes_;
  const std::string& file_;
  ErrorCode code_;
};

}  // namespace

std::vector<ZipMember> read_zip_directory(std::span<const std::byte> bytes, const std::string& file,
                                          ErrorCode code) {
  return Reader(bytes, file, code).read();
}

}  // namespace vggtcd
