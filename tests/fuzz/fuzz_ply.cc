// SPDX-License-Identifier: Apache-2.0
// Fuzz target: any bytes as a PLY point cloud, read block by block and as a whole.
#include "tests/fuzz/fuzz_files.h"
#include "vggtcd/io/ply.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using vggtcd::fuzz::require;
  static const vggtcd::fuzz::FuzzDirectory directory;
  const std::filesystem::path path =
      directory.write("cloud.ply", vggtcd::fuzz::FuzzInput(data, size).rest());
  try {
    const vggtcd::PlyReader reader(path);
    size_t points = 0;
    reader.read(reader.fields(), [&](const vggtcd::PlyCloud& block) {
      points += block.positions.size();
      require(block.rgb.empty() || block.rgb.size() == 3 * block.positions.size());
      for (const auto& field : block.fields) require(field.values.size() == block.positions.size());
    });
    require(points == reader.size());
    const vggtcd::PlyCloud cloud = vggtcd::read_ply(path);
    require(cloud.positions.size() == points && cloud.fields.size() == reader.fields().size());
  } catch (const vggtcd::Error& error) {
    vggtcd::fuzz::check_refusal(error);
  }
  return 0;
}
