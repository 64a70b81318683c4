// SPDX-License-Identifier: Apache-2.0
// The whole job as numbered stages: two reconstructed epochs in, an aligned 3D change map out.
#include "vggtcd/pipeline/detect.h"

#include "vggtcd/core/version.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/io/predictions.h"
#include "vggtcd/io/sim3_file.h"
#include "vggtcd/pipeline/change_list.h"
#include "vggtcd/pipeline/job_plan.h"
#include "vggtcd/pipeline/result_frame.h"
#include "vggtcd/pipeline/results.h"
#include "vggtcd/registration/shared_intrinsics.h"
#include "vggtcd/report/read_results.h"
#include "vggtcd/scene/local_frame.h"
#include "vggtcd/scene/sky.h"

namespace vggtcd {
namespace {

struct Epochs {
  Reconstruction before, after;
  std::optional<JointReconstruction> joint;
  InitialAlignment initial;
};

FrameOrigins origins_of(const Epochs& epochs) {
  const auto nowhere = Eigen::Vector3d(Eigen::Vector3d::Zero());
  return {epochs.before.origin_in_world, epochs.after.origin_in_world,
          epochs.joint ? epochs.joint->reconstruction.origin_in_world : nowhere};
}

// 1. Read.
Epochs read_epochs(const EpochInputs& inputs, const AlignmentOptions& options, StageLog& log) {
  Epochs epochs;
  log.run("read predictions", [&](ProgressStage& stage) {
    epochs.before = read_reconstruction(inputs.before, log.progress());
    stage.advance(0.4);
    epochs.after = read_reconstruction(inputs.after, log.progress());
    stage.advance(0.8);
    if (inputs.joint) {
      epochs.joint = read_joint(*inputs.joint, epochs.before, epochs.after, log.progress());
    }
    if (options.find_sky) {
      remove_sky(epochs.before);
      remove_sky(epochs.after);
      if (epochs.joint) remove_sky(epochs.joint->reconstruction);
    }
    if (options.shared_intrinsics) {
      share_intrinsics(epochs.before);
      share_intrinsics(epochs.after);
      if (epochs.joint) share_intrinsics(epochs.joint->reconstruction);
    }
  });
  if (epochs.joint) {
    epochs.initial = {&*epochs.joint,
                      {},
                      "joint pass",
                      inputs.origin.empty()
                          ? "is the joint file of these photos, T1's keyframes first, and are "
                            "keyframes_t1 and keyframes_t2 their frame numbers in that order?"
                          : "do both sets of photos show one place, and from places near enough to "
                            "see the same surfaces?",
                      inputs.own_joint_pass};
  } else if (inputs.initial_sim3) {
    epochs.initial = {nullptr, read_sim3(*inputs.initial_sim3),
                      inputs.initial_sim3->filename().string(),
                      "is it x_T2 = s R x_T1 + t of these two files, and not its inverse?"};
  } else {
    epochs.initial = {nullptr,
                      {},
                      "epochs already in one frame",
                      "--aligned expects two reconstructions in one frame and one scale; otherwise "
                      "give --joint or --initial-sim3"};
  }
  // What was given is between the files' worlds.
  epochs.initial.t2_from_t1 = between_local_frames(
      epochs.initial.t2_from_t1, epochs.before.origin_in_world, epochs.after.origin_in_world);
  return epochs;
}

Json inputs_json(const EpochInputs& inputs, const Epochs& epochs) {
  const auto epoch = [](const std::filesystem::path& path, const Reconstruction& r,
                        const std::string& name = "") {
    return Json{{"file", name.empty() ? path.filename().string() : name},
                {"frames", r.num_frames()},
                {"width", r.width},
                {"height", r.height},
                {"sky_share", sky_share(r)}};
  };
  Json json = {{"before", epoch(inputs.before, epochs.before, inputs.before_name)},
               {"after", epoch(inputs.after, epochs.after, inputs.after_name)}};
  if (epochs.joint) {
    json["joint"] = epoch(*inputs.joint, epochs.joint->reconstruction);
    json["joint"]["keyframes_t1"] = epochs.joint->keyframes_t1;
    json["joint"]["keyframes_t2"] = epochs.joint->keyframes_t2;
  }
  if (inputs.initial_sim3) json["initial_sim3"] = inputs.initial_sim3->filename().string();
  if (inputs.metric.reference) json["reference"] = inputs.metric.reference->filename().string();
  return json;
}

Json summary_head(const char* command, const EpochInputs& inputs, const Epochs& epochs) {
  return {{"program", "vggt-cd"},
          {"version", kVersion},
          {"command", command},
          {"inputs", inputs_json(inputs, epochs)}};
}

// Asked before the work starts, so that a question without an answer costs nothing.
std::optional<PixelQuestion> question_of(const EpochInputs& inputs, const DetectOptions& options,
                                         const Epochs& epochs) {
  if (options.explain.empty()) return {};
  if (!decides_by_votes(options, inputs.has_holes)) {
    throw_error(ErrorCode::kUsage,
                "explain: photos vote only where free space decides, and here the distance does; "
                "add --change-method free_space");
  }
  return parse_pixel_question(options.explain, epochs.before, epochs.after);
}

// Shows the progress of an inner stage as that of the outer one.
class FractionsOf : public ProgressSink {
 public:
  explicit FractionsOf(ProgressStage& outer) : outer_(outer) {}
  void stage_started(std::string_view) override {}
  void stage_advanced(std::string_view, double fraction) override { outer_.advance(fraction); }
  void stage_finished(std::string_view, double) override {}
  void notice(std::string_view) override {}

