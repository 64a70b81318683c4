// SPDX-License-Identifier: Apache-2.0
// Cameras and sparse points by COLMAP: writes what it reads, runs it, reads what it writes.
#include "vggtcd/reconstruction/structure_from_motion.h"

#include <fmt/ostream.h>

#include <algorithm>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vggtcd/reconstruction/child_process.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRemedy =
    "install COLMAP (Debian: apt-get install colmap), or give network weights with --weights";

// Names by which COLMAP sorts as we do; one folder for each camera.
std::vector<std::string> colmap_names(const std::vector<Image>& images, int num_before) {
  std::vector<std::string> names;
  for (size_t i = 0; i < images.size(); ++i) {
    const bool before = static_cast<int>(i) < num_before;
    names.push_back(fmt::format("{}_{}x{}/{:06d}.pgm", before ? "t1" : "t2", images[i].width,
                                images[i].height, i));
  }
  return names;
}

void write_image(const Image& image, const fs::path& path) {
  const cv::Mat rgb(image.height, image.width, CV_8UC3, const_cast<uint8_t*>(image.rgb.data()));
  cv::Mat gray;
  cv::cvtColor(rgb, gray, cv::COLOR_RGB2GRAY);
  fs::create_directories(path.parent_path());
  if (!cv::imwrite(path.string(), gray)) {
    throw_error(ErrorCode::kOutput, "{}: cannot be written", path.string());
  }
}

// COLMAP's text format of features. Descriptors are only asked for by its own matcher.
void write_features(const Features& features, const fs::path& path) {
  std::string zeros;
  for (int i = 0; i < kDescriptorSize; ++i) zeros += " 0";
  fs::create_directories(path.parent_path());
  std::ofstream out(path);
  fmt::print(out, "{} {}\n", features.points.size(), kDescriptorSize);
  for (const KeyPoint& p : features.points) {
    fmt::print(out, "{:.3f} {:.3f} {:.3f} {:.4f}{}\n", p.u_px + 0.5f, p.v_px + 0.5f, p.scale_px,
               p.angle_rad, zeros);
  }
  if (!out.flush()) throw_error(ErrorCode::kOutput, "{}: cannot be written", path.string());
}

void write_matches(const std::vector<PhotoPair>& pairs, const std::vector<std::string>& names,
                   const fs::path& path) {
  std::ofstream out(path);
  for (const PhotoPair& pair : pairs) {
    fmt::print(out, "{} {}\n", names[static_cast<size_t>(pair.first)],
               names[static_cast<size_t>(pair.second)]);
    for (const Match& match : pair.matches) fmt::print(out, "{} {}\n", match.first, match.second);
    fmt::print(out, "\n");
  }
  if (!out.flush()) throw_error(ErrorCode::kOutput, "{}: cannot be written", path.string());
}

class Colmap {
 public:
  explicit Colmap(fs::path scratch) : scratch_(std::move(scratch)) {}

  int status(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "colmap");
    return run_program(arguments, log(), kRemedy);
  }
  void run(const std::vector<std::string>& arguments) const {
    if (const int found = status(arguments); found != 0) {
      throw_error(ErrorCode::kUnavailable,
                  "colmap {}: expected exit status 0, found {}; its output is in {}",
                  arguments.front(), found, log().string());
    }
  }
  fs::path log() const { return scratch_ / "colmap.log"; }

 private:
  fs::path scratch_;
};

