// SPDX-License-Identifier: Apache-2.0
// Rivals take minutes and do not change: their answers about the same points are kept.
#pragma once

#include <filesystem>
#include <string>

#include "vggtcd/evaluation/registration_methods.h"

namespace vggtcd {

struct MethodAnswer {
  std::string failure;  // why there is none; empty: there is
  RegistrationAnswer found;
  double seconds = 0;  // when it was computed
};

// A hash (FNV-1a) of everything that a method is told but the joint pass, which rivals do not use.
uint64_t hash_of_epochs(const RegistrationProblem& problem);

// Runs the method, or takes what directory/METHOD_HASH.json has. An empty directory keeps nothing.
// Throws what the method throws but Error{kDegenerate}, which is an answer.
MethodAnswer run_or_recall(const RegistrationMethod& method, const RegistrationProblem& problem,
                           uint64_t hash, const std::filesystem::path& directory);

}  // namespace vggtcd
