// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/sim3_file.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/support/test_files.h"
#include "vggtcd/io/npz.h"

namespace vggtcd {
namespace {

Sim3 example() {
  return {1.0 / 3,
          Eigen::AngleAxisd(0.7, Eigen::Vector3d(3, -1, 2).normalized()).toRotationMatrix(),
          {1e-12, -2, 1e6}};
}

void expect_example(const Sim3& sim3) {
  EXPECT_EQ(sim3.scale, example().scale);
  EXPECT_EQ(sim3.translation, example().translation);
  EXPECT_LT((sim3.rotation - example().rotation).norm(), 1e-15);  // made exact again by an SVD
}

TEST(Sim3File, JsonReadsBack) {
  const TemporaryDirectory directory;
  Json json = sim3_to_json(example());
  json["verdict"] = "refined";  // more members do not matter
  write_json_file(directory / "sim3.json", json);
  expect_example(read_sim3(directory / "sim3.json"));
}

TEST(Sim3File, NpzReadsBack) {
  const TemporaryDirectory directory;
  write_sim3_npz(directory / "fine_sim3.npz", example());
  expect_example(read_sim3(directory / "fine_sim3.npz"));
}

TEST(Sim3File, RotationIsInRows) {
  const Json json = Json::parse(
      R"({"scale": 2, "rotation": [[0, -1, 0], [1, 0, 0], [0, 0, 1]], "translation": [1, 2, 3]})");
  const Sim3 sim3 = sim3_from_json(json, "x");
  EXPECT_LT((sim3 * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, 4, 3)).norm(), 1e-15);
}

TEST(Sim3File, RefusesWhatIsNoSimilarity) {
  const auto expect = [](const char* text, std::string_view part) {
    EXPECT_INPUT_ERROR(sim3_from_json(Json::parse(text), "a.json"), part);
  };
  expect("[]", "a.json: expected a JSON object with \"scale\", found none");
  expect(R"({"scale": "1"})", "a.json: scale: expected a number");
  expect(R"({"scale": 1, "rotation": [[1,0,0],[0,1,0]]})", "a.json: rotation: expected 3 rows");
  expect(R"({"scale": 1, "rotation": [[1,0,0],[0,1,0],[0,0]]})", "rotation: expected 3 numbers");
  expect(R"({"scale": 1, "rotation": [[1,0,0],[0,1,0],[0,0,1]], "translation": [1, 2, null]})",
         "a.json: translation: expected 3 numbers");
  expect(R"({"scale": 0, "rotation": [[1,0,0],[0,1,0],[0,0,1]], "translation": [1, 2, 3]})",
         "a.json: expected a scale above 0, found 0");
  expect(R"({"scale": 1e308, "rotation": [[1,0,0],[0,1,0],[0,0,1]], "translation": [1, 2, 3]})",
         "a.json: expected a scale from 1e-13 to 1e+13, found 1e+308");
  expect(R"({"scale": 1, "rotation": [[1,0,0],[0,1,0],[0,0,1]], "translation": [1, 1e300, 3]})",
         "a.json: translation: expected coordinates from -1e13 to 1e13");
  expect(R"({"scale": 1, "rotation": [[1,0,0],[0,1,0],[0,0,-1]], "translation": [1, 2, 3]})",
         "a.json: expected a rotation");
  const TemporaryDirectory directory;
  const std::vector<double> nine(9, 0.0);
  NpzWriter npz(directory / "a.npz");
  npz.add<double>("s", {9}, nine);
  npz.add<double>("R", {3, 3}, nine);
  npz.finish();
  EXPECT_INPUT_ERROR(read_sim3(directory / "a.npz"), "expected an array t, found s, R");
}

}  // namespace
}  // namespace vggtcd
