// SPDX-License-Identifier: Apache-2.0
// Results against truth: which frame is which, which pixel is which, and the counting.
#include "vggtcd/evaluation/results_scores.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "vggtcd/core/error.h"
#include "vggtcd/core/number_text.h"
#include "vggtcd/evaluation/change_benchmark.h"
#include "vggtcd/evaluation/synthetic/render.h"
#include "vggtcd/io/colmap.h"
#include "vggtcd/io/coordinate.h"
#include "vggtcd/io/npz.h"

namespace vggtcd {
namespace {

constexpr const char* kSuffix[] = {"_t1", "_t2"};
constexpr const char* kFolder[] = {"before/", "after/"};
constexpr uint8_t kUnobserved = 3, kNoLabel = 255;  // change.npz, docs/formats.md

std::vector<Rigid3> read_true_epoch(const NpzReader& reader, const std::string& key) {
  reader.expect_shape(key, std::array<int64_t, 3>{-1, 3, 4});
  const std::vector<double> values = reader.read<double>(key);
  std::vector<Rigid3> poses(values.size() / 12);
  for (size_t k = 0; k < poses.size(); ++k) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> matrix(&values[12 * k]);
    poses[k] = {matrix.leftCols<3>(), matrix.col(3)};
    if (!matrix.leftCols<3>().allFinite() || !are_coordinates(matrix.col(3))) {
      throw_error(ErrorCode::kInput, "{}: {}: pose {}: expected a rotation and {}", reader.name(),
                  key, k, kCoordinateRange);
    }
  }
  return poses;
}

// "before/0003.jpg" -> 3; -1 if the name is no number.
int frame_number(const std::string& name, const std::string& folder) {
  const std::string stem = std::filesystem::path(name.substr(folder.size())).stem().string();
  return number_in<int>(stem).value_or(-1);
}

// One epoch of the results: its cameras, and the true frame of each of its frames.
struct ResultFrames {
  std::vector<Rigid3> poses;
  std::vector<std::string> names;
  std::vector<int> true_frame;
};

// Image ids are in the order of the frames; names need not be (p10.jpg comes after p9.jpg).
ResultFrames frames_of(const ColmapModel& model, const std::string& folder, int true_frames,
                       const std::filesystem::path& results) {
  ResultFrames frames;
  for (const auto& [id, image] : model.images) {
    if (!image.name.starts_with(folder)) continue;
    frames.poses.push_back(image.camera_from_world);
    frames.names.push_back(image.name);
    frames.true_frame.push_back(frame_number(image.name, folder));
  }
  if (frames.poses.empty()) {
    throw_error(ErrorCode::kInput, "{}: colmap/: expected cameras named {}..., found none",
                results.string(), folder);
  }
  const auto named = [&](int frame) { return frame >= 0 && frame < true_frames; };
  if (std::all_of(frames.true_frame.begin(), frames.true_frame.end(), named)) return frames;
  if (static_cast<int>(frames.poses.size()) != true_frames) {
    throw_error(ErrorCode::kInput,
                "{}: {} has {} frames whose names are not those of the {} photos of the truth",
                results.string(), folder, frames.poses.size(), true_frames);
  }
  for (int k = 0; k < true_frames; ++k) frames.true_frame[static_cast<size_t>(k)] = k;
  return frames;
}

struct Maps {
  size_t frames = 0, height = 0, width = 0;
  size_t per_frame() const { return height * width; }
};

Maps maps_of(const NpzReader& reader, const std::string& key) {
  reader.expect_shape(key, std::array<int64_t, 3>{-1, -1, -1});
  const std::vector<int64_t>& shape = reader.header(key).shape;
  return {static_cast<size_t>(shape[0]), static_cast<size_t>(shape[1]),
          static_cast<size_t>(shape[2])};
}

// Arrays that are looked up by the same pixel have one shape.
void expect_maps(const NpzReader& reader, const std::string& key, const Maps& maps) {
  const auto size = [](size_t value) { return static_cast<int64_t>(value); };
  reader.expect_shape(
      key, std::array<int64_t, 3>{size(maps.frames), size(maps.height), size(maps.width)});
}

// The pixel of a result frame that shows a pixel of the truth: both show the middle of the photo,
// and the frame is filled. Negative outside.
int64_t frame_pixel(const Maps& truth, const Maps& frame, size_t u, size_t v) {
  const auto number = [](size_t value) { return static_cast<double>(value); };
  const double scale = std::max(number(frame.width) / number(truth.width),
                                number(frame.height) / number(truth.height));
  const double x =
      (number(u) - 0.5 * (number(truth.width) - 1)) * scale + 0.5 * (number(frame.width) - 1) + 0.5;
  const double y = (number(v) - 0.5 * (number(truth.height) - 1)) * scale +
                   0.5 * (number(frame.height) - 1) + 0.5;
  if (x < 0 || y < 0 || x >= number(frame.width) || y >= number(frame.height)) return -1;
  return static_cast<int64_t>(y) * static_cast<int64_t>(frame.width) + static_cast<int64_t>(x);
}

constexpr float kNoEvidence = std::numeric_limits<float>::quiet_NaN();
constexpr float kNotObserved = -std::numeric_limits<float>::infinity();

// What the results say about the pixels of their own frames, whatever method made them.
class Judgement {
 public:
  Judgement(const NpzReader& change, const std::string& suffix, const Maps& maps) {
    expect_maps(change, "changed" + suffix, maps);
    changed_ = change.read<uint8_t>("changed" + suffix);
    const bool voted = change.has("label" + suffix);
    const std::string rank = (voted ? "evidence" : "score") + suffix;
    expect_maps(change, rank, maps);
    rank_ = change.read<float>(rank);
    if (!voted) return;
    expect_maps(change, "label" + suffix, maps);
    const auto label = change.read<uint8_t>("label" + suffix);
    for (size_t i = 0; i < label.size(); ++i) {
      if (label[i] == kNoLabel) {
        rank_[i] = kNoEvidence;
      } else if (label[i] == kUnobserved || std::isnan(rank_[i])) {
        rank_[i] = kNotObserved;
      }
    }
  }
  float rank(size_t i) const { return rank_[i]; }
  bool changed(size_t i) const { return changed_[i] != 0; }

