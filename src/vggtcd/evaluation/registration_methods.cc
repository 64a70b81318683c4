// SPDX-License-Identifier: Apache-2.0
// The list of methods.
#include "vggtcd/evaluation/registration_methods.h"

#include "vggtcd/registration/coarse.h"
#include "vggtcd/registration/fine.h"
#ifdef VGGTCD_WITH_OPEN3D
#include "vggtcd/evaluation/baselines/open3d_rivals.h"
#endif

namespace vggtcd {
namespace {

Sim3 align_coarse_only(const RegistrationProblem& problem) {
  return align_coarse(problem.before, problem.after, problem.joint, {}).t2_from_t1;
}

Sim3 align_as_paper(const RegistrationProblem& problem) {
  return align_fine(problem.before, problem.after, align_coarse_only(problem), {}).t2_from_t1;
}

RegistrationMethod rival(std::string name, std::string title,
                         std::function<Sim3(const RegistrationProblem&)> run) {
  return {std::move(name), std::move(title), true, std::move(run),
          "this build has no Open3D (libopen3d-dev)"};
}

}  // namespace

std::vector<RegistrationMethod> registration_methods() {
  std::vector<RegistrationMethod> methods;
  methods.push_back({"vggt_only", "VGGT only (identity)", false,
                     [](const RegistrationProblem&) { return Sim3{}; }, ""});
#ifdef VGGTCD_WITH_OPEN3D
  methods.push_back(rival("fgr", "FGR", align_fgr));
  methods.push_back(rival("ransac_icp", "RANSAC+ICP", align_ransac_icp));
  methods.push_back(rival("scale_icp", "Scale+ICP", align_scale_icp));
#else
  methods.push_back(rival("fgr", "FGR", {}));
  methods.push_back(rival("ransac_icp", "RANSAC+ICP", {}));
  methods.push_back(rival("scale_icp", "Scale+ICP", {}));
#endif
  methods.push_back({"geotransformer", "GeoTransformer", true, {}, "not yet"});
  methods.push_back({"coarse", "coarse only", false, align_coarse_only, ""});
  methods.push_back({"paper", "VGGT-CD (paper)", false, align_as_paper, ""});
  return methods;
}

}  // namespace vggtcd
