// SPDX-License-Identifier: Apache-2.0
// Outcomes of the benchmark as JSON: what is kept of a finished scene, and benchmark.json.
#pragma once

#include "vggtcd/evaluation/benchmark.h"
#include "vggtcd/io/json_file.h"

namespace vggtcd {

Json to_json(const SceneOutcome& outcome);
// Throws Error{kInput} or nlohmann::json::exception if it is not what to_json writes.
SceneOutcome scene_outcome_from_json(const Json& json);

}  // namespace vggtcd
