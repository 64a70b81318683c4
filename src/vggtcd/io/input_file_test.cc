// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/input_file.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "tests/support/test_files.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/io/npy.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/io/photo_source.h"
#include "vggtcd/io/ply.h"
#include "vggtcd/io/reference_cameras.h"
#include "vggtcd/io/sim3_file.h"
#include "vggtcd/io/tum.h"
#include "vggtcd/io/weight_file.h"

namespace vggtcd {
namespace {

TEST(InputFile, ReadsAllBytesAndSeeks) {
  const TemporaryDirectory directory;
  std::string bytes;
  for (int i = 0; i < 200000; ++i) bytes += static_cast<char>(i * 7 + i / 256);
  write_bytes(directory / "a", bytes);
  InputFile file(directory / "a", "bytes");
  EXPECT_EQ(file.size(), bytes.size());
  EXPECT_EQ(file.read_all(), bytes);
  for (const size_t place : {size_t{100000}, size_t{3}, size_t{70000}}) {
    file.clear();
    file.seekg(static_cast<std::streamoff>(place));
    EXPECT_EQ(file.tellg(), static_cast<std::streamoff>(place));
    std::string piece(100, '\0');
    file.read(piece.data(), 100);
    EXPECT_EQ(piece, bytes.substr(place, 100));
    EXPECT_EQ(file.tellg(), static_cast<std::streamoff>(place + 100));
  }
  file.seekg(-5, std::ios::end);
  EXPECT_EQ(file.get(), static_cast<unsigned char>(bytes[bytes.size() - 5]));
}

TEST(InputFile, LinesAndTheEndAreThoseOfAStream) {
  const TemporaryDirectory directory;
  write_bytes(directory / "a", "one\n\nthree");
  InputFile file(directory / "a", "text");
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  EXPECT_THAT(lines, ::testing::ElementsAre("one", "", "three"));
  EXPECT_TRUE(file.eof());
}

TEST(InputFile, SaysWhatItFoundInstead) {
  const TemporaryDirectory directory;
  std::filesystem::create_directory(directory / "folder");
  std::filesystem::create_symlink("loop", directory / "loop");
  std::filesystem::create_symlink("nowhere", directory / "dangling");
  ASSERT_EQ(mkfifo((directory / "pipe").c_str(), 0600), 0);
  const auto open = [&](const std::filesystem::path& path) {
    return InputFile(path, "a table").size();
  };
  EXPECT_INPUT_ERROR(open(directory / "none"), "none: expected a table, found no such file");
  EXPECT_INPUT_ERROR(open(directory / "folder"), "found a directory");
  EXPECT_INPUT_ERROR(open(directory / "loop"), "found a link that leads to itself");
  EXPECT_INPUT_ERROR(open(directory / "dangling"), "found a link that leads nowhere");
  EXPECT_INPUT_ERROR(open(directory / "pipe"), "found a pipe or a device, no ordinary file");
  EXPECT_INPUT_ERROR(open("/dev/zero"), "found a pipe or a device, no ordinary file");
}

TEST(InputFile, IsInterrupted) {
  const TemporaryDirectory directory;
  write_bytes(directory / "a", std::string(200000, 'x'));
  InputFile file(directory / "a", "text");
  std::string text(10, '\0');
  file.read(text.data(), 10);
  request_interrupt();
  EXPECT_ERROR(std::getline(file, text), ErrorCode::kInterrupted, "interrupted");
  clear_interrupt();
}

// A pipe that nobody writes to must not be waited for, whatever reads it. (A reader that waits
// hangs this test until its limit.)
TEST(Readers, RefusePipes) {
  const TemporaryDirectory directory;
  const auto pipe = [&](const char* name) {
    EXPECT_EQ(mkfifo((directory / name).c_str(), 0600), 0);
    return directory / name;
  };
  EXPECT_INPUT_ERROR(read_json_file(pipe("a.json")), "a.json");
  EXPECT_INPUT_ERROR(read_sim3(pipe("sim3.json")), "sim3.json");
  EXPECT_INPUT_ERROR(read_tum(pipe("a.tum")), "a.tum");
  EXPECT_INPUT_ERROR(read_reference_cameras(pipe("a.csv")), "a.csv");
  EXPECT_INPUT_ERROR(read_npy_file(pipe("a.npy")), "a.npy");
  EXPECT_INPUT_ERROR(NpzReader(pipe("a.npz")), "a.npz");
  EXPECT_INPUT_ERROR(read_ply(pipe("a.ply")), "a.ply");
  EXPECT_INPUT_ERROR(read_image(pipe("a.jpg")), "a.jpg");
  EXPECT_ERROR(open_weight_file(pipe("a.pt")), ErrorCode::kWeights, "a.pt");
  pipe("images.bin");
  pipe("cameras.bin");
  EXPECT_INPUT_ERROR(read_reference_cameras(directory / "images.bin"), "images.bin");
  for (const char* name : {"b.jpg", "b.mp4"}) {
    EXPECT_INPUT_ERROR(find_photos(pipe(name).string(), {}, silent_progress()), name);
    EXPECT_INPUT_ERROR(content_hash({directory / name, name, nullptr}), name);
  }
}

TEST(FindPhotos, LeavesOutWhatIsNoFileWithANotice) {
  const TemporaryDirectory directory;
  for (const char* name : {"1.jpg", "2.jpg"}) write_bytes(directory / name, name);
  std::filesystem::create_symlink("loop.jpg", directory / "loop.jpg");
  std::filesystem::create_symlink("gone", directory / "dangling.jpg");
  ASSERT_EQ(mkfifo((directory / "pipe.jpg").c_str(), 0600), 0);
  RecordingProgress progress;
  EXPECT_EQ(find_photos(directory.path().string(), {}, progress).size(), 2u);
  const auto has = [](const char* part) { return ::testing::HasSubstr(part); };
  EXPECT_THAT(
      progress.notices,
      ::testing::ElementsAre(has("dangling.jpg is left out: it is a link that leads nowhere"),
                             has("loop.jpg is left out: it is a link that leads to itself"),
                             has("pipe.jpg is left out: it is a pipe or a device")));
}

}  // namespace
}  // namespace vggtcd
