// SPDX-License-Identifier: Apache-2.0
// The whole job as numbered stages: two reconstructed epochs in, an aligned 3D change map out.
#pragma once

#include <filesystem>
#include <optional>

#include "vggtcd/change/free_space.h"
#include "vggtcd/change/instances.h"
#include "vggtcd/change/nearest_distance.h"
#include "vggtcd/io/output_directory.h"
#include "vggtcd/pipeline/alignment.h"
#include "vggtcd/pipeline/metres.h"
#include "vggtcd/report/report_page.h"

namespace vggtcd {

// What detect() keeps in OUT for the next run: the stages of photo_stages.h.
inline constexpr const char* kStages = ".stages";

// Which files, and how the epochs are first brought together: exactly one of the last three.
struct EpochInputs {
  std::filesystem::path before;  // prediction files, docs/formats.md
  std::filesystem::path after;
  std::optional<std::filesystem::path> joint;         // the joint pass over keyframes of both
  std::optional<std::filesystem::path> initial_sim3;  // a sim3.json: t2_from_t1
  bool aligned = false;                               // both epochs are in one frame already
  MetricInputs metric;                                // what is known in metres
  std::string before_name, after_name;                // what the user named, if not these files
  std::string origin;  // a sentence for the summary: how the files were made, if we made them
  bool own_joint_pass = true;  // joint is an estimate of its own, not a part of one common model
  bool has_holes = false;      // depth is missing where it was hard to find: a hole says nothing
};

enum class ChangeMethod {
  kAuto,       // distance with methods paper and coarse unless depth has holes, else votes
  kDistance,   // the paper's nearest-neighbour distance
  kFreeSpace,  // votes of the photos that should see a point
};
std::span<const EnumName<ChangeMethod>> enum_names(ChangeMethod);

struct DetectOptions {
  AlignmentOptions alignment;
  ChangeMethod change_method = ChangeMethod::kAuto;
  ChangeOptions change;
  FreeSpaceOptions free_space;
  InstanceOptions instances;
  std::string explain;  // X,Y,PHOTO (explanation.h); empty: nothing to explain
  bool overlays = true;
  bool page = true;
  ReportOptions report;

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("alignment", self.alignment, "");
    field("change_method", self.change_method,
          "distance: changed is what is far from the other epoch's points, the paper's rule. "
          "free_space: "
          "changed is what the photos of the other epoch look through; what none of them sees is "
          "unobserved. "
          "auto: distance with --method paper and coarse, else, and for photos without a network, "
          "free_space.");
    field("change", self.change, "");
    field("free_space", self.free_space, "");
    field("instances", self.instances, "");
    field("explain", self.explain,
          "Tell which photos voted how for one pixel: X,Y,before/PHOTO or X,Y,after/PHOTO.");
    field("overlays", self.overlays, "Write overlays/: each photo beside its changes.");
    field("page", self.page, "Write report.html: everything in one page.");
    field("report", self.report, "");
  };
  void validate() const;
};

// What detect() writes with these options.
OutputContents detect_contents(const DetectOptions& options);

// Whether detect() lets the votes decide, for depth with or without holes.
bool decides_by_votes(const DetectOptions& options, bool has_holes);

// Aligns, finds the changes and writes everything that docs/formats.md lists under "Results of
// detect" into `out`, which appears when it is complete. Returns the alignment verdict's sentence
// and the changed shares for the terminal.
struct DetectOutcome {
  Alignment alignment;
  int64_t points_t1 = 0, changed_t1 = 0;
  int64_t points_t2 = 0, changed_t2 = 0;
  int64_t unobserved_t1 = 0, unobserved_t2 = 0;  // of the points; known with free-space votes only
  int64_t removed = 0, added = 0, moved = 0;     // things
  std::optional<PixelExplanation> explanation;   // of the pixel that options.explain names
  std::optional<Metric> metric;                  // if inputs.metric was given
};
DetectOutcome detect(const EpochInputs& inputs, const DetectOptions& options,
                     const std::filesystem::path& out, ProgressSink& progress);

struct RegisterOutcome {
  Alignment alignment;
  std::optional<Metric> metric;
};
// Alignment only: writes sim3.json and summary.json, and with authors_layout the files that the
// authors' evaluator reads.
RegisterOutcome register_epochs(const EpochInputs& inputs, const AlignmentOptions& options,
                                bool authors_layout, const std::filesystem::path& out,
                                ProgressSink& progress);

}  // namespace vggtcd