 private:
  std::vector<uint8_t> changed_;
  std::vector<float> rank_;
};

// What the results say about every pixel of the truth: kNoEvidence, kNotObserved, or more for
// rather changed.
ChangeAnswer answer_pixels(const NpzReader& change, const std::string& suffix,
                           const ResultFrames& frames, const Maps& truth) {
  const Maps maps = maps_of(change, "score" + suffix);
  if (maps.frames != frames.poses.size()) {
    throw_error(ErrorCode::kInput, "{}: expected {} frames as in colmap/, found {}", change.name(),
                frames.poses.size(), maps.frames);
  }
  const Judgement judgement(change, suffix, maps);
  const size_t pixels = truth.frames * truth.per_frame();
  ChangeAnswer answers{std::vector<float>(pixels, kNoEvidence), std::vector<uint8_t>(pixels, 0)};
  for (size_t k = 0; k < maps.frames; ++k) {
    size_t to = static_cast<size_t>(frames.true_frame[k]) * truth.per_frame();
    for (size_t v = 0; v < truth.height; ++v) {
      for (size_t u = 0; u < truth.width; ++u, ++to) {
        const int64_t pixel = frame_pixel(truth, maps, u, v);
        if (pixel < 0) continue;
        const size_t from = k * maps.per_frame() + static_cast<size_t>(pixel);
        answers.score[to] = judgement.rank(from);
        answers.called[to] = judgement.changed(from) && !std::isnan(answers.score[to]) ? 1 : 0;
      }
    }
  }
  return answers;
}

std::string most_changed(const ResultFrames& frames, const std::vector<int64_t>& found) {
  size_t best = 0;
  const auto count_of = [&](size_t k) { return found[static_cast<size_t>(frames.true_frame[k])]; };
  for (size_t k = 1; k < frames.names.size(); ++k) {
    if (count_of(k) > count_of(best)) best = k;
  }
  return frames.names.at(best);
}

// What score_changes needs of an epoch: labels, objects and what the other epoch looked at.
EpochTruth read_labels(const NpzReader& truth, const std::string& suffix, const Maps& maps) {
  EpochTruth epoch;
  for (const char* key : {"unseen_by_other", "instance"}) expect_maps(truth, key + suffix, maps);
  epoch.label = truth.read<uint8_t>("changed" + suffix);
  for (const uint8_t unseen : truth.read<uint8_t>("unseen_by_other" + suffix)) {
    epoch.other_looked.push_back(unseen != 0 ? 0 : 1);
  }
  for (const int64_t object : truth.read<int64_t>("instance" + suffix)) {
    epoch.object.push_back(object == 0 ? 0 : 1);  // only the sky counts apart
  }
  return epoch;
}

// Of surface that both epochs saw.
struct Seen {
  int64_t pixels = 0, with_evidence = 0;
  std::vector<int64_t> found_in_frame;  // pixels of each frame that are rightly called changed
};

Seen count_seen(const EpochTruth& truth, const ChangeAnswer& answer, const Maps& maps) {
  Seen seen;
  seen.found_in_frame.assign(maps.frames, 0);
  for (size_t pixel = 0; pixel < truth.label.size(); ++pixel) {
    const bool void_or_sky = truth.label[pixel] == kLabelVoid || truth.object[pixel] == 0;
    if (void_or_sky || !truth.other_looked[pixel]) continue;
    ++seen.pixels;
    seen.with_evidence += std::isnan(answer.score[pixel]) ? 0 : 1;
    if (truth.label[pixel] == kLabelChanged && answer.called[pixel] != 0) {
      ++seen.found_in_frame[pixel / maps.per_frame()];
    }
  }
  return seen;
}

}  // namespace

