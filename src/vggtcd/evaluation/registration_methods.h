// SPDX-License-Identifier: Apache-2.0
// The methods that the benchmark compares, behind one signature.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "vggtcd/geometry/sim3.h"
#include "vggtcd/registration/coarse.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct RegistrationProblem {
  const Reconstruction& before;
  const Reconstruction& after;
  const JointReconstruction& joint;
};

// What a method says. Both similarities are T2 from T1; they differ for the robust method alone
// (registration/robust.h).
struct RegistrationAnswer {
  Sim3 t2_from_t1, surface_t2_from_t1;
  // Of the methods that `detect` has: the verdict of the method about itself, machine-readable, and
  // what whether the alignment can be believed depends on (registration/plausibility.h).
  std::string verdict{};
  std::optional<CoarseResult> coarse{};
  std::vector<std::string> doubts{};

  RegistrationAnswer() = default;
  RegistrationAnswer(const Sim3& of_both) : t2_from_t1(of_both), surface_t2_from_t1(of_both) {}
};

struct RegistrationMethod {
  std::string name;   // in JSON and CSV: "ransac_icp"
  std::string title;  // in tables: "RANSAC+ICP"
  bool rival = false;
  // T2 from T1. Throws Error{kDegenerate} if the method finds no answer. Absent: not available in
  // this build; the row says so.
  std::function<RegistrationAnswer(const RegistrationProblem&)> run;
  std::string absent_because;
};

// Whether `detect` would believe the alignment, machine-readable; empty for methods that it has
// not. Apart from `run`, for it is no part of the registration that is timed.
std::string plausibility_of(const RegistrationAnswer& answer, const RegistrationProblem& problem);

// In the order of the paper's tables: identity, the rivals, coarse only, the paper's method, and
// what came later.
std::vector<RegistrationMethod> registration_methods();

}  // namespace vggtcd
