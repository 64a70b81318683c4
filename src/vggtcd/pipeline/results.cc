// SPDX-License-Identifier: Apache-2.0
// The files that detect and register leave behind; docs/formats.md describes each one.
#include "vggtcd/pipeline/results.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "vggtcd/core/parallel.h"
#include "vggtcd/io/colmap.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/image_write.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/io/ply.h"
#include "vggtcd/io/sim3_file.h"
#include "vggtcd/io/trajectory.h"
#include "vggtcd/io/tum.h"
#include "vggtcd/report/heat_map.h"
#include "vggtcd/report/overlay_names.h"
#include "vggtcd/scene/local_frame.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

Json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json epoch_to_joint_json(const EpochToJoint& epoch) {
  return {{"joint_from_epoch", sim3_to_json(epoch.joint_from_epoch)},
          {"candidates", epoch.candidates},
          {"correspondences", epoch.correspondences},
          {"rms_residual_u", epoch.rms_residual_u},
          {"unexplained_share", epoch.unexplained_share}};
}

Json fine_json(const FineResult& fine) {
  return {{"verdict", enum_to_string(fine.verdict)},
          {"explanation", fine.explanation},
          {"voxel_size_t1_u", fine.voxel_size_t1_u},
          {"voxel_size_t2_u", fine.voxel_size_t2_u},
          {"points_t1", fine.points_t1},
          {"points_t2", fine.points_t2},
          {"static_points", fine.static_points},
          {"median_residual_coarse_u", fine.median_residual_coarse_u},
          {"median_residual_fine_u",
           fine.median_residual_fine_u ? Json(*fine.median_residual_fine_u) : Json(nullptr)},
          {"translation_update_u", vector_json(fine.translation_update_u)}};
}

Json robust_json(const RobustResult& robust) {
  Json json = {{"verdict", enum_to_string(robust.verdict)},
               {"explanation", robust.explanation},
               {"iterations", robust.iterations},
               {"points_t1", robust.points_t1},
               {"points_t2", robust.points_t2},
               {"pairs", robust.pairs},
               {"converged", robust.converged},
               {"uncertainty_measured", robust.uncertainty_measured},
               {"frame_spread",
                {{"rotation_rad", robust.uncertainty.frame.rotation_rad},
                 {"translation_u", robust.uncertainty.frame.translation_u},
                 {"log_scale", robust.uncertainty.frame.log_scale}}},
               {"rejected_far", robust.rejected_far},
               {"rejected_normal", robust.rejected_normal},
               {"residual_sigma_u", robust.residual_sigma_u},
               {"ties", robust.ties},
               {"ties_used", robust.ties_used},
               {"ties_contradict", robust.ties_contradict},
               {"tie_deviation", robust.tie_deviation},
               {"compared_by", enum_to_string(robust.compared_by)},
               {"cost_initial", robust.cost_initial},
               {"cost_final", robust.cost_final},
               {"pivot_in_t2", vector_json(robust.pivot_in_t2)},
               {"open_degrees_of_freedom", robust.open_degrees_of_freedom},
               {"open_motions", robust.open_motions}};
  for (size_t i = 0; i < kDegreesOfFreedom.size(); ++i) {
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    json["degrees_of_freedom"][std::string(kDegreesOfFreedom[i])] = {
        {"sigma", std::sqrt(robust.covariance(k, k))},
        {"constrained_share", robust.constrained_share[k]}};
  }
  return json;
}

// Of the similarity that was chosen: standard deviations and the whole covariance about a pivot.
Json uncertainty_json(const SimilarityCovariance& uncertainty) {
  Json json = {{"pivot_in_t2", vector_json(uncertainty.pivot)}};
  for (size_t i = 0; i < kDegreesOfFreedom.size(); ++i) {
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    json["sigma"][std::string(kDegreesOfFreedom[i])] = std::sqrt(uncertainty.covariance(k, k));
  }
  for (int row = 0; row < 7; ++row) {
    Json values = Json::array();
    for (int column = 0; column < 7; ++column)
      values.push_back(uncertainty.covariance(row, column));
    json["covariance"].push_back(values);
  }
  return json;
}

Json plausibility_json(const PlausibilityResult& plausibility) {
  const SurfaceAgreement& surfaces = plausibility.surfaces;
  return {{"verdict", enum_to_string(plausibility.verdict)},
          {"explanation", plausibility.explanation},
          {"seen_share_t1", surfaces.seen_share_t1},
          {"seen_share_t2", surfaces.seen_share_t2},
          {"agreeing_share", surfaces.agreeing},
          {"by_chance_share", surfaces.by_chance},
          {"above_chance", surfaces.above_chance()}};
}

