// SPDX-License-Identifier: Apache-2.0
// The list of methods.
#include "vggtcd/evaluation/registration_methods.h"

#include "vggtcd/evaluation/baselines/rivals.h"
#include "vggtcd/registration/candidates.h"
#include "vggtcd/registration/fine.h"
#include "vggtcd/registration/plausibility.h"

namespace vggtcd {
namespace {

Sim3 align_coarse_only(const RegistrationProblem& problem) {
  return align_coarse(problem.before, problem.after, problem.joint, {}).t2_from_t1;
}

RegistrationAnswer align_as_paper(const RegistrationProblem& problem) {
  CoarseResult coarse = align_coarse(problem.before, problem.after, problem.joint, {});
  const FineResult fine = align_fine(problem.before, problem.after, coarse.t2_from_t1, {});
  RegistrationAnswer answer = fine.t2_from_t1;
  answer.verdict = enum_to_string(fine.verdict);
  answer.coarse = std::move(coarse);
  return answer;
}

RegistrationAnswer align_robustly(const RegistrationProblem& problem) {
  CoarseResult coarse = align_coarse(problem.before, problem.after, problem.joint, {});
  const FineResult fine = align_fine(problem.before, problem.after, coarse.t2_from_t1, {});
  const RobustStart start =
      start_from_joint(problem.before, problem.after, problem.joint, coarse, {}, {});
  const AlignmentChoice choice = choose_alignment(problem.before, problem.after, start, fine, {});
  RegistrationAnswer answer;
  answer.t2_from_t1 = choice.t2_from_t1;
  answer.surface_t2_from_t1 = choice.surface_t2_from_t1;
  answer.verdict = choice.verdict;
  answer.coarse = std::move(coarse);
  answer.doubts = choice.robust.doubts();
  return answer;
}

RegistrationMethod rival(const std::string& name, std::string title) {
  RegistrationMethod method{name, std::move(title), true, {}, ""};
  if (rivals_available()) {
    method.run = [name](const RegistrationProblem& p) { return align_by_rival(name, p); };
  } else {
    method.absent_because = "this build has no Open3D plugin (libopen3d-dev)";
  }
  return method;
}

}  // namespace

std::string plausibility_of(const RegistrationAnswer& answer, const RegistrationProblem& problem) {
  if (!answer.coarse) return "";
  const SurfaceAgreement surfaces =
      surface_agreement(problem.before, problem.after, answer.surface_t2_from_t1);
  return std::string(
      enum_to_string(judge_plausibility(surfaces, answer.coarse, answer.doubts).verdict));
}

std::vector<RegistrationMethod> registration_methods() {
  std::vector<RegistrationMethod> methods;
  methods.push_back({"vggt_only", "VGGT only (identity)", false,
                     [](const RegistrationProblem&) { return RegistrationAnswer(); }, ""});
  methods.push_back(rival("fgr", "FGR"));
  methods.push_back(rival("ransac_icp", "RANSAC+ICP"));
  methods.push_back(rival("scale_icp", "Scale+ICP"));
  methods.push_back({"geotransformer", "GeoTransformer", true, {}, "not yet"});
  methods.push_back({"coarse", "coarse only", false, align_coarse_only, ""});
  methods.push_back({"paper", "VGGT-CD (paper)", false, align_as_paper, ""});
  methods.push_back({"robust", "VGGT-CD robust", false, align_robustly, ""});
  return methods;
}

}  // namespace vggtcd