BitemporalTrajectory read_true_cameras(const std::filesystem::path& truth_npz) {
  const NpzReader reader(truth_npz);
  return {read_true_epoch(reader, "extrinsic_t1"), read_true_epoch(reader, "extrinsic_t2")};
}

ResultsScores score_results(const std::filesystem::path& results,
                            const std::filesystem::path& truth_npz) {
  const NpzReader truth(truth_npz);
  const NpzReader change(results / "change.npz");
  const ColmapModel cameras = read_colmap(results / "colmap");
  const BitemporalTrajectory true_cameras = read_true_cameras(truth_npz);
  EpochTruth labels[2];
  ChangeAnswer answers[2];
  int64_t seen_pixels = 0, seen_with_evidence = 0;
  ResultsScores scores;
  BitemporalTrajectory found, expected;
  for (const int e : {0, 1}) {
    const std::string suffix = kSuffix[e];
    const std::vector<Rigid3>& true_poses = e == 0 ? true_cameras.t1 : true_cameras.t2;
    const Maps maps = maps_of(truth, "changed" + suffix);
    expect_maps(truth, "changed" + suffix, {true_poses.size(), maps.height, maps.width});
    const ResultFrames frames =
        frames_of(cameras, kFolder[e], static_cast<int>(true_poses.size()), results);
    (e == 0 ? found.t1 : found.t2) = frames.poses;
    for (const int k : frames.true_frame) {
      (e == 0 ? expected.t1 : expected.t2).push_back(true_poses[static_cast<size_t>(k)]);
    }
    labels[e] = read_labels(truth, suffix, maps);
    answers[e] = answer_pixels(change, suffix, frames, maps);
    const Seen seen = count_seen(labels[e], answers[e], maps);
    seen_pixels += seen.pixels;
    seen_with_evidence += seen.with_evidence;
    (e == 0 ? scores.most_changed_t1 : scores.most_changed_t2) =
        most_changed(frames, seen.found_in_frame);
  }
  scores.frames_t1 = static_cast<int>(found.t1.size());
  scores.frames_t2 = static_cast<int>(found.t2.size());
  scores.true_frames_t1 = static_cast<int>(true_cameras.t1.size());
  scores.true_frames_t2 = static_cast<int>(true_cameras.t2.size());
  scores.cameras = evaluate_trajectory(found, expected);
  scores.evidence_share = static_cast<double>(seen_with_evidence) /
                          static_cast<double>(std::max<int64_t>(1, seen_pixels));
  const std::vector<AnsweredEpoch> epochs = {{labels[0], answers[0]}, {labels[1], answers[1]}};
  const ChangeOutcome evidence = score_changes(epochs, false, false);
  scores.evidence = evidence.scores;
  scores.unseen_called_changed = evidence.unseen_called_changed;
  scores.every_pixel = score_changes(epochs, false, true).scores;
  return scores;
}

}  // namespace vggtcd
