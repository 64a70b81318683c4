// SPDX-License-Identifier: Apache-2.0
// A generated scene as files: photos, predictions, truth, and the folder layout of the WAT
// benchmark (docs/formats.md).
#pragma once

#include <filesystem>
#include <string>

#include "vggtcd/core/progress.h"
#include "vggtcd/evaluation/synthetic/predict.h"
#include "vggtcd/evaluation/synthetic/render.h"

namespace vggtcd {

struct SynthesizeOptions {
  std::string scene = "kitchen";
  uint64_t seed = 1;
  SceneChange change = SceneChange::kScene;
  SceneTexture texture = SceneTexture::kScene;
  int keyframes = 5;
  int jpeg_quality = 92;
  bool photos = true;
  bool wat = true;
  RenderOptions render;
  ErrorModel errors;

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("scene", self.scene, "which scene; --list names them");
    field("seed", self.seed, "varies shapes, places, textures, walks, light and errors");
    field("change", self.change,
          "scene: what changes is the scene's own list; none: nothing changes but light and walk");
    field("texture", self.texture,
          "scene: each surface its own; one: all surfaces the same; none: plain surfaces");
    field("keyframes", self.keyframes, "keyframes per epoch in the joint pass (the paper's K)");
    field("jpeg_quality", self.jpeg_quality, "1 to 100");
    field("photos", self.photos, "write before/ and after/");
    field("wat", self.wat, "write wat/SCENE in the layout of the WAT benchmark");
    field("render", self.render, "");
    field("errors", self.errors, "");
  };
  void validate() const;
};

// The Sim(3) that maps the T1 pass onto the T2 pass best, errors and all: each pass is fitted to
// the true points of its own pixels (unchanged, above the median confidence) by Umeyama, and the
// two fits are composed. What a registration can reach at best, to first order.
Sim3 best_t2_from_t1(const SceneTruth& truth, const Reconstruction& t1, const Reconstruction& t2);

// Writes the files. `directory` must be new, empty or earlier results, which are replaced as a
// whole when all is written (io/output_directory.h); Error{kOutput}.
void synthesize(const std::filesystem::path& directory, const SynthesizeOptions& options,
                ProgressSink& progress);

}  // namespace vggtcd
