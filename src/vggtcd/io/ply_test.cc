// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/ply.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstring>

#include "tests/support/test_files.h"

namespace vggtcd {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const char* const kMixed = "tests/golden/geometry_files/mixed.ply";

void write_three_points(const std::filesystem::path& path) {
  PlyWriter ply(path, 3, {"change_distance", "changed"}, std::vector<std::string>{"frame T2"});
  for (int i = 0; i < 3; ++i) {
    const float x = static_cast<float>(i);
    const uint8_t rgb[] = {static_cast<uint8_t>(i), 200, 255};
    const float values[] = {i == 2 ? NAN : x / 2, 1.0f};
    ply.add({x, -x, 0.1f}, rgb, values);
  }
  ply.commit();
}

TEST(PlyWriter, WritesTheHeaderAndRecordsThatViewersExpect) {
  const TemporaryDirectory directory;
  write_three_points(directory / "a.ply");
  const std::string bytes = file_bytes(directory / "a.ply");
  const std::string header =
      "ply\nformat binary_little_endian 1.0\ncomment frame T2\nelement vertex 3\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property float scalar_change_distance\nproperty float scalar_changed\n"
      "property float quality\nend_header\n";
  ASSERT_EQ(bytes.substr(0, header.size()), header);
  ASSERT_EQ(bytes.size(), header.size() + 3 * (12 + 3 + 12));
  const char* second = bytes.data() + header.size() + 27;
  const auto number = [&](size_t offset) {
    float value;
    std::memcpy(&value, second + offset, sizeof(value));
    return value;
  };
  EXPECT_EQ(number(0), 1.0f);
  EXPECT_EQ(number(4), -1.0f);
  EXPECT_EQ(number(8), 0.1f);
  EXPECT_EQ(std::string(second + 12, 3), "\x01\xc8\xff");
  EXPECT_EQ(number(15), 0.5f);
  EXPECT_EQ(number(19), 1.0f);
  EXPECT_EQ(number(23), 0.5f);
}

TEST(PlyWriter, FarFromTheOriginPositionsAreDoubles) {
  const TemporaryDirectory directory;
  const Eigen::Vector3d origin(691234, 5334321, 512.5);
  const Eigen::Vector3f position(0.001f, -1.25f, 3.5f);
  {
    PlyWriter ply(directory / "a.ply", 1, {"changed"}, {}, origin);
    const uint8_t rgb[] = {1, 2, 3};
    const float values[] = {1.0f};
    ply.add(position, rgb, values);
    ply.commit();
  }
  const std::string bytes = file_bytes(directory / "a.ply");
  EXPECT_THAT(bytes, HasSubstr("property double x\nproperty double y\nproperty double z\n"));
  double y = 0;
  std::memcpy(&y, bytes.data() + bytes.find("end_header\n") + 11 + 8, sizeof(y));
  EXPECT_EQ(y, 5334319.75);
  const PlyReader reader(directory / "a.ply");
  int blocks = 0;
  reader.read(
      {},
      [&](const PlyCloud& block) {
        ++blocks;
        EXPECT_LT((block.positions[0] - position).norm(), 1e-8f);
        EXPECT_THAT(block.rgb, ElementsAre(1, 2, 3));
      },
      origin);
  EXPECT_EQ(blocks, 1);
}

TEST(ReadPly, ReadsBackWhatWasWritten) {
  const TemporaryDirectory directory;
  write_three_points(directory / "a.ply");
  const PlyCloud cloud = read_ply(directory / "a.ply");
  ASSERT_EQ(cloud.positions.size(), 3u);
  EXPECT_EQ(cloud.positions[2], Eigen::Vector3f(2, -2, 0.1f));
  EXPECT_THAT(cloud.rgb, ElementsAre(0, 200, 255, 1, 200, 255, 2, 200, 255));
  ASSERT_NE(cloud.field("change_distance"), nullptr);
  EXPECT_EQ((*cloud.field("change_distance"))[1], 0.5f);
  EXPECT_TRUE(std::isnan((*cloud.field("change_distance"))[2]));
  EXPECT_EQ((*cloud.field("changed"))[0], 1.0f);
  EXPECT_EQ(cloud.field("confidence"), nullptr);
}

TEST(ReadPly, ReadsEveryTypeAndIgnoresFaces) {
  const PlyCloud cloud = read_ply(source_file(kMixed));
  ASSERT_EQ(cloud.positions.size(), 3u);
  EXPECT_EQ(cloud.positions[2], Eigen::Vector3f(2, -1, 4));
  EXPECT_THAT(cloud.rgb, ElementsAre(0, 0, 255, 1, 10, 254, 2, 20, 253));
  EXPECT_THAT(*cloud.field("score"), ElementsAre(0, 0.25f, 0.5f));
  EXPECT_THAT(*cloud.field("label"), ElementsAre(0, -1000, -2000));
  EXPECT_THAT(*cloud.field("level"), ElementsAre(60000, 60001, 60002));
  EXPECT_THAT(*cloud.field("sign"), ElementsAre(0, -1, -2));
}

TEST(PlyReader, BlocksJoinedAreTheFileAndHoldOnlyWhatWasAskedFor) {
  const TemporaryDirectory directory;
  constexpr size_t kPoints = 70001;
  PlyWriter writer(directory / "a.ply", kPoints, {"first", "second"});
  for (size_t i = 0; i < kPoints; ++i) {
    const float value = static_cast<float>(i);
    const uint8_t rgb[] = {static_cast<uint8_t>(i), static_cast<uint8_t>(i >> 8), 7};
    const float values[] = {value, -value};
    writer.add({value, 0, 1}, rgb, values);
  }
  writer.commit();
  const PlyReader reader(directory / "a.ply");
  EXPECT_EQ(reader.size(), kPoints);
  EXPECT_THAT(reader.fields(), ElementsAre("first", "second", "quality"));
  const std::vector<std::string> fields = {"second"};
  size_t number = 0;
  int blocks = 0;
  reader.read(fields, [&](const PlyCloud& block) {
    ++blocks;
    ASSERT_EQ(block.fields.size(), 1u);
    for (size_t i = 0; i < block.positions.size(); ++i, ++number) {
      ASSERT_EQ(block.positions[i].x(), static_cast<float>(number));
      ASSERT_EQ(block.rgb[3 * i + 1], static_cast<uint8_t>(number >> 8));
      ASSERT_EQ(block.fields[0].values[i], -static_cast<float>(number));
    }
  });
  EXPECT_EQ(number, kPoints);
  EXPECT_GT(blocks, 2);
}

TEST(ReadPly, EmptyCloudsAreClouds) {
  const TemporaryDirectory directory;
  PlyWriter(directory / "a.ply", 0, {"changed"}).commit();
  EXPECT_EQ(read_ply(directory / "a.ply").positions.size(), 0u);
}

TEST(ReadPly, RefusesOtherAndDamagedFiles) {
  const TemporaryDirectory directory;
  const auto expect = [&](std::string_view content, std::string_view part) {
    write_bytes(directory / "a.ply", content);
    EXPECT_INPUT_ERROR(read_ply(directory / "a.ply"), part);
  };
  const std::string start = "ply\nformat binary_little_endian 1.0\n";
  const std::string xyz = "property float x\nproperty float y\nproperty float z\nend_header\n";
  expect("", "found a truncated header");
  expect("obj\n", "found another file");
  expect("ply\nformat " + std::string(5000, '\x1b') + " 1.0\nend_header\n", "found \"\\x1b\\x1b");
  expect("ply\nformat ascii 1.0\nend_header\n", R"(found "ascii" data)");
  expect(start + "element vertex 2\n", "found a truncated header");
  expect(start + "end_header\n", "found no vertices with x, y and z");
  expect(start + "element vertex 2\nproperty float x\nend_header\n", "found no vertices");
  expect(start + "element vertex 2x\n" + xyz, "found a broken header line: \"element vertex 2x\"");
  expect(start + "element vertex two\n" + xyz,
         "found a broken header line: \"element vertex two\"");
  expect(start + "element vertex 2\nproperty float x\n" + xyz, "found an unusable property");
  expect(start + "element vertex 2\nproperty list uchar int x\n" + xyz, "an unusable property");
  expect(start + "element face 2\nelement vertex 2\n" + xyz,
         "an element \"face\" before the vertices");
  expect(start + "element vertex 2\n" + xyz + std::string(23, 'a'),
         "expected 2 points of 12 bytes, found 23 bytes; truncated");
  expect(start + "element vertex 9000000000000000000\n" + xyz, "truncated");
  EXPECT_INPUT_ERROR(read_ply(directory / "none.ply"), "found no such file");
}

TEST(PlyWriter, WithoutCommitLeavesNothing) {
  const TemporaryDirectory directory;
  { PlyWriter ply(directory / "a.ply", 3, {}); }
  EXPECT_EQ(directory.num_files(), 0u);
  EXPECT_ERROR(PlyWriter(directory / "no/a.ply", 0, {}), ErrorCode::kOutput,
               "no/a.ply: cannot be written: No such file or directory");
}

}  // namespace
}  // namespace vggtcd
