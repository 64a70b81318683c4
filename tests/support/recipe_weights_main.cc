// SPDX-License-Identifier: Apache-2.0
// recipe-weights: writes recipe weights as a safetensors file, for tests of the program and for
// benchmarks that start from a file.
#include <cstdio>
#include <cstring>
#include <string>

#include "tests/support/weight_recipe.h"
#include "vggtcd/core/error.h"

int main(int argc, char** argv) {
  using namespace vggtcd;
  const std::string network = argc > 1 ? argv[1] : "";
  if (argc != 4 || (network != "tiny" && network != "vggt_1b")) {
    std::fprintf(stderr, "usage: recipe-weights tiny|vggt_1b SEED OUT.safetensors\n");
    return 2;
  }
  try {
    using testing::NetworkSizes;
    const NetworkSizes sizes = network == "tiny" ? NetworkSizes::tiny() : NetworkSizes::vggt_1b();
    testing::write_recipe_weights(sizes, std::stoull(argv[2]), argv[3]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "recipe-weights: %s\n", error.what());
    return 1;
  }
  return 0;
}
