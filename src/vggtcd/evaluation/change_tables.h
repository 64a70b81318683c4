// SPDX-License-Identifier: Apache-2.0
// The benchmark's tables of change and of instances.
#pragma once

#include <string>
#include <vector>

#include "vggtcd/evaluation/benchmark.h"

namespace vggtcd {

// "driveway #3"
std::string scene_title(const SceneOutcome& scene);

// Markdown sections; empty without outcomes.
std::string change_section(const std::vector<SceneOutcome>& scenes);
std::string instance_section(const std::vector<SceneOutcome>& scenes);

std::string change_csv(const std::vector<SceneOutcome>& scenes);
std::string instance_csv(const std::vector<SceneOutcome>& scenes);

}  // namespace vggtcd