Json epoch_change_json(const EpochChange& change) {
  return {{"points", change.points},
          {"changed", change.changed},
          {"decided_by", change.label.empty() ? "distance" : "free_space"},
          {"unobserved", change.unobserved},
          {"changed_share", change.points > 0 ? static_cast<double>(change.changed) /
                                                    static_cast<double>(change.points)
                                              : 0.0}};
}

Trajectory trajectory_of(const std::vector<View>& views) {
  Trajectory trajectory;
  for (const View& view : views) trajectory.push_back({view.name, view.camera_from_world});
  return trajectory;
}

}  // namespace

Json sim3_json(const Alignment& alignment, const std::optional<Metric>& metric) {
  Json json = sim3_to_json(alignment.t2_from_t1);
  json["maps"] = "x_T2 = scale * rotation * x_T1 + translation";
  json["used_by"] = "cameras: cameras_*.tum, colmap/";
  json["surfaces"] = sim3_to_json(alignment.surface_t2_from_t1);
  json["surfaces"]["used_by"] = "surfaces: change, things, before_aligned.ply, plausibility";
  json["chosen"] = alignment.chosen;
  json["verdict"] = alignment.verdict;
  json["explanation"] = alignment.explanation;
  json["initial"] = sim3_to_json(alignment.initial_t2_from_t1);
  json["initial"]["source"] = alignment.initial_source;
  if (alignment.coarse) json["coarse"] = sim3_to_json(alignment.coarse->t2_from_t1);
  if (alignment.fine) json["fine"] = sim3_to_json(alignment.fine->t2_from_t1);
  if (alignment.robust) json["robust"] = sim3_to_json(alignment.robust->t2_from_t1);
  if (metric) {
    const MetricFrame& frame = metric->frame;
    Json& into = json["metres_from_t2"] = sim3_to_json(frame.metres_from_t2);
    into["frame"] = frame_name(*metric);
    into["scale_sigma_relative"] = frame.scale_sigma ? Json(*frame.scale_sigma) : Json(nullptr);
    into["rotation_sigma_deg"] = frame.rotation_sigma_rad * 180 / M_PI;
    into["position_sigma_m"] = frame.position_sigma_m;
  }
  return json;
}

Json alignment_json(const Alignment& alignment) {
  Json json;
  json["chosen"] = alignment.chosen;
  json["verdict"] = alignment.verdict;
  json["explanation"] = alignment.explanation;
  json["scale_t2_from_t1"] = alignment.t2_from_t1.scale;
  json["initial_source"] = alignment.initial_source;
  if (alignment.coarse) {
    json["coarse"] = {{"t1", epoch_to_joint_json(alignment.coarse->t1)},
                      {"t2", epoch_to_joint_json(alignment.coarse->t2)}};
  }
  if (alignment.uncertainty) json["uncertainty"] = uncertainty_json(*alignment.uncertainty);
  if (alignment.fine) json["fine"] = fine_json(*alignment.fine);
  if (alignment.robust) json["robust"] = robust_json(*alignment.robust);
  json["plausibility"] = plausibility_json(alignment.plausibility);
  for (const AlignmentCandidate& candidate : alignment.candidates) {
    json["candidates"].push_back({{"name", candidate.name}, {"cost", candidate.cost}});
  }
  return json;
}

Json change_json(const ChangeSet& changes, const ResultFrame& frame) {
  Json json = {{"frame", frame.name},
               {"unit", frame.unit},
               {"scene_extent_u", changes.scene_extent_u},
               {"threshold_u", changes.threshold_u},
               {"bound_u", changes.bound_u},
               {"t1", epoch_change_json(changes.t1)},
               {"t2", epoch_change_json(changes.t2)}};
  if (frame.is_far()) json["origin_u"] = vector_json(frame.origin);
  return frame.renamed(json);
}

