// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/vggt/position_embedding.h"

#include <gtest/gtest.h>

#include <regex>

#include "vggtcd/io/npz.h"
#include "vggtcd/vggt/dpt_head.h"

namespace vggtcd {
namespace {

const char* const kPieces = VGGTCD_SOURCE_DIR "/tests/golden/vggt_pieces/pieces.npz";

void expect_near_all(const std::vector<float>& found, const std::vector<float>& expected,
                     double bound, const std::string& what) {
  ASSERT_EQ(found.size(), expected.size()) << what;
  for (size_t i = 0; i < found.size(); ++i) {
    ASSERT_NEAR(found[i], expected[i], bound) << what << " at element " << i;
  }
}

TEST(ResamplePositionGrid, MatchesTheReferenceUpAndDown) {
  const NpzReader pieces(kPieces);
  int cases = 0;
  for (const std::string& key : pieces.keys()) {
    std::smatch match;
    if (!std::regex_match(key, match, std::regex("interp_(\\d+)_(\\d+)x(\\d+)"))) continue;
    const int64_t side = std::stoll(match[1]);
    const auto grid = pieces.read<float>("pos_grid_" + match[1].str());
    // The reference's f32 weights are themselves off by up to 9e-6.
    expect_near_all(resample_position_grid(grid, side, std::ssize(grid) / (side * side),
                                           std::stoll(match[2]), std::stoll(match[3])),
                    pieces.read<float>(key), 2e-5, key);
    ++cases;
  }
  EXPECT_EQ(cases, 10);
}

TEST(ResamplePositionGrid, ItsOwnSizeIsTakenAsItIs) {
  const NpzReader pieces(kPieces);
  const auto grid = pieces.read<float>("pos_grid_5");
  EXPECT_EQ(resample_position_grid(grid, 5, std::ssize(grid) / 25, 5, 5), grid);
}

TEST(ResamplePositionGrid, KeepsAConstant) {
  const std::vector<float> grid(7 * 7, 2.5f);
  for (const float value : resample_position_grid(grid, 7, 1, 3, 20))
    ASSERT_NEAR(value, 2.5f, 1e-6);
}

TEST(DptPositions, MatchTheReference) {
  const NpzReader pieces(kPieces);
  int cases = 0;
  for (const std::string& key : pieces.keys()) {
    std::smatch match;
    if (!std::regex_match(key, match,
                          std::regex("dpt_pos_(\\d+)x(\\d+)_img(\\d+)x(\\d+)_c(\\d+)"))) {
      continue;
    }
    const int64_t height = std::stoll(match[1]), width = std::stoll(match[2]);
    const int64_t channels = std::stoll(match[5]);
    const DptPositions positions(height, width, channels, std::stoll(match[3]),
                                 std::stoll(match[4]));
    std::vector<float> added(static_cast<size_t>(height * width * channels));
    positions.add(0, height * width, added.data(), channels);
    const int64_t stored = pieces.header(key).shape[2];
    std::vector<float> found;
    for (size_t i = 0; i < added.size(); i += static_cast<size_t>(channels / stored)) {
      found.push_back(added[i]);
    }
    expect_near_all(found, pieces.read<float>(key), 2e-6, key);
    ++cases;
  }
  EXPECT_EQ(cases, 4);
}

TEST(DptPositions, ARunFromTheMiddleIsPartOfTheWhole) {
  const DptPositions positions(3, 5, 8, 42, 70);
  std::vector<float> all(3 * 5 * 8), part(4 * 8);
  positions.add(0, 15, all.data(), 8);
  positions.add(7, 4, part.data(), 8);
  EXPECT_TRUE(std::equal(part.begin(), part.end(), all.begin() + 7 * 8));
}

TEST(Activations, MatchTheReference) {
  const NpzReader pieces(kPieces);
  const auto near = [](float found, float expected) {
    ASSERT_NEAR(found, expected, 2e-6 * std::abs(expected));
  };
  const int64_t plane = 30;
  const auto depth_raw = pieces.read<float>("depth_raw"), depth = pieces.read<float>("depth"),
             depth_conf = pieces.read<float>("depth_conf");
  const auto point_raw = pieces.read<float>("point_raw"), point = pieces.read<float>("point"),
             point_conf = pieces.read<float>("point_conf");
  for (int64_t frame = 0; frame < 2; ++frame) {
    for (int64_t p = 0; p < plane; ++p) {
      const float* raw = depth_raw.data() + frame * 2 * plane + p;
      const auto pixel = static_cast<size_t>(frame * plane + p);
      near(activate_depth(raw[0]), depth[pixel]);
      near(activate_confidence(raw[plane]), depth_conf[pixel]);
      raw = point_raw.data() + frame * 4 * plane + p;
      for (size_t c = 0; c < 3; ++c) {
        near(activate_point(raw[static_cast<int64_t>(c) * plane]), point[3 * pixel + c]);
      }
      near(activate_confidence(raw[3 * plane]), point_conf[pixel]);
    }
  }
}

}  // namespace
}  // namespace vggtcd
