// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/report/report_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <set>

#include "tests/support/test_files.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/report/levels.h"
#include "vggtcd/report/page_template.h"

namespace vggtcd {
namespace {

using Json = nlohmann::json;

// --- a reader of the data block written from docs/formats.md, not from the writer ---

std::string base64_decode(const std::string& text) {
  std::string bytes;
  uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    const uint32_t digit = c >= 'A' && c <= 'Z'   ? static_cast<uint32_t>(c - 'A')
                           : c >= 'a' && c <= 'z' ? static_cast<uint32_t>(c - 'a' + 26)
                           : c >= '0' && c <= '9' ? static_cast<uint32_t>(c - '0' + 52)
                           : c == '+'             ? 62u
                                                  : 63u;
    bits = bits << 6 | digit;
    count += 6;
    if (count >= 8) bytes.push_back(static_cast<char>(bits >> (count -= 8) & 255));
  }
  return bytes;
}

std::vector<uint8_t> inflate_block(const Json& data, const Json& block, size_t size) {
  const std::string packed = base64_decode(data.at("blocks").at(block.get<size_t>()));
  std::vector<uint8_t> bytes(size + 1);
  uLongf found = size + 1;
  EXPECT_EQ(uncompress(bytes.data(), &found, reinterpret_cast<const Bytef*>(packed.data()),
                       static_cast<uLong>(packed.size())),
            Z_OK);
  EXPECT_EQ(found, size);
  bytes.resize(size);
  return bytes;
}

struct DecodedPoint {
  Eigen::Vector3d position;
  std::array<int, 3> color;
  int level;
};

std::vector<DecodedPoint> decode(const Json& data, const Json& cloud) {
  const size_t n = cloud.at("shown");
  const auto position = inflate_block(data, cloud.at("position"), 6 * n);
  const auto color = inflate_block(data, cloud.at("color"), 3 * n);
  const auto level = inflate_block(data, cloud.at("level"), n);
  std::vector<DecodedPoint> points(n);
  for (size_t axis = 0; axis < 3; ++axis) {
    uint32_t q = 0, c = 0;
    for (size_t i = 0; i < n; ++i) {
      const uint32_t zigzag = position[2 * axis * n + i] + 256u * position[(2 * axis + 1) * n + i];
      q = (q + (zigzag % 2 ? 65535u - zigzag / 2 : zigzag / 2)) % 65536u;
      points[i].position[static_cast<int>(axis)] =
          cloud.at("box_min")[axis].get<double>() +
          q * cloud.at("box_size")[axis].get<double>() / 65535;
      c = (c + color[axis * n + i]) % 64;
      points[i].color[axis] = static_cast<int>(c);
      points[i].level = level[i];
    }
  }
  return points;
}

Json data_of_page(const std::string& page) {
  const std::string open = R"(<script type="application/json" id="report-data">)";
  const size_t begin = page.find(open) + open.size();
  return Json::parse(page.substr(begin, page.find("</script>", begin) - begin));
}

// Two flat clouds, of which a corner changed; color and level tell the points apart.
ReportInput example(size_t points_per_epoch, int photos = 2) {
  ReportInput input;
  input.title = "before and after";
  input.extent_u = 4;
  input.threshold_u = 0.04;
  input.bound_u = 0.08;
  input.summary = {{"method", "paper"}};
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  for (ReportEpoch* epoch : {&input.before, &input.after}) {
    ReportPoints points;
    for (size_t i = 0; i < points_per_epoch; ++i) {
      points.positions.emplace_back(4 * unit(random), 3 * unit(random), 0.1f * unit(random));
      for (int c = 0; c < 3; ++c) points.color.push_back(static_cast<uint8_t>(255 * unit(random)));
      points.change_distance.push_back(i % 50 == 0 ? 0.06f : 0.03f * unit(random));
    }
    epoch->cloud = cloud_of(std::move(points));
    epoch->width = 40;
    epoch->height = 30;
    for (int i = 0; i < photos; ++i) {
      ReportPhoto photo;
      photo.name = fmt::format("photo {}.jpg", i);
      photo.camera_from_world = Rigid3();
      photo.pinhole = Pinhole{30, 32, 19.5, 14.5, 40, 30};
      epoch->photos.push_back(photo);
    }
    epoch->score.resize(static_cast<size_t>(photos) * 1200);
    for (size_t i = 0; i < epoch->score.size(); ++i) {
      epoch->score[i] = i % 5 == 0 ? std::nanf("") : 0.08f * unit(random);
    }
    epoch->image = [](int i) {
      Image image(40, 30);
      for (size_t k = 0; k < image.rgb.size(); ++k)
        image.rgb[k] = static_cast<uint8_t>(80 + 40 * i + static_cast<int>(k % 3));
      return image;
    };
  }
  return input;
}

ReportPoints all_points(const ReportCloud& cloud) {
  ReportPoints all;
  cloud.for_each_block([&](const ReportPoints& block) { all = block; });
  return all;
}

Json data_for(const ReportInput& input, const ReportOptions& options = {}) {
  return Json::parse(make_report_data(input, options).json);
}

TEST(ReportData, PointsComeBackWithinHalfAStep) {
  const ReportInput input = example(3000);
  const Json data = data_for(input);
  const LevelScale scale(input.threshold_u, input.bound_u);
  for (const Json& cloud : data.at("clouds")) {
    const ReportPoints truth =
        all_points(cloud.at("epoch") == "before" ? input.before.cloud : input.after.cloud);
    const auto points = decode(data, cloud);
    ASSERT_EQ(points.size(), truth.positions.size());
    std::set<size_t> met;
    // Half a step of the box along each axis, and float rounding of the box itself.
    const Eigen::Vector3d bound(4.2 / 65535, 3.2 / 65535, 0.2 / 65535);
    for (const DecodedPoint& point : points) {
      bool found = false;
      for (size_t i = 0; i < truth.positions.size() && !found; ++i) {
        const Eigen::Vector3d error =
            (truth.positions[i].cast<double>() - point.position).cwiseAbs();
        if ((error.array() > 0.5 * bound.array()).any()) continue;
        found = met.insert(i).second;
        for (size_t c = 0; c < 3; ++c) EXPECT_EQ(point.color[c], truth.color[3 * i + c] >> 2);
        EXPECT_EQ(point.level, scale.level(truth.change_distance[i]));
      }
      EXPECT_TRUE(found) << point.position.transpose();
    }
  }
}

TEST(ReportData, KeepsEveryChangedPointAndSaysWhatItDropped) {
  const ReportInput input = example(20000);
  ReportOptions options;
  options.max_points = 5000;
  const Json data = data_for(input, options);
  int64_t shown = 0;
  for (const Json& cloud : data.at("clouds")) {
    EXPECT_EQ(cloud.at("points"), 20000);
    EXPECT_EQ(cloud.at("changed"), 400);
    EXPECT_EQ(cloud.at("changed_shown"), 400);
    const int threshold = data.at("levels").at("threshold");
    EXPECT_THAT(
        decode(data, cloud),
        testing::Contains(testing::Field(&DecodedPoint::level, testing::Gt(threshold))).Times(400));
    shown += cloud.at("shown").get<int64_t>();
  }
  EXPECT_EQ(shown, 5000);
}

TEST(ReportData, MoreChangedPointsThanRoomLeavesNoneOfTheOthers) {
  ReportInput input = example(2000);
  ReportOptions options;
  options.max_points = 50;  // of 80 changed ones
  const Json some = data_for(input, options);
  for (const Json& cloud : some.at("clouds")) {
    EXPECT_EQ(cloud.at("shown"), 25);
    EXPECT_EQ(cloud.at("changed_shown"), 25);
  }
  options.max_points = 0;
  const Json none = data_for(input, options);
  for (const Json& cloud : none.at("clouds")) EXPECT_EQ(cloud.at("shown"), 0);
}

TEST(ReportData, StrayPointsDoNotCoarsenTheRest) {
  ReportInput input = example(20000);
  ReportPoints points = all_points(input.before.cloud);
  points.positions[7] = {1e7f, 0, 0};
  points.positions[8] = {NAN, 0, 0};
  points.positions[9] = {0, -INFINITY, 0};
  input.before.cloud = cloud_of(std::move(points));
  const Json data = data_for(input);
  const Json& cloud = data.at("clouds")[0];
  EXPECT_EQ(cloud.at("far_away"), 3);
  EXPECT_EQ(cloud.at("shown"), 19997);
  EXPECT_LT(cloud.at("box_size")[0].get<double>(), 13.0);  // at most its own size on either side
}

TEST(ReportData, CountsEveryPixelOfTheScores) {
  const ReportInput input = example(10);
  const Json data = data_for(input);
  const int steps = data.at("levels").at("threshold");
  for (const char* name : {"before", "after"}) {
    const auto& score = name[0] == 'b' ? input.before.score : input.after.score;
    for (const int k : {0, 31, steps, 200}) {
      const auto edge = static_cast<float>(input.threshold_u * k / steps);
      int64_t expected = 0;
      for (const float s : score) expected += s > edge;
      EXPECT_EQ(data.at("evidence").at(name).at("above")[static_cast<size_t>(k)], expected);
    }
  }
  int64_t changed = 0;
  for (size_t i = 0; i < 1200; ++i) changed += input.before.score[i] > 0.04f;
  EXPECT_EQ(data.at("photos")[0].at("changed"), changed);
  EXPECT_EQ(data.at("photos")[0].at("pixels"), 960);
}

TEST(ReportData, PhotosAreJpegsOfTheirPixels) {
  const ReportInput input = example(10);
  const Json data = data_for(input);
  const Json& photo = data.at("photos")[1];
  const std::string jpeg =
      base64_decode(data.at("blocks")[photo.at("image").at("block").get<size_t>()]);
  const cv::Mat pixels =
      cv::imdecode(std::vector<char>(jpeg.begin(), jpeg.end()), cv::IMREAD_COLOR);
  ASSERT_EQ(pixels.cols, 40);
  ASSERT_EQ(pixels.rows, 30);
  // A flat colour survives JPEG but for rounding of its transform.
  EXPECT_NEAR(pixels.at<cv::Vec3b>(12, 20)[2], 120, 2);  // red
  EXPECT_NEAR(pixels.at<cv::Vec3b>(12, 20)[0], 122, 2);  // blue
}

TEST(ReportData, StaysWithinItsBudget) {
  ReportInput input = example(150000, 12);
  std::mt19937 random(8);
  for (ReportEpoch* epoch : {&input.before, &input.after}) {
    epoch->width = 200;
    epoch->height = 150;
    epoch->score.assign(12 * 30000, 0.0f);
    for (float& s : epoch->score) s = static_cast<float>(random() % 1000) * 1e-4f;
    epoch->image = [](int i) {  // noise, the worst case for JPEG
      std::mt19937 noise(static_cast<unsigned>(i));
      Image image(200, 150);
      for (uint8_t& value : image.rgb) value = static_cast<uint8_t>(noise());
      return image;
    };
  }
  ReportOptions options;
  options.max_bytes = 1500000;
  TemporaryDirectory directory;
  const ReportSize size = write_report(input, options, directory / "report.html");
  EXPECT_EQ(size.bytes, static_cast<int64_t>(file_bytes(directory / "report.html").size()));
  EXPECT_LE(size.bytes, options.max_bytes);
  EXPECT_GT(size.bytes, options.max_bytes / 2);
  EXPECT_LT(size.points_shown, size.points);
  const Json data = data_of_page(file_bytes(directory / "report.html"));
  for (const Json& cloud : data.at("clouds"))
    EXPECT_EQ(cloud.at("changed_shown"), cloud.at("changed"));
}

TEST(ReportPage, NoTextCanEndTheElementItStandsIn) {
  ReportInput input = example(10);
  const std::string evil =
      "</script><script>alert(1)</script><!--<img src=x onerror=alert(2)>&lt;\"'\\";
  input.title = evil;
  input.before.photos[0].name = evil;
  input.after.photos[1].name = "\xff\xfe not UTF-8 \xc3";
  input.summary["options"][evil] = evil;
  TemporaryDirectory directory;
  write_report(input, {}, directory / "report.html");
  const std::string page = file_bytes(directory / "report.html");
  const Json data = data_of_page(page);
  EXPECT_EQ(data.at("title"), evil);
  EXPECT_EQ(data.at("photos")[0].at("name"), evil);
  EXPECT_EQ(data.at("summary").at("options").at(evil), evil);
  // The page has the same elements as the template alone.
  const auto count = [](std::string_view text, std::string_view part) {
    size_t n = 0;
    for (size_t at = text.find(part); at != std::string_view::npos; at = text.find(part, at + 1))
      ++n;
    return n;
  };
  for (const char* part : {"<script", "</script", "<!--", "<img"}) {
    EXPECT_EQ(count(page, part), count(page_template(), part)) << part;
  }
}

TEST(ReportPage, TakesEmptyEpochs) {
  ReportInput input = example(0, 0);
  const Json data = data_for(input);
  EXPECT_EQ(data.at("photos").size(), 0u);
  EXPECT_EQ(data.at("clouds")[0].at("shown"), 0);
  EXPECT_EQ(data.at("evidence").at("after").at("pixels"), 0);
}

TEST(ReportPage, HasTheSameBytesOnAnyNumberOfThreads) {
  const ReportInput input = example(40000, 5);
  const int before = num_threads();
  set_num_threads(1);
  const std::string one = make_report_data(input, {}).json;
  set_num_threads(3);
  EXPECT_EQ(one, make_report_data(input, {}).json);
  set_num_threads(before);
}

TEST(ReportPage, UnwritablePlaceIsOneLine) {
  EXPECT_ERROR(write_report(example(1), {}, "/no/such/place/report.html"), ErrorCode::kOutput,
               "/no/such/place");
}

TEST(ReportOptions, RefuseNonsense) {
  EXPECT_ERROR(make_report_data(example(1), {.max_points = -1}), ErrorCode::kUsage, "max_points");
  EXPECT_ERROR(make_report_data(example(1), {.max_points = 1, .max_bytes = 10}), ErrorCode::kUsage,
               "max_bytes");
}

}  // namespace
}  // namespace vggtcd
