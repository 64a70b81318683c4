// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/torch_checkpoint.h"

#include <gmock/gmock.h>

#include <bit>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/torch_writer.h"
#include "tests/support/weight_recipe.h"
#include "vggtcd/core/error.h"
#include "vggtcd/io/torch_pickle.h"

namespace vggtcd {
namespace {

using ::testing::HasSubstr;

const std::string kGolden = VGGTCD_SOURCE_DIR "/tests/golden/torch_checkpoint/";

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::span<const std::byte> as_bytes(const std::string& text) {
  return std::as_bytes(std::span(text));
}

double element(const TensorView& tensor, size_t i) {
  const std::byte* at = tensor.data.data() + i * dtype_size(tensor.dtype);
  const auto load = [&]<typename T>(T value) {
    std::memcpy(&value, at, sizeof(T));
    return value;
  };
  switch (tensor.dtype) {
    case DType::kF64:
      return load(double{});
    case DType::kF32:
      return load(float{});
    case DType::kF16:
      return float_from_half(load(uint16_t{}));
    case DType::kBF16:
      return float_from_bfloat16(load(uint16_t{}));
    case DType::kI64:
      return static_cast<double>(load(int64_t{}));
    case DType::kI32:
      return load(int32_t{});
    case DType::kI16:
      return load(int16_t{});
    case DType::kI8:
      return load(int8_t{});
    case DType::kU8:
    case DType::kBool:
      return load(uint8_t{});
  }
  return 0;
}

std::string torch_name(DType dtype) {
  const std::map<DType, std::string> names = {{DType::kF64, "float64"}, {DType::kF32, "float32"},
                                              {DType::kF16, "float16"}, {DType::kBF16, "bfloat16"},
                                              {DType::kI64, "int64"},   {DType::kI32, "int32"},
                                              {DType::kI16, "int16"},   {DType::kI8, "int8"},
                                              {DType::kU8, "uint8"},    {DType::kBool, "bool"}};
  return names.at(dtype);
}

void expect_tensors(const WeightFile& file, const nlohmann::json& expected) {
  ASSERT_EQ(file.tensors.size(), expected.size());
  for (size_t t = 0; t < expected.size(); ++t) {
    const TensorView& tensor = file.tensors[t];
    EXPECT_EQ(tensor.name, expected[t]["name"]);
    EXPECT_EQ(torch_name(tensor.dtype), expected[t]["dtype"]);
    EXPECT_EQ(tensor.shape, expected[t]["shape"].get<std::vector<int64_t>>());
    const nlohmann::json& values = expected[t]["values"];
    ASSERT_EQ(static_cast<size_t>(tensor.numel()), values.size()) << tensor.name;
    ASSERT_EQ(tensor.data.size(), values.size() * dtype_size(tensor.dtype)) << tensor.name;
    for (size_t i = 0; i < values.size(); ++i) {
      const double value = values[i].is_boolean() ? values[i].get<bool>() : values[i].get<double>();
      EXPECT_EQ(element(tensor, i), value) << tensor.name << " element " << i;
    }
  }
}

nlohmann::json expected_values(const char* key) {
  return nlohmann::json::parse(read_file(kGolden + "pt_expected.json"))[key];
}

TEST(TorchCheckpoint, ReadsEveryTypeStrideAndSharedStorageThatPyTorchWrote) {
  const WeightFile file = open_weight_file(kGolden + "pt_features.pt");
  EXPECT_EQ(file.format, WeightFormat::kTorchZip);
  expect_tensors(file, expected_values("pt_features.pt"));
}

TEST(TorchCheckpoint, ReadsTheLegacyContainerThatPyTorchWrote) {
  const WeightFile file = open_weight_file(kGolden + "pt_features_legacy.pt");
  EXPECT_EQ(file.format, WeightFormat::kTorchLegacy);
  expect_tensors(file, expected_values("pt_features.pt"));
}

TEST(TorchCheckpoint, FindsTheStateDictUnderTheKeyModel) {
  expect_tensors(open_weight_file(kGolden + "pt_nested.pt"),
                 expected_values("pt_nested.pt")["model"]);
}

TEST(TorchCheckpoint, AlignedTensorsAreViewsOfTheFile) {
  const std::string bytes = read_file(kGolden + "pt_features.pt");
  const WeightFile file = parse_weight_file(as_bytes(bytes), "x");
  const auto inside = [&](const char* name) {
    const auto* at = reinterpret_cast<const char*>(file.find(name)->data.data());
    return at >= bytes.data() && at < bytes.data() + bytes.size();
  };
  EXPECT_TRUE(inside("f32"));
  EXPECT_TRUE(inside("shared_row2"));
  EXPECT_FALSE(inside("shared_transposed"));
}

TEST(TorchCheckpoint, ReadsTheTinyNetworkInHalfPrecision) {
  constexpr std::array<std::string_view, 1> kModules = {"camera_head"};
  const testing::RecipeWeights weights(testing::NetworkSizes::tiny(), 1, kModules);
  std::vector<std::vector<uint16_t>> halves;
  std::vector<TensorView> tensors = weights.tensors();
  for (TensorView& tensor : tensors) {
    std::vector<uint16_t>& half = halves.emplace_back();
    for (size_t i = 0; i < static_cast<size_t>(tensor.numel()); ++i) {
      half.push_back(half_from_float(static_cast<float>(element(tensor, i))));
    }
    tensor.dtype = DType::kF16;
    tensor.data = std::as_bytes(std::span(half));
  }
  const std::string bytes = testing::torch_zip_file("model", tensors);
  const WeightFile file = parse_weight_file(as_bytes(bytes), "model.pt");
  ASSERT_EQ(file.tensors.size(), tensors.size());
  for (size_t t = 0; t < tensors.size(); ++t) {
    EXPECT_EQ(file.tensors[t].name, tensors[t].name);
    EXPECT_EQ(file.tensors[t].shape, tensors[t].shape);
    EXPECT_TRUE(std::ranges::equal(file.tensors[t].data, tensors[t].data)) << tensors[t].name;
  }
}

// --- bad input ---

std::string error_of(const std::string& bytes) {
  try {
    parse_torch_checkpoint(as_bytes(bytes), "x.pt");
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kWeights);
    const std::string what = error.what();
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    EXPECT_TRUE(what.starts_with("x.pt: ")) << what;
    return what;
  }
  return "";
}

std::string error_of_pickle(const std::string& pickle) {
  const std::vector<std::pair<std::string, std::string>> members = {
      {"x/data.pkl", pickle}, {"x/data/0", std::string(16, '\0')}};
  return error_of(testing::stored_zip(members));
}

// A state dict {"w": tensor} in storage "0" of `numel` floats; sizes and strides are opcodes.
std::string pickle_of_tensor(const std::string& offset, const std::string& sizes,
                             const std::string& strides, char numel = 4) {
  using std::string_literals::operator""s;
  return "\x80\x02}X\x01\0\0\0w"s + "ctorch._utils\n_rebuild_tensor_v2\n(" +
         "(X\x07\0\0\0storagectorch\nFloatStorage\nX\x01\0\0\0"s + "0X\x03\0\0\0cpuK"s + numel +
         "tQ" + offset + sizes + strides + "\x89}tRs.";
}

TEST(TorchCheckpoint, AcceptsAHandWrittenTensor) {
  EXPECT_EQ(error_of_pickle(pickle_of_tensor({"K\0", 2}, "K\x02K\x02\x86", "K\x02K\x01\x86")), "");
}

TEST(TorchCheckpoint, RefusesGlobalsWithoutExecutingThem) {
  const std::string message = error_of_pickle(
      "\x80\x02"
      "cos\nsystem\nX\x04\0\0\0true\x85R.");
  EXPECT_THAT(message, HasSubstr("\"os system\""));
  EXPECT_THAT(error_of_pickle("\x80\x04\x8c\x08"
                              "builtins\x8c\x04"
                              "eval\x93."),
              HasSubstr("\"builtins eval\""));
}

TEST(TorchCheckpoint, RefusesUnknownOpcodesByName) {
  EXPECT_THAT(error_of_pickle("\x80\x02\xff."), HasSubstr("opcode 0xff"));
  EXPECT_THAT(error_of_pickle("\x80\x02ios\nsystem\n."), HasSubstr("opcode 0x69"));  // INST
  EXPECT_THAT(error_of_pickle("\x80\x02)\x81."), HasSubstr("opcode 0x81"));          // NEWOBJ
  EXPECT_THAT(error_of_pickle("\x80\x01."), HasSubstr("protocol"));
}

TEST(TorchCheckpoint, RefusesPicklesWithABrokenStack) {
  for (const std::string pickle :
       {"\x80\x02.", "\x80\x02R.", "\x80\x02t.", "\x80\x02(.", "\x80\x02}a.", "\x80\x02}Ns.",
        "\x80\x02}(Nu.", "\x80\x02h\x05.", "\x80\x02NN.", "\x80\x02NQ.", "\x80\x02(q\x01.",
        "\x80\x02N", "\x80\x02X\xff\xff\xff\xff.", "\x80\x02]Nb.",
        "\x80\x02"
        "cos"}) {
    EXPECT_NE(error_of_pickle(pickle), "") << ::testing::PrintToString(pickle);
  }
}

TEST(TorchCheckpoint, RefusesTensorsBeyondTheirStorage) {
  const std::string zero("K\0", 2);
  EXPECT_THAT(error_of_pickle(pickle_of_tensor("K\x01", "K\x04\x85", "K\x01\x85")),
              HasSubstr("beyond its storage"));
  EXPECT_THAT(error_of_pickle(pickle_of_tensor(zero, "K\x02\x85", "K\x04\x85")),
              HasSubstr("beyond its storage"));
  EXPECT_THAT(error_of_pickle(pickle_of_tensor("J\xff\xff\xff\xff", "K\x01\x85", "K\x01\x85")),
              HasSubstr("beyond its storage"));
  EXPECT_THAT(error_of_pickle(pickle_of_tensor(zero, "J\xff\xff\xff\xff\x85", "K\x01\x85")),
              HasSubstr("whole number"));
  const std::string huge = "\x8a\x08\xff\xff\xff\xff\xff\xff\xff\x7f";
  EXPECT_THAT(error_of_pickle(pickle_of_tensor(zero, huge + huge + "\x86", zero + zero + "\x86")),
              HasSubstr("beyond its storage"));
  EXPECT_THAT(error_of_pickle(pickle_of_tensor(zero, "M\xff\xff\x85", zero + "\x85")),
              HasSubstr("repeats elements"));
  EXPECT_THAT(error_of_pickle(pickle_of_tensor(zero, "K\x04\x85", ")")), HasSubstr("0 strides"));
  EXPECT_THAT(error_of_pickle(pickle_of_tensor(zero, "K\x05\x85", "K\x01\x85", 5)),
              HasSubstr("should have 20 bytes, found 16"));
}

TEST(TorchCheckpoint, AnyStrideMayStandBesideASizeOfOne) {
  const std::string huge = "\x8a\x08\xff\xff\xff\xff\xff\xff\xff\x7f";
  EXPECT_EQ(error_of_pickle(pickle_of_tensor({"K\0", 2}, "K\x01K\x04\x86", huge + "K\x01\x86")),
            "");
}

TEST(TorchCheckpoint, RefusesWhatIsNoStateDict) {
  EXPECT_THAT(error_of_pickle("\x80\x02K\x05."), HasSubstr("a pickled int"));
  EXPECT_THAT(error_of_pickle("\x80\x02}."), HasSubstr("found 0"));
  const std::vector<std::pair<std::string, std::string>> script = {{"x/data.pkl", "\x80\x02}."},
                                                                   {"x/constants.pkl", ""}};
  EXPECT_THAT(error_of(testing::stored_zip(script)), HasSubstr("TorchScript"));
  const std::vector<std::pair<std::string, std::string>> other = {{"word/document.xml", "<>"}};
  EXPECT_THAT(error_of(testing::stored_zip(other)), HasSubstr("zip without data.pkl"));
}

TEST(TorchCheckpoint, TruncatedFilesAreRefusedAtEveryLength) {
  for (const char* name : {"pt_features.pt", "pt_features_legacy.pt", "pt_nested.pt"}) {
    const std::string whole = read_file(kGolden + name);
    ASSERT_EQ(error_of(whole), "");
    for (size_t size = 4; size < whole.size(); ++size) {
      EXPECT_NE(error_of(whole.substr(0, size)), "") << name << " cut to " << size;
    }
  }
}

TEST(TorchCheckpoint, RefusesCompressedAndEncryptedMembers) {
  const std::string whole = read_file(kGolden + "pt_nested.pt");
  const size_t central = whole.find("PK\x01\x02");
  std::string deflated = whole;
  deflated[central + 10] = 8;
  EXPECT_THAT(error_of(deflated), HasSubstr("is compressed"));
  std::string encrypted = whole;
  encrypted[central + 8] |= 1;
  EXPECT_THAT(error_of(encrypted), HasSubstr("is encrypted"));
}

TEST(TorchPickle, ReadsScalarsAndContainers) {
  using std::string_literals::operator""s;
  const std::string bytes =
      "\x80\x04\x95\x10\0\0\0\0\0\0\0(K\x07J\xfe\xff\xff\xff\x8a\x03\0\0\x80\x8a\0G\x3f\xf8\0\0"
      "\0\0\0\0\x88N\x8c\x02hi\x94h\0]q\x05(K\x01K\x02"
      "eK\x03"
      "at."s;
  const Pickle pickle = read_torch_pickle(as_bytes(bytes), "x");
  EXPECT_EQ(pickle.size, bytes.size());
  const auto& items = pickle.root->items;
  ASSERT_EQ(items.size(), 10u);
  EXPECT_EQ(items[0]->integer, 7);
  EXPECT_EQ(items[1]->integer, -2);
  EXPECT_EQ(items[2]->integer, -(int64_t{1} << 23));
  EXPECT_EQ(items[3]->integer, 0);
  EXPECT_EQ(items[4]->real, 1.5);
  EXPECT_EQ(items[5]->integer, 1);
  EXPECT_EQ(items[6]->kind, PickleValue::Kind::kNone);
  EXPECT_EQ(items[7]->text, "hi");
  EXPECT_EQ(items[8], items[7]);  // the remembered value, not a copy
  ASSERT_EQ(items[9]->items.size(), 3u);
  EXPECT_EQ(items[9]->items[2]->integer, 3);
}

TEST(TorchPickle, ValuesThatGrowWithoutEndAreRefused) {
  const std::string lists(1'000'001, ']');
  try {
    read_torch_pickle(as_bytes("\x80\x02" + lists + "."), "x");
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("more than 1000000 values"));
  }
}

}  // namespace
}  // namespace vggtcd
