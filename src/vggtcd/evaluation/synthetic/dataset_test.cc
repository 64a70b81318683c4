// SPDX-License-Identifier: Apache-2.0
// The files of a generated scene: same bytes from the same seed, and readable by our own readers.
#include "vggtcd/evaluation/synthetic/dataset.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/support/test_files.h"
#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/io/predictions.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

std::map<std::string, std::string> all_bytes(const fs::path& directory) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(directory)) {
    if (!entry.is_regular_file()) continue;
    files[fs::relative(entry.path(), directory).string()] = file_bytes(entry.path());
  }
  return files;
}

SynthesizeOptions tiny() {
  SynthesizeOptions options;
  options.scene = "coffee_corner";
  options.seed = 7;
  options.keyframes = 2;
  options.render.frames = 3;
  options.render.width = 48;
  return options;
}

TEST(Synthesize, SameSeedSameBytesOnAnyNumberOfThreads) {
  const TemporaryDirectory temporary;
  std::map<std::string, std::string> first;
  const int before = num_threads();
  for (const int threads : {1, 3}) {
    const fs::path directory = temporary.path() / std::to_string(threads);
    set_num_threads(threads);
    synthesize(directory, tiny(), silent_progress());
    const auto files = all_bytes(directory);
    EXPECT_GT(files.size(), 10u);
    if (first.empty()) first = files;
    ASSERT_EQ(files.size(), first.size());
    for (const auto& [name, bytes] : files) EXPECT_TRUE(bytes == first[name]) << name;
  }
  set_num_threads(before);
  SynthesizeOptions other = tiny();
  other.seed = 8;
  const fs::path directory = temporary.path() / "seed";
  synthesize(directory, other, silent_progress());
  for (const auto& [name, bytes] : all_bytes(directory)) {
    // The camera is the same, and so is the mark of a directory of results.
    if (name.ends_with("cameras.bin") || name.starts_with(".")) continue;
    EXPECT_FALSE(bytes == first[name]) << name;
  }
}

TEST(Synthesize, WritesPredictionsAndTruthThatFit) {
  const TemporaryDirectory temporary;
  const fs::path directory = temporary.path() / "read";
  synthesize(directory, tiny(), silent_progress());
  const Reconstruction t1 = read_reconstruction(directory / "t1.npz", silent_progress());
  const Reconstruction t2 = read_reconstruction(directory / "t2.npz", silent_progress());
  const JointReconstruction joint = read_joint(directory / "joint.npz", t1, t2, silent_progress());
  EXPECT_EQ(t1.num_frames(), 3);
  EXPECT_EQ(t1.views[2].name, "0002.jpg");
  EXPECT_EQ(joint.keyframes_t2, (std::vector<int>{0, 2}));
  const NpzReader truth(directory / "truth.npz");
  for (const std::string epoch : {"_t1", "_t2"}) {
    const std::vector<int64_t> maps{3, t1.height, t1.width};
    for (const std::string key :
         {"depth", "changed", "change_class", "instance", "unseen_by_other"}) {
      EXPECT_EQ(truth.header(key + epoch).shape, maps) << key;
    }
    EXPECT_EQ(truth.header("extrinsic" + epoch).shape, (std::vector<int64_t>{3, 3, 4}));
  }
  EXPECT_NEAR(truth.read<double>("scale")[0], make_scene("coffee_corner", 7).scale_t2_from_t1,
              1e-12);
}

TEST(Synthesize, RefusesADirectoryWithFilesInIt) {
  const TemporaryDirectory temporary;
  const fs::path directory = temporary.path() / "full";
  fs::create_directories(directory);
  write_bytes(directory / "thesis.txt", "precious");
  try {
    synthesize(directory, tiny(), silent_progress());
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kOutput);
  }
  EXPECT_EQ(all_bytes(directory).size(), 1u);
}

}  // namespace
}  // namespace vggtcd
