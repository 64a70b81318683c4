// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/nn/weights.h"

#include <gmock/gmock.h>

#include <array>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::array<float, 6> kValues{0, 1, 2, 3, 4, 5};

TensorView tensor(std::string name, std::vector<int64_t> shape, DType dtype = DType::kF32) {
  TensorView view{std::move(name), dtype, std::move(shape), {}};
  view.data = std::as_bytes(std::span(kValues))
                  .first(static_cast<size_t>(view.numel()) * dtype_size(dtype));
  return view;
}

std::string message_of(const std::function<void()>& action, ErrorCode code) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code);
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

TEST(WeightStore, GivesATensorByScopeAndShape) {
  const WeightStore store({tensor("head.trunk.0.weight", {2, 3})}, "a.safetensors");
  const WeightScope scope = store.root().at("head").at("trunk.0");
  EXPECT_THAT(scope.take_f32("weight", {2, 3}), ElementsAre(0, 1, 2, 3, 4, 5));
}

TEST(WeightStore, NamesTheFileAndTheMissingTensor) {
  const WeightStore store({tensor("head.bias", {2})}, "a.safetensors");
  EXPECT_THAT(
      message_of(
          [&] {
            store.root().at("head").take("weight", {2, 3});
          },
          ErrorCode::kWeights),
      AllOf(HasSubstr("a.safetensors"), HasSubstr("head.weight [2, 3]"), HasSubstr("none")));
}

TEST(WeightStore, RefusesAnotherShapeEvenOfTheSameSize) {
  const WeightStore store({tensor("weight", {2, 3})}, "a.safetensors");
  EXPECT_THAT(
      message_of(
          [&] {
            store.root().take("weight", {3, 2});
          },
          ErrorCode::kWeights),
      AllOf(HasSubstr("expected tensor weight of shape [3, 2]"), HasSubstr("found [2, 3]")));
  EXPECT_THAT(message_of(
                  [&] {
                    store.root().take("weight", {2, 3, 1});
                  },
                  ErrorCode::kWeights),
              HasSubstr("[2, 3, 1]"));
}

TEST(WeightStore, RefusesIntegers) {
  const WeightStore store({tensor("weight", {6}, DType::kI8)}, "a.safetensors");
  EXPECT_THAT(message_of([&] { store.root().take("weight", {6}); }, ErrorCode::kWeights),
              HasSubstr("i8"));
}

TEST(WeightStore, RefusesTheSameNameTwice) {
  EXPECT_THAT(message_of(
                  [] {
                    WeightStore({tensor("w", {1}), tensor("w", {1})}, "a");
                  },
                  ErrorCode::kWeights),
              HasSubstr("twice"));
}

TEST(WeightStore, TakingATensorTwiceIsOurMistake) {
  const WeightStore store({tensor("w", {6})}, "a");
  store.root().take("w", {6});
  EXPECT_THAT(message_of([&] { store.root().take("w", {6}); }, ErrorCode::kInternal),
              HasSubstr("taken twice"));
}

TEST(WeightStore, ListsWhatNobodyTookButForThePrefixesGiven) {
  const WeightStore store(
      {tensor("a.w", {1}), tensor("b.w", {1}), tensor("c.w", {1}), tensor("a.v", {1})}, "file");
  store.root().at("a").take("w", {1});
  const std::array<std::string_view, 1> foreign{"b."};
  EXPECT_THAT(store.untaken(foreign), ElementsAre("c.w", "a.v"));
}

TEST(WeightScope, CountsLayersUpToTheLastOfWhichThereIsAnything) {
  const WeightStore store(
      {tensor("head.blocks.0.n", {1}), tensor("head.blocks.3.m.n", {1}),
       tensor("head.blocks.x.n", {1}), tensor("head.blocks.9", {1}), tensor("blocks.20.n", {1})},
      "file");
  EXPECT_EQ(store.root().at("head").count("blocks"), 4);
  EXPECT_EQ(store.root().at("head").count("trunk"), 0);
}

}  // namespace
}  // namespace vggtcd
