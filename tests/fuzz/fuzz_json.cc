// SPDX-License-Identifier: Apache-2.0
// Fuzz target: any bytes as a JSON file: as it is, as a similarity, as options, and as the index of
// the shards of a checkpoint.
#include "tests/fuzz/fuzz_files.h"
#include "vggtcd/io/sim3_file.h"
#include "vggtcd/io/weight_shards.h"

namespace {

using vggtcd::fuzz::require;

enum class Kind { kOne, kOther };
std::span<const vggtcd::EnumName<Kind>> enum_names(Kind) {
  static constexpr vggtcd::EnumName<Kind> kNames[] = {{Kind::kOne, "one"}, {Kind::kOther, "other"}};
  return kNames;
}

// A field of every kind that options have.
struct Inner {
  int whole = 1;
  static constexpr auto fields = [](auto&& self, auto&& field) { field("whole", self.whole, ""); };
};
struct Options {
  bool flag = false;
  int64_t many = 0;
  uint64_t seed = 0;
  double share = 0;
  float length = 0;
  std::string name;
  Kind kind = Kind::kOne;
  Inner inner;
  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("flag", self.flag, "");
    field("many", self.many, "");
    field("seed", self.seed, "");
    field("share", self.share, "");
    field("length", self.length, "");
    field("name", self.name, "");
    field("kind", self.kind, "");
    field("inner", self.inner, "");
  };
};

template <typename Read>
void read_or_refuse(const Read& read) {
  try {
    read();
  } catch (const vggtcd::Error& error) {
    vggtcd::fuzz::check_refusal(error);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const vggtcd::fuzz::FuzzDirectory directory;
  const std::filesystem::path path =
      directory.write("input.json", vggtcd::fuzz::FuzzInput(data, size).rest());
  read_or_refuse([&] {
    const vggtcd::Json json = vggtcd::read_json_file(path);
    read_or_refuse([&] {
      Options options;
      vggtcd::options_from_json(json, options, "input.json");
      Options again;
      vggtcd::options_from_json(vggtcd::options_to_json(options), again, "input.json");
      require(again.many == options.many && again.seed == options.seed);
    });
    // What is written reads back.
    vggtcd::write_json_file(path, json);
    require(vggtcd::read_json_file(path).size() == json.size());
  });
  directory.write("input.json", vggtcd::fuzz::FuzzInput(data, size).rest());
  read_or_refuse([&] {
    const vggtcd::Sim3 similarity = vggtcd::read_sim3(path);
    require(similarity.scale > 0 && similarity.translation.allFinite());
    const Eigen::Matrix3d product = similarity.rotation * similarity.rotation.transpose();
    require((product - Eigen::Matrix3d::Identity()).norm() < 1e-9);
  });
  try {
    const auto index = vggtcd::read_shard_index(path);
    if (index) {
      require(!index->files.empty());
      for (const std::string& file : index->files) {
        require(!file.empty() && file.find('/') == std::string::npos && file != "..");
      }
      for (const auto& [tensor, file] : index->tensors) require(file < index->files.size());
    }
  } catch (const vggtcd::Error& error) {
    require(error.code() == vggtcd::ErrorCode::kWeights ||
            error.code() == vggtcd::ErrorCode::kInput);
    vggtcd::fuzz::check_sentence(error);
  }
  return 0;
}
