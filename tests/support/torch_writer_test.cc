// SPDX-License-Identifier: Apache-2.0
#include "tests/support/torch_writer.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include "tests/support/weight_recipe.h"

namespace vggtcd::testing {
namespace {

// Size and CRC-32 of model/data.pkl in the file that torch.save (PyTorch 1.13) wrote for the tiny
// network in float16.
TEST(TorchWriter, PickleOfTheTinyNetworkHasTheBytesThatPyTorchWrites) {
  const RecipeWeights weights(NetworkSizes::tiny(), 1);
  std::vector<TensorView> tensors = weights.tensors();
  for (TensorView& tensor : tensors) tensor.dtype = DType::kF16;
  const std::string pickle = state_dict_pickle(tensors);
  EXPECT_EQ(pickle.size(), 46627u);
  EXPECT_EQ(crc32_z(0, reinterpret_cast<const Bytef*>(pickle.data()), pickle.size()), 0x2d201502u);
}

}  // namespace
}  // namespace vggtcd::testing
