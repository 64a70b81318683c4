// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/json_file.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/test_files.h"

namespace vggtcd {
namespace {

enum class Colour { kRed, kGreen };
std::span<const EnumName<Colour>> enum_names(Colour) {
  static constexpr EnumName<Colour> kNames[] = {{Colour::kRed, "red"}, {Colour::kGreen, "green"}};
  return kNames;
}

struct InnerOptions {
  double factor = 3;
  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("factor", self.factor, "a factor");
  };
};

struct OuterOptions {
  bool refine = true;
  int count = 5;
  int64_t large = -1;
  uint64_t seed = 0;
  float share = 0.5f;
  std::string name = "x";
  Colour colour = Colour::kRed;
  InnerOptions inner;
  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("refine", self.refine, "");
    field("count", self.count, "");
    field("large", self.large, "");
    field("seed", self.seed, "");
    field("share", self.share, "");
    field("name", self.name, "");
    field("colour", self.colour, "");
    field("inner", self.inner, "");
  };
};

TEST(OptionsJson, KeepsOrderAndWritesEnumsByName) {
  EXPECT_EQ(options_to_json(OuterOptions{}).dump(),
            R"({"refine":true,"count":5,"large":-1,"seed":0,"share":0.5,"name":"x",)"
            R"("colour":"red","inner":{"factor":3.0}})");
}

TEST(OptionsJson, ReadsBackAndLeavesWhatIsAbsent) {
  OuterOptions options;
  options.refine = false;
  options.seed = std::numeric_limits<uint64_t>::max();
  options.large = std::numeric_limits<int64_t>::min();
  options.colour = Colour::kGreen;
  options.inner.factor = 0.1;
  OuterOptions back;
  options_from_json(Json::parse(options_to_json(options).dump()), back, "o.json");
  EXPECT_EQ(options_to_json(back), options_to_json(options));
  options_from_json(Json::parse(R"({"inner": {}})"), back, "o.json");
  EXPECT_EQ(options_to_json(back), options_to_json(options));
}

TEST(OptionsJson, RefusesUnknownNamesAndWrongTypes) {
  const auto expect = [](const char* text, std::string_view part) {
    OuterOptions options;
    EXPECT_INPUT_ERROR(options_from_json(Json::parse(text), options, "o.json"), part);
  };
  expect(R"({"cuont": 3})", "o.json: unknown option \"cuont\"");
  expect("[1]", "o.json: expected an object of options");
  expect(R"({"count": 3.5})", "o.json: count: expected a value of another type or name, found 3.5");
  expect(R"({"count": 3000000000})", "o.json: count");
  expect(R"({"count": -3000000000})", "o.json: count");
  expect(R"({"seed": -1})", "o.json: seed");
  expect(R"({"large": 18446744073709551615})", "o.json: large");
  expect(R"({"refine": 1})", "o.json: refine");
  expect(R"({"name": 1})", "o.json: name");
  expect(R"({"colour": "blue"})", "o.json: colour: expected a value of another type or name");
  expect(R"({"inner": {"factor": "a"}})", "o.json: inner: factor");
}

TEST(JsonFile, ReadsBackDoublesExactlyAndReplacesTextThatIsNotUtf8) {
  const TemporaryDirectory directory;
  Json json;
  json["x"] = 0.1 + 0.2;
  json["y"] = std::numeric_limits<double>::denorm_min();
  json["name"] = "a\xff";
  write_json_file(directory / "a.json", json);
  const Json back = read_json_file(directory / "a.json");
  EXPECT_EQ(back["x"], json["x"]);
  EXPECT_EQ(back["y"], json["y"]);
  EXPECT_EQ(back["name"], "a\ufffd");
}

TEST(JsonFile, RefusesBrokenDeepAndMissingFiles) {
  const TemporaryDirectory directory;
  const auto expect = [&](std::string_view content, std::string_view part) {
    write_bytes(directory / "a.json", content);
    EXPECT_INPUT_ERROR(read_json_file(directory / "a.json"), part);
  };
  expect("", "expected JSON, found something else");
  expect("{\"a\": 1,}", "found something else at byte 9");
  expect(R"({"scale": 1e999})", "a.json: expected JSON, found a number that no double can hold");
  expect("[-1e400, 0]", "a number that no double can hold");
  expect(std::string(1000000, '['), "expected JSON nested at most 100 deep");
  EXPECT_INPUT_ERROR(read_json_file(directory / "none.json"),
                     "none.json: expected a readable JSON file");
  EXPECT_INPUT_ERROR(read_json_file(directory.path()), "found a directory");
  // Brackets in text do not count.
  write_bytes(directory / "a.json", "\"\\\"" + std::string(200, '[') + "\"");
  EXPECT_EQ(read_json_file(directory / "a.json").get<std::string>().size(), 201u);
}

}  // namespace
}  // namespace vggtcd