Json explanation_json(const PixelExplanation& why, const ResultFrame& frame) {
  const auto number = [](double value) { return std::isnan(value) ? Json(nullptr) : Json(value); };
  Json json = {{"photo", why.photo},
               {"frame", why.question.frame},
               {"pixel", {why.question.x, why.question.y}},
               {"sentence", explanation_sentence(why, frame.unit_in_words())},
               {"unit", frame.unit},
               {"label", enum_to_string(why.label)},
               {"voted_itself", why.voted},
               {"votes", why.votes},
               {"through_share", number(why.through_share)},
               {"min_through_share", why.min_through_share},
               {"confidence", number(static_cast<double>(why.confidence))},
               {"gap_u", number(static_cast<double>(why.gap_u))},
               {"level_of_detection_u", number(static_cast<double>(why.level_of_detection_u))},
               {"photos", Json::array()}};
  for (const PhotoTestimony& photo : why.photos) {
    const Testimony& said = photo.said;
    Json line = {
        {"photo", photo.photo}, {"vote", enum_to_string(said.vote)}, {"weight", photo.weight}};
    if (said.vote != Vote::kOutside) {
      line["pixel"] = {photo.x, photo.y};
      line["depth_u"] = said.z;
    }
    if (said.far > 0) {
      line["nearest_u"] = said.near;
      line["farthest_u"] = said.far;
      line["gap_u"] = said.gap_u;
      if (said.sigma_u > 0) line["sigma_u"] = said.sigma_u;
    }
    json["photos"].push_back(line);
  }
  return frame.renamed(json);
}

void write_change_ply(const std::filesystem::path& path, const Reconstruction& epoch,
                      const Sim3& result_from_epoch, const EpochChange& change,
                      const ChangeSet& changes, const StoredAnswers* answers,
                      const ResultFrame& in_frame) {
  const std::string comments[] = {
      fmt::format("frame: {}, unit: {}", in_frame.name, in_frame.unit_in_words())};
  std::vector<std::string> fields = {"change_distance", "changed", "confidence"};
  if (answers) fields.insert(fields.end(), {"label", "label_confidence", "level_of_detection"});
  const size_t num_fields = fields.size(), per_frame = epoch.pixels_per_frame();
  PlyWriter writer(path, static_cast<size_t>(change.points), std::move(fields), comments,
                   in_frame.origin);
  std::vector<float> label_confidence(answers ? per_frame : 0);
  std::vector<float> level_of_detection(answers ? per_frame : 0);
  for (int frame = 0; frame < epoch.num_frames(); ++frame) {
    const PixelRays rays(epoch.views[static_cast<size_t>(frame)], result_from_epoch);
    const size_t first = static_cast<size_t>(frame) * per_frame;
    if (answers) {
      answers->confidence.read(first, label_confidence);
      answers->level_of_detection.read(first, level_of_detection);
    }
    for (size_t i = 0; i < per_frame; ++i) {
      const size_t pixel = first + i;
      const float score = change.score[pixel];
      if (answers ? change.label[pixel] == ChangeLabel::kNoEvidence : std::isnan(score)) continue;
      std::array<float, 6> values = {score, changes.changed(change, pixel) ? 1.0f : 0.0f,
                                     epoch.confidence[pixel]};
      if (answers) {
        values[3] = static_cast<float>(change.label[pixel]);
        values[4] = label_confidence[i];
        values[5] = level_of_detection[i];
      }
      const int u = static_cast<int>(i) % epoch.width, v = static_cast<int>(i) / epoch.width;
      writer.add(rays.point(u, v, epoch.depth[pixel]), &epoch.color[3 * pixel],
                 std::span(values).first(num_fields));
    }
  }
  writer.commit();
}

void write_change_npz(const std::filesystem::path& path, const Reconstruction& before,
                      const Reconstruction& after, const ChangeSet& changes,
                      const ChangeInstances& instances, const AnswerStore* answers,
                      const ResultFrame& frame) {
  struct Part {
    const char* suffix;
    std::vector<int64_t> shape;
    const EpochChange& change;
    const std::vector<int32_t>& instance;
    const StoredAnswers* answers;
  };
  const auto shape = [](const Reconstruction& r) {
    return std::vector<int64_t>{r.num_frames(), r.height, r.width};
  };
  const Part parts[] = {
      {"t1", shape(before), changes.t1, instances.id_t1, answers ? &answers->t1 : nullptr},
      {"t2", shape(after), changes.t2, instances.id_t2, answers ? &answers->t2 : nullptr}};
  NpzWriter writer(path);
  const auto for_parts = [&](const char* name, const auto& add) {
    for (const Part& part : parts) add(fmt::format("{}_{}", name, part.suffix), part);
  };
  for_parts("score", [&](const std::string& key, const Part& part) {
    writer.add<float>(key, part.shape, part.change.score);
  });
  for_parts("changed", [&](const std::string& key, const Part& part) {
    writer.add_mask(key, part.shape, [&](size_t first, std::span<uint8_t> mask) {
      for (uint8_t& value : mask) value = changes.changed(part.change, first++) ? 1 : 0;
    });
  });
  if (answers) {
    for_parts("label", [&](const std::string& key, const Part& part) {
      writer.add<uint8_t>(key, part.shape, [&](size_t first, std::span<uint8_t> labels) {
        for (uint8_t& value : labels) value = static_cast<uint8_t>(part.change.label[first++]);
      });
    });
    for (const Part& part : parts) {
      for (const auto& [name, values] :
           {std::pair{"gap", &part.answers->gap},
            {"evidence", &part.answers->evidence},
            {"confidence", &part.answers->confidence},
            {"level_of_detection", &part.answers->level_of_detection}}) {
        writer.add<float>(fmt::format("{}_{}", name, part.suffix), part.shape,
                          [array = values](size_t first, std::span<float> target) {
                            array->read(first, target);
                          });
      }
    }
  }
  for_parts("instance", [&](const std::string& key, const Part& part) {
    writer.add<int32_t>(key, part.shape, part.instance);
  });
  writer.add_strings("unit", {&frame.unit, 1});
  writer.finish();
}

