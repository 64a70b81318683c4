// SPDX-License-Identifier: Apache-2.0
// AnswerStore: what the votes say about every pixel, on disk between judging and writing.
#pragma once

#include <filesystem>

#include "vggtcd/change/free_space.h"
#include "vggtcd/io/scratch_array.h"

namespace vggtcd {

// The arrays [S, H, W] of one epoch that PhotoAnswers explains; labels are elsewhere.
struct StoredAnswers {
  ScratchArray<float> gap, evidence, confidence, level_of_detection;

  explicit StoredAnswers(const std::filesystem::path& directory)
      : gap(directory), evidence(directory), confidence(directory), level_of_detection(directory) {}

  // From several threads at a time.
  void add(int frame, const PhotoAnswers& answers) {
    const size_t first = static_cast<size_t>(frame) * answers.label.size();
    gap.write(first, answers.gap);
    evidence.write(first, answers.evidence);
    confidence.write(first, answers.confidence);
    level_of_detection.write(first, answers.level_of_detection);
  }
};

struct AnswerStore {
  StoredAnswers t1, t2;

  explicit AnswerStore(const std::filesystem::path& directory) : t1(directory), t2(directory) {}
  PhotoAnswersSink sink() {
    return {[this](int frame, const PhotoAnswers& answers) { t1.add(frame, answers); },
            [this](int frame, const PhotoAnswers& answers) { t2.add(frame, answers); }};
  }
};

}  // namespace vggtcd