// Imports everything with this first guess of the focal lengths, and runs the mapper. A mapper that
// finds nothing writes no model; the largest of several is taken.
SfmModel map_with_focal(double focal_factor, const SfmOptions& options, const fs::path& scratch) {
  const Colmap colmap(scratch);
  const std::string database = (scratch / fmt::format("focal_{}.db", focal_factor)).string();
  const std::string images = (scratch / "images").string();
  const fs::path models = scratch / fmt::format("focal_{}", focal_factor);
  fs::create_directories(models);
  colmap.run({"feature_importer", "--database_path", database, "--image_path", images,
              "--import_path", (scratch / "features").string(), "--ImageReader.camera_model",
              "SIMPLE_RADIAL", "--ImageReader.single_camera_per_folder", "1",
              "--ImageReader.default_focal_length_factor", std::to_string(focal_factor)});
  colmap.run({"matches_importer", "--database_path", database, "--match_list_path",
              (scratch / "matches.txt").string(), "--match_type", "raw", "--SiftMatching.use_gpu",
              "0", "--SiftMatching.num_threads", "1", "--SiftMatching.min_num_inliers",
              std::to_string(options.min_pair_inliers)});
  const int status = colmap.status({"mapper",
                                    "--database_path",
                                    database,
                                    "--image_path",
                                    images,
                                    "--output_path",
                                    models.string(),
                                    "--Mapper.num_threads",
                                    "1",
                                    "--Mapper.extract_colors",
                                    "0",
                                    "--Mapper.min_model_size",
                                    "3",
                                    "--Mapper.max_num_models",
                                    "3",
                                    "--Mapper.init_min_tri_angle",
                                    std::to_string(options.init_min_tri_angle_deg),
                                    "--Mapper.init_min_num_inliers",
                                    std::to_string(options.init_min_num_inliers),
                                    "--Mapper.abs_pose_min_num_inliers",
                                    "20"});
  SfmModel best;
  if (status != 0) return best;
  for (int i = 0; fs::exists(models / std::to_string(i) / "points3D.bin"); ++i) {
    SfmModel model = read_colmap_model(models / std::to_string(i));
    if (model.views.size() > best.views.size()) best = std::move(model);
  }
  return best;
}

}  // namespace

Image reduced_photo(const Image& photo, int max_side_px) {
  const int side = std::max(photo.width, photo.height);
  if (side <= max_side_px) return photo;
  const double factor = static_cast<double>(max_side_px) / side;
  Image out(std::max(1, static_cast<int>(photo.width * factor + 0.5)),
            std::max(1, static_cast<int>(photo.height * factor + 0.5)));
  const cv::Mat from(photo.height, photo.width, CV_8UC3, const_cast<uint8_t*>(photo.rgb.data()));
  cv::Mat to(out.height, out.width, CV_8UC3, out.rgb.data());
  cv::resize(from, to, to.size(), 0, 0, cv::INTER_AREA);
  return out;
}

void SfmOptions::validate() const {
  check_field(max_side_px >= 128, "max_side_px", max_side_px, "at least 128");
  check_field(max_features >= 100, "max_features", max_features, "at least 100");
  check_field(min_pair_inliers >= 8, "min_pair_inliers", min_pair_inliers, "at least 8");
}

SfmResult structure_from_motion(SfmPhotos photos, const SfmOptions& options,
                                const fs::path& scratch, ProgressSink& progress) {
  options.validate();
  fs::remove_all(scratch);
  fs::create_directories(scratch);
  SfmResult result;
  result.reduced = std::move(photos.images);
  const std::vector<std::string> names = colmap_names(result.reduced, photos.num_before);
  std::vector<Features> features;
  {
    ProgressStage stage(progress, "key points");
    features = extract_features(result.reduced, options.max_features, stage);
  }
  for (size_t i = 0; i < names.size(); ++i) {
    write_image(result.reduced[i], scratch / "images" / names[i]);
    write_features(features[i], scratch / "features" / (names[i] + ".txt"));
  }
  {
    ProgressStage stage(progress, "matching");
    result.pairs = match_all(features, options.min_pair_inliers, stage);
  }
  write_matches(result.pairs, names, scratch / "matches.txt");
  ProgressStage stage(progress, "structure from motion");
  constexpr double kEnough = 0.9;
  for (const double focal_factor : {1.2, 0.85}) {
    SfmModel model = map_with_focal(focal_factor, options, scratch);
    if (model.views.size() > result.model.views.size()) result.model = std::move(model);
    const auto found = static_cast<double>(result.model.views.size());
    if (found >= kEnough * static_cast<double>(names.size())) break;
    stage.advance(0.5);
  }
  for (const SfmView& view : result.model.views) {
    const auto at = std::find(names.begin(), names.end(), view.name);
    check(at != names.end(), "structure_from_motion: a view is one of the photos");
    result.photo_of_view.push_back(static_cast<int>(at - names.begin()));
  }
  return result;
}

}  // namespace vggtcd