void write_overlays(const std::filesystem::path& directory, const Reconstruction& epoch,
                    const EpochChange& change, const ChangeSet& changes) {
  make_folder(directory);
  std::vector<std::string> names;
  for (const View& view : epoch.views) names.push_back(view.name);
  const std::vector<std::string> files = overlay_names(names);
  const size_t per_frame = epoch.pixels_per_frame();
  parallel_for(epoch.num_frames(), 1, [&](int64_t frame, int64_t) {
    const size_t index = static_cast<size_t>(frame);
    const size_t first = index * per_frame;
    const auto color = epoch.frame_color(static_cast<int>(frame));
    const Image overlay =
        change.label.empty()
            ? render_overlay(color, std::span(change.score).subspan(first, per_frame), epoch.height,
                             epoch.width, {changes.threshold_u, changes.bound_u})
            : render_label_overlay(color, std::span(change.label).subspan(first, per_frame),
                                   epoch.height, epoch.width);
    write_png(directory / files[index], overlay);
  });
}

std::vector<View> views_in(const Reconstruction& epoch, const Sim3& frame_from_epoch,
                           const Eigen::Vector3d& origin, const std::string& name_prefix) {
  std::vector<View> views = epoch.views;
  for (View& view : views) {
    view.camera_from_world =
        camera_from_world(camera_from_new_world(view.camera_from_world, frame_from_epoch), origin);
    view.name = name_prefix + view.name;
  }
  return views;
}

void write_cameras(const std::filesystem::path& directory, const Reconstruction& before,
                   const Reconstruction& after, const Sim3& t2_from_t1, const ResultFrame& frame) {
  std::vector<View> views = views_in(before, frame.from_t2 * t2_from_t1, frame.origin, "before/");
  const std::vector<View> views_t2 = views_in(after, frame.from_t2, frame.origin, "after/");
  const std::string comment = fmt::format("frame: {}, unit: {}", frame.name, frame.unit_in_words());
  write_tum(directory / "cameras_before.tum", trajectory_of(views), comment);
  write_tum(directory / "cameras_after.tum", trajectory_of(views_t2), comment);
  views.insert(views.end(), views_t2.begin(), views_t2.end());
  make_folder(directory / "colmap");
  write_colmap(directory / "colmap", views);
}

void write_authors_layout(const std::filesystem::path& directory, const Reconstruction& before,
                          const Reconstruction& after, const Alignment& alignment,
                          const StageLog& log) {
  write_sim3_npz(directory / "coarse_sim3.npz", alignment.initial_t2_from_t1);
  write_sim3_npz(directory / "fine_sim3.npz", alignment.t2_from_t1);
  constexpr PoseConvention kTheirs = PoseConvention::kCameraFromWorld;
  const auto as_in_file = [](const Reconstruction& epoch) {
    return trajectory_of(views_in(epoch, {}, epoch.origin_in_world, ""));
  };
  write_npy_poses(directory / "pred_poses_t1.npy", as_in_file(before), kTheirs);
  write_npy_poses(directory / "pred_poses_t2.npy", as_in_file(after), kTheirs);
  // Their keys; what is theirs alone (the network's own time) is not invented.
  Json timing = {{"coarse", 0.0}, {"fine", 0.0}, {"total", 0.0}};
  int64_t peak = 0;
  for (const StageRecord& record : log.records()) {
    if (record.name == "coarse alignment") timing["coarse"] = record.seconds;
    if (record.name == "fine alignment") timing["fine"] = record.seconds;
    peak = std::max(peak, record.peak_memory_bytes);
  }
  timing["total"] = timing["coarse"].get<double>() + timing["fine"].get<double>();
  timing["paper_eval_time"] = timing["total"];
  timing["peak_memory_MB"] = static_cast<double>(peak) / 1e6;
  write_json_file(directory / "timing.json", timing);
}

}  // namespace vggtcd
