// SPDX-License-Identifier: Apache-2.0
// Loading the plugin, and points in and out.
#include "vggtcd/evaluation/baselines/rivals.h"

#include <dlfcn.h>

#include <filesystem>

#include "vggtcd/core/error.h"
#include "vggtcd/evaluation/baselines/open3d_plugin.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/scene/confidence.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

// Beside the program, where the build and the installation both put it.
std::filesystem::path plugin_path() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  return program.parent_path() / VGGTCD_PLUGIN_DIR / "vggtcd_open3d_rivals.so";
}

VggtcdAlignRival* load_plugin() {
  static VggtcdAlignRival* const loaded = [] {
    const std::string path = plugin_path().string();
    void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    void* symbol = library != nullptr ? dlsym(library, "vggtcd_align_rival") : nullptr;
    if (symbol == nullptr) {
      throw_error(ErrorCode::kUnavailable, "{}: cannot be loaded ({}); is libopen3d installed?",
                  path, dlerror());
    }
    return reinterpret_cast<VggtcdAlignRival*>(symbol);
  }();
  return loaded;
}

struct Points {
  std::vector<double> positions, colors;

  explicit Points(const Reconstruction& reconstruction) {
    const PointCloud cloud = unproject(reconstruction, confidence_threshold(reconstruction));
    for (size_t k = 0; k < cloud.size(); ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        positions.push_back(static_cast<double>(cloud.positions[k][axis]));
        colors.push_back(
            reconstruction.color[3 * size_t{cloud.pixels[k]} + static_cast<size_t>(axis)] / 255.0);
      }
    }
  }
  VggtcdRivalCloud view() const {
    return {positions.data(), colors.data(), static_cast<int64_t>(positions.size() / 3)};
  }
};

}  // namespace

bool rivals_available() { return exists_at(plugin_path()); }

void load_rivals() { load_plugin(); }

Sim3 align_by_rival(const std::string& rival, const RegistrationProblem& problem) {
  const Points source(problem.before), target(problem.after);
  const VggtcdRivalCloud source_view = source.view(), target_view = target.view();
  VggtcdRivalAnswer answer{};
  if (load_plugin()(rival.c_str(), &source_view, &target_view, &answer) != 0) {
    throw_error(ErrorCode::kDegenerate, "{}: no answer ({})", rival, answer.message);
  }
  return {answer.scale,
          Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(answer.rotation),
          Eigen::Map<const Eigen::Vector3d>(answer.translation)};
}

}  // namespace vggtcd