 private:
  ProgressStage& outer_;
};

// What is left of the job once its sizes are known.
void announce(const Epochs& epochs, const EpochInputs& inputs, const DetectOptions& options,
              ProgressSink& progress) {
  const JobSize size{epochs.before.num_frames(), epochs.after.num_frames(), epochs.before.width,
                     epochs.before.height, epochs.initial.kind()};
  std::vector<PlannedStage> stages =
      plan_detect(size, options, decides_by_votes(options, inputs.has_holes));
  stages.erase(stages.begin());  // reading is done
  progress.job_planned(stages);
}

std::optional<MetricProblem> metric_problem_of(const EpochInputs& inputs, const Epochs& epochs,
                                               ProgressSink& progress) {
  if (!inputs.metric.given()) return {};
  return MetricProblem(inputs.metric, epochs.before, epochs.after, progress);
}

OutputContents register_contents(bool authors_layout) {
  OutputContents contents{kResultsKind, {"summary.json", "sim3.json"}};
  if (authors_layout) {
    contents.names.insert(contents.names.end(),
                          {"coarse_sim3.npz", "fine_sim3.npz", "pred_poses_t1.npy",
                           "pred_poses_t2.npy", "timing.json"});
  }
  return contents;
}

PointVariance registration_variance(const Alignment& alignment) {
  const auto& uncertainty = alignment.surface_uncertainty;
  return uncertainty ? PointVariance{uncertainty->covariance, uncertainty->pivot} : PointVariance{};
}

// A verdict over nothing is none.
void expect_evidence(const ChangeSet& changes) {
  for (const auto& [name, points] :
       {std::pair("before", changes.t1.points), std::pair("after", changes.t2.points)}) {
    if (points > 0) continue;
    throw_error(ErrorCode::kDegenerate,
                "{} epoch: expected pixels that can be judged, found none; are its depths and "
                "confidences right?",
                name);
  }
}

}  // namespace

std::span<const EnumName<ChangeMethod>> enum_names(ChangeMethod) {
  static constexpr EnumName<ChangeMethod> kNames[] = {{ChangeMethod::kAuto, "auto"},
                                                      {ChangeMethod::kDistance, "distance"},
                                                      {ChangeMethod::kFreeSpace, "free_space"}};
  return kNames;
}

OutputContents detect_contents(const DetectOptions& options) {
  OutputContents contents{
      kResultsKind,
      {"summary.json", "sim3.json", "cameras_before.tum", "cameras_after.tum", "colmap/",
       "change.npz", "changes.json", "changes.csv", "before_aligned.ply", "after.ply"}};
  if (!options.explain.empty()) contents.names.push_back("explain.json");
  if (options.overlays) contents.names.push_back("overlays/");
  if (options.page) contents.names.push_back("report.html");
  return contents;
}

bool decides_by_votes(const DetectOptions& options, bool has_holes) {
  if (options.change_method != ChangeMethod::kAuto) {
    return options.change_method == ChangeMethod::kFreeSpace;
  }
  const AlignmentMethod method = options.alignment.method;
  return has_holes || method == AlignmentMethod::kAuto || method == AlignmentMethod::kRobust;
}

void DetectOptions::validate() const {
  alignment.validate();
  change.validate();
  free_space.validate();
  instances.validate();
  if (!explain.empty()) check_pixel_question(explain);
  report.validate();
}

DetectOutcome detect(const EpochInputs& inputs, const DetectOptions& options,
                     const std::filesystem::path& out, ProgressSink& progress) {
  options.validate();
  OutputDirectory directory(out, detect_contents(options));
  StageLog log(progress);
  DetectOutcome outcome;

  // 1. Read the epochs and what brings them together.
  Epochs epochs = read_epochs(inputs, options.alignment, log);
  Json summary = summary_head("detect", inputs, epochs);
  if (!inputs.origin.empty()) summary["reconstruction"] = inputs.origin;

  announce(epochs, inputs, options, progress);
  const std::optional<PixelQuestion> question = question_of(inputs, options, epochs);
  const std::optional<MetricProblem> metres = metric_problem_of(inputs, epochs, progress);

  // 2. Align: coarse, fine.
  const Alignment alignment =
      align(epochs.before, epochs.after, epochs.initial, options.alignment, log);
  const Sim3& surface_t2_from_t1 = alignment.surface_t2_from_t1;
  outcome.alignment = in_worlds(alignment, origins_of(epochs));
  epochs.joint.reset();

  // 3. Compare.
  const std::filesystem::path& aside = directory.path();
  std::optional<AnswerStore> answers;  // where photos vote
  ChangeSet changes;
  log.run("change detection", [&](ProgressStage&) {
    changes = detect_changes(epochs.before, epochs.after, surface_t2_from_t1, options.change);
  });
  if (decides_by_votes(options, inputs.has_holes)) {
    answers.emplace(aside);
    log.run("free-space votes", [&](ProgressStage& stage) {
      FractionsOf fractions(stage);
      FreeSpaceChange votes =
          free_space_changes(epochs.before, epochs.after, surface_t2_from_t1, options.free_space,
                             registration_variance(alignment), fractions,
                             question ? &*question : nullptr, answers->sink());
      outcome.explanation = std::move(votes.explanation);
      decide_by_labels(std::move(votes), changes);
    });
  }
  expect_evidence(changes);
  ChangeInstances instances;
  log.run("changed things", [&](ProgressStage&) {
    instances =
        find_instances(epochs.before, epochs.after, surface_t2_from_t1, changes, options.instances);
  });
  if (instances.unsure > 0) {
    progress.notice(fmt::format(
        "{} regions look changed, but are not sure enough to be listed as things (confidence "
        "{:.2f} at most, expected {:.2f}); --min-confidence lists them",
        instances.unsure, instances.unsure_confidence, options.instances.min_confidence));
  }
  for (const ChangeInstance& instance : instances.instances) {
    outcome.removed += instance.kind == InstanceClass::kRemoved ? 1 : 0;
    outcome.added += instance.kind == InstanceClass::kAdded ? 1 : 0;
    outcome.moved += instance.kind == InstanceClass::kMoved ? 1 : 0;
  }
  outcome.points_t1 = changes.t1.points;
  outcome.changed_t1 = changes.t1.changed;
  outcome.points_t2 = changes.t2.points;
  outcome.changed_t2 = changes.t2.changed;
  outcome.unobserved_t1 = changes.t1.unobserved;
  outcome.unobserved_t2 = changes.t2.unobserved;

  // 4. From here on everything is in the frame and the unit of the results.
  ResultFrame frame(epochs.after);
  if (metres) {
    const Metric metric = metres->solve(epochs.before, epochs.after, alignment.t2_from_t1,
                                        surface_t2_from_t1, changes.surface_sigma_u);
    frame = ResultFrame(metric, epochs.after);
    outcome.metric = in_worlds(metric, epochs.after.origin_in_world);
  }
  express(frame, changes, answers ? &*answers : nullptr, instances, outcome.explanation);
  const Sim3 result_from_t1 = frame.from_t2 * surface_t2_from_t1;

  // 5. Write.
  log.run("write results", [&](ProgressStage& stage) {
    write_json_file(aside / "sim3.json", sim3_json(outcome.alignment, outcome.metric));
    write_cameras(aside, epochs.before, epochs.after, alignment.t2_from_t1, frame);
    const AnswerStore* voted = answers ? &*answers : nullptr;
    write_change_npz(aside / "change.npz", epochs.before, epochs.after, changes, instances, voted,
                     frame);
    write_change_list(aside, instances, epochs.before, epochs.after, changes, frame);
    if (outcome.explanation) {
      write_json_file(aside / "explain.json", explanation_json(*outcome.explanation, frame));
    }
    stage.advance(0.2);
    write_change_ply(aside / "before_aligned.ply", epochs.before, result_from_t1, changes.t1,
                     changes, voted ? &voted->t1 : nullptr, frame);
    stage.advance(0.4);
    write_change_ply(aside / "after.ply", epochs.after, frame.from_t2, changes.t2, changes,
                     voted ? &voted->t2 : nullptr, frame);
    stage.advance(0.6);
    if (options.overlays) {
      write_overlays(aside / "overlays" / "before", epochs.before, changes.t1, changes);
      stage.advance(0.8);
      write_overlays(aside / "overlays" / "after", epochs.after, changes.t2, changes);
    }
  });
  summary["options"] = options_to_json(options);
  summary["alignment"] = alignment_json(outcome.alignment);
  if (outcome.metric) summary["metric"] = metric_json(*outcome.metric);
  summary["change"] = change_json(changes, frame);
  write_json_file(aside / "summary.json", summary);

  // 6. Show: the page is made from the files above, as `vggt-cd view` makes it, so the two agree.
  if (options.page) {
    epochs = {};
    changes = {};
    instances = {};
    answers.reset();
    log.run("report page", [&](ProgressStage& stage) {
      const ReportInput input = read_results(aside);
      stage.advance(0.5);
      write_report(input, options.report, aside / "report.html");
    });
  }
  directory.commit();
  return outcome;
}

RegisterOutcome register_epochs(const EpochInputs& inputs, const AlignmentOptions& options,
                                bool authors_layout, const std::filesystem::path& out,
                                ProgressSink& progress) {
  options.validate();
  OutputDirectory directory(out, register_contents(authors_layout));
  StageLog log(progress);
  Epochs epochs = read_epochs(inputs, options, log);
  Json summary = summary_head("register", inputs, epochs);
  const std::optional<MetricProblem> metres = metric_problem_of(inputs, epochs, progress);
  const Alignment local = align(epochs.before, epochs.after, epochs.initial, options, log);
  RegisterOutcome outcome{in_worlds(local, origins_of(epochs)), {}};
  const Alignment& alignment = outcome.alignment;
  if (metres) {
    outcome.metric = in_worlds(
        metres->solve(epochs.before, epochs.after, local.t2_from_t1, local.surface_t2_from_t1, 0),
        epochs.after.origin_in_world);
    summary["metric"] = metric_json(*outcome.metric);
  }
  log.run("write results", [&](ProgressStage&) {
    write_json_file(directory.path() / "sim3.json", sim3_json(alignment, outcome.metric));
    if (authors_layout) {
      write_authors_layout(directory.path(), epochs.before, epochs.after, alignment, log);
    }
  });
  summary["options"] = Json{{"alignment", options_to_json(options)}};
  summary["alignment"] = alignment_json(alignment);
  write_json_file(directory.path() / "summary.json", summary);
  directory.commit();
  return outcome;
}

}  // namespace vggtcd
