// SPDX-License-Identifier: Apache-2.0
// Cameras and sparse points by COLMAP: writes what it reads, runs it, reads what it writes.
#include "vggtcd/reconstruction/structure_from_motion.h"

#include <fmt/ostream.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <span>

#include "vggtcd/io/file_system.h"
#include "vggtcd/io/input_file.h"
#include "vggtcd/io/kept_files.h"
#include "vggtcd/io/output_file.h"
#include "vggtcd/io/quote.h"
#include "vggtcd/reconstruction/child_process.h"
#include "vggtcd/reconstruction/match_file.h"
#include "vggtcd/reconstruction/photo_cameras.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRemedy =
    "install COLMAP (Debian: apt-get install colmap), or give network weights with --weights";

// What the scratch folder keeps.
constexpr const char* kMatches = "matches.npz";
constexpr const char* kModel = "model";
constexpr const char* kNoModel = "no_model";

// A photo as COLMAP gets it: one folder for each camera, names by which it sorts as we do.
struct ColmapPhoto {
  std::string name;
  bool before = true;
  double focal_factor = 0;  // of the longer side; 0: to be guessed
};

std::vector<ColmapPhoto> colmap_photos(const SfmPhotos& photos) {
  const std::span exif(photos.exif);
  const auto num_before = static_cast<size_t>(photos.num_before);
  const PhotoCameras cameras[] = {photo_cameras(exif.first(num_before)),
                                  photo_cameras(exif.subspan(num_before))};
  std::vector<ColmapPhoto> result;
  for (size_t i = 0; i < photos.images.size(); ++i) {
    const bool before = i < num_before;
    const PhotoCameras& of_epoch = cameras[before ? 0 : 1];
    const int camera = of_epoch.camera_of[before ? i : i - num_before];
    const Image& image = photos.images[i];
    result.push_back({fmt::format("{}_{}x{}{}/{:06d}.pgm", before ? "t1" : "t2", image.width,
                                  image.height, camera == 0 ? "" : fmt::format("_c{}", camera), i),
                      before, of_epoch.focal_of[static_cast<size_t>(camera)]});
  }
  return result;
}

std::vector<std::string> names_of(const std::vector<ColmapPhoto>& photos) {
  std::vector<std::string> names;
  for (const ColmapPhoto& photo : photos) names.push_back(photo.name);
  return names;
}

void write_image(const Image& image, const fs::path& path) {
  const cv::Mat rgb(image.height, image.width, CV_8UC3, const_cast<uint8_t*>(image.rgb.data()));
  cv::Mat gray;
  cv::cvtColor(rgb, gray, cv::COLOR_RGB2GRAY);
  make_folder(path.parent_path());
  if (!cv::imwrite(path.string(), gray)) {
    throw_error(ErrorCode::kOutput, "{}: cannot be written", path.string());
  }
}

// COLMAP's text format of features. Descriptors are only asked for by its own matcher.
void write_features(const Features& features, const fs::path& path) {
  std::string zeros;
  for (int i = 0; i < kDescriptorSize; ++i) zeros += " 0";
  make_folder(path.parent_path());
  std::ofstream out(path);
  fmt::print(out, "{} {}\n", features.points.size(), kDescriptorSize);
  for (const KeyPoint& p : features.points) {
    fmt::print(out, "{:.3f} {:.3f} {:.3f} {:.4f}{}\n", p.u_px + 0.5f, p.v_px + 0.5f, p.scale_px,
               p.angle_rad, zeros);
  }
  if (!out.flush()) throw_error(ErrorCode::kOutput, "{}: cannot be written", path.string());
}

void write_match_list(const std::vector<PhotoPair>& pairs, const std::vector<std::string>& names,
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
  explicit Colmap(fs::path folder) : folder_(std::move(folder)) {}

  ProgramEnd end_of(std::vector<std::string> arguments,
                    const std::function<void()>& while_running = {}) const {
    arguments.insert(arguments.begin(), "colmap");
    return run_program(arguments, log(), kRemedy, while_running);
  }
  void run(const std::vector<std::string>& arguments) const {
    const ProgramEnd end = end_of(arguments);
    if (!end.succeeded()) throw_failed(arguments.front(), end);
  }
  // Not the photos' fault, as far as is known: the same command may succeed.
  [[noreturn]] void throw_failed(const std::string& command, const ProgramEnd& end) const {
    throw_error(ErrorCode::kUnavailable,
                "colmap {}: expected exit status 0, found {}; its output is in {}; the finished "
                "stages are kept: run it again, with more memory or fewer photos (--frames)",
                command, end.in_words(), log().string());
  }
  std::uintmax_t log_size() const { return is_file(log()) ? size_of_file(log()) : 0; }
  // The only way in which the mapper says that the photos determine no model, in what it wrote
  // behind the first bytes of the log.
  bool found_no_model(const ProgramEnd& end, std::uintmax_t first) const {
    if (end.signal != 0 || end.status != 1) return false;
    InputFile file(log(), "COLMAP's log");
    file.seekg(static_cast<std::streamoff>(first));
    for (std::string line; std::getline(file, line);) {
      if (line.find("failed to create sparse model") != std::string::npos) return true;
    }
    return false;
  }
  fs::path log() const { return folder_ / "colmap.log"; }
  // How many photos the mapper has tried to place since the last line that starts a model.
  int placed() const {
    int count = 0;
    InputFile file(log(), "COLMAP's log");
    for (std::string line; std::getline(file, line);) {
      if (line.starts_with("Registering image")) ++count;
      if (line.starts_with("Initializing with")) count = 2;
    }
    return count;
  }

 private:
  fs::path folder_;
};

// The photo that each view is. COLMAP names what it was given; a wrapper, or another program of
// that name, may not.
std::vector<int> number_views(const SfmModel& model, const std::vector<std::string>& names,
                              const fs::path& from) {
  std::map<std::string_view, int> unseen;
  for (size_t i = 0; i < names.size(); ++i) unseen.emplace(names[i], static_cast<int>(i));
  std::vector<int> numbers;
  for (const SfmView& view : model.views) {
    const auto at = unseen.find(view.name);
    if (at == unseen.end()) {
      throw_error(
          ErrorCode::kUnavailable,
          "colmap: expected each of the {} photos it was given ({}, ...) at most once in its "
          "model, found {}; is the colmap on the PATH the program itself? See {}",
          names.size(), names.front(), quote(view.name), from.string());
    }
    numbers.push_back(at->second);
    unseen.erase(at);
  }
  return numbers;
}

// What COLMAP is given: images/, features/, matches.txt and the cameras.
class Mapper {
 public:
  Mapper(const SfmPhotos& photos, const std::vector<ColmapPhoto>& listed,
         const SparseMatches& matches, const SfmOptions& options, fs::path folder)
      : photos_(photos), listed_(listed), options_(options), folder_(std::move(folder)) {
    remove_tree(folder_);
    make_folder(folder_);
    const std::vector<std::string> names = names_of(listed);
    for (size_t i = 0; i < names.size(); ++i) {
      write_image(photos.images[i], folder_ / "images" / names[i]);
      write_features(matches.features[i], folder_ / "features" / (names[i] + ".txt"));
    }
    write_match_list(matches.pairs, names, folder_ / "matches.txt");
  }

  // Runs with this first guess of unknown focal lengths; the folder of the model with most photos,
  // nothing if there is none.
  std::optional<fs::path> run(double focal_factor, ProgressStage& stage) const {
    const Colmap colmap(folder_);
    const std::string database = (folder_ / fmt::format("focal_{}.db", focal_factor)).string();
    const fs::path models = folder_ / fmt::format("focal_{}", focal_factor);
    make_folder(models);
    for (const bool before : {true, false}) import_epoch(colmap, before, focal_factor, database);
    colmap.run({"matches_importer", "--database_path", database, "--match_list_path",
                (folder_ / "matches.txt").string(), "--match_type", "raw", "--SiftMatching.use_gpu",
                "0", "--SiftMatching.num_threads", "1", "--SiftMatching.min_num_inliers",
                std::to_string(options_.min_pair_inliers)});
    const auto show = [&] {
      stage.advance(0.98 * colmap.placed() / static_cast<double>(listed_.size()));
    };
    const std::uintmax_t log_size = colmap.log_size();
    const ProgramEnd end = colmap.end_of({"mapper",
                                          "--database_path",
                                          database,
                                          "--image_path",
                                          (folder_ / "images").string(),
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
                                          std::to_string(options_.init_min_tri_angle_deg),
                                          "--Mapper.init_min_num_inliers",
                                          std::to_string(options_.init_min_num_inliers),
                                          "--Mapper.abs_pose_min_num_inliers",
                                          "20"},
                                         show);
    if (colmap.found_no_model(end, log_size)) return std::nullopt;
    if (!end.succeeded()) colmap.throw_failed("mapper", end);
    const std::optional<fs::path> best = largest_of(models);
    if (best) number_views(read_colmap_model(*best), names_of(listed_), colmap.log());
    return best;
  }

 private:
  static std::optional<fs::path> largest_of(const fs::path& models) {
    std::optional<fs::path> best;
    size_t most = 0;
    for (int i = 0; exists_at(models / std::to_string(i) / "points3D.bin"); ++i) {
      const fs::path model = models / std::to_string(i);
      size_t views = 0;
      try {
        views = read_colmap_model(model).views.size();
      } catch (const Error& error) {  // it does not look whether all could be written
        throw_error(ErrorCode::kUnavailable,
                    "colmap mapper: expected a model that can be read, found: {}; is the disk "
                    "full? run it again when it is not",
                    error.what());
      }
      if (views <= most) continue;
      most = views;
      best = model;
    }
    return best;
  }

  // The cameras whose focal length is to be guessed together, each of the others alone.
  void import_epoch(const Colmap& colmap, bool before, double focal_factor,
                    const std::string& database) const {
    std::set<double> known_factors;
    for (const ColmapPhoto& photo : listed_) {
      if (photo.before == before) known_factors.insert(photo.focal_factor);
    }
    int part = 0;
    for (const double known : known_factors) {
      std::vector<std::string> names;
      for (const ColmapPhoto& photo : listed_) {
        if (photo.before == before && photo.focal_factor == known) names.push_back(photo.name);
      }
      const std::string list =
          fmt::format("t{}{}.txt", before ? 1 : 2, part == 0 ? "" : fmt::format("_{}", part));
      import_photos(colmap, before, names, folder_ / list, known > 0 ? known : focal_factor,
                    database);
      ++part;
    }
  }

  void import_photos(const Colmap& colmap, bool before, const std::vector<std::string>& names,
                     const fs::path& list, double focal_factor, const std::string& database) const {
    const auto& known = before ? photos_.camera_t1 : photos_.camera_t2;
    std::ofstream out(list);
    for (const std::string& name : names) out << name << "\n";
    if (!out.flush()) throw_error(ErrorCode::kOutput, "{}: cannot be written", list.string());
    std::vector<std::string> arguments = {"feature_importer",
                                          "--database_path",
                                          database,
                                          "--image_path",
                                          (folder_ / "images").string(),
                                          "--image_list_path",
                                          list.string(),
                                          "--import_path",
                                          (folder_ / "features").string(),
                                          "--ImageReader.single_camera_per_folder",
                                          "1",
                                          "--ImageReader.camera_model",
                                          known ? "SIMPLE_PINHOLE" : "SIMPLE_RADIAL"};
    if (known) {
      arguments.insert(arguments.end(), {"--ImageReader.camera_params",
                                         fmt::format("{},{},{}", known->focal_px, known->cx + 0.5,
                                                     known->cy + 0.5)});
    } else {
      arguments.insert(arguments.end(),
                       {"--ImageReader.default_focal_length_factor", std::to_string(focal_factor)});
    }
    colmap.run(arguments);
  }

  const SfmPhotos& photos_;
  const std::vector<ColmapPhoto>& listed_;
  const SfmOptions& options_;
  fs::path folder_;
};

// Stage 1: key points and matches, from scratch/matches.npz if they are there.
SparseMatches find_matches(const std::vector<Image>& images, const SfmOptions& options,
                           const fs::path& scratch, ProgressSink& progress) {
  const fs::path kept = scratch / kMatches;
  if (is_kept(scratch, kMatches)) return read_matches(kept);
  SparseMatches matches;
  {
    ProgressStage stage(progress, "key points");
    matches.features = extract_features(images, options.max_features, stage);
  }
  ProgressStage stage(progress, "matching");
  matches.pairs = match_all(matches.features, options.min_pair_inliers, stage);
  write_matches(kept, matches);
  keep(scratch, kMatches);
  return read_matches(kept);  // what is kept is what is used
}

// The largest model of two first guesses of unknown focal lengths; nothing if neither gives one.
std::optional<fs::path> best_model(const Mapper& mapper, size_t photos, ProgressStage& stage) {
  constexpr double kEnough = 0.9;
  std::optional<fs::path> best;
  size_t most = 0;
  for (const double focal_factor : {1.2, 0.85}) {
    const std::optional<fs::path> found = mapper.run(focal_factor, stage);
    const size_t views = found ? read_colmap_model(*found).views.size() : 0;
    if (views > most) {
      most = views;
      best = found;
    }
    if (static_cast<double>(views) >= kEnough * static_cast<double>(photos)) break;
  }
  return best;
}

// Stage 2: COLMAP's model, from scratch/model if it is kept; or that there is none, if that is what
// the photos gave.
SfmModel find_model(const SfmPhotos& photos, const std::vector<ColmapPhoto>& listed,
                    const SparseMatches& matches, const SfmOptions& options,
                    const fs::path& scratch, ProgressSink& progress) {
  if (is_kept(scratch, kNoModel)) return {};
  const fs::path kept = scratch / kModel;
  if (!is_kept(scratch, kModel)) {
    ProgressStage stage(progress, "structure from motion");
    const Mapper mapper(photos, listed, matches, options, scratch / "colmap");
    const std::optional<fs::path> best = best_model(mapper, listed.size(), stage);
    if (!best) {
      write_text_file(scratch / kNoModel, "COLMAP's mapper found no model of these photos.\n");
      keep(scratch, kNoModel);
      return {};
    }
    remove_tree(kept);
    move_to(*best, kept);
    keep(scratch, kModel);
  }
  return read_colmap_model(kept);
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

void require_colmap() { require_program("colmap", kRemedy); }

SfmResult structure_from_motion(SfmPhotos photos, const SfmOptions& options,
                                const fs::path& scratch, ProgressSink& progress) {
  options.validate();
  make_folder(scratch);
  check(photos.exif.size() == photos.images.size(), "structure_from_motion: EXIF of each photo");
  const std::vector<ColmapPhoto> listed = colmap_photos(photos);
  const std::vector<std::string> names = names_of(listed);
  SparseMatches matches = find_matches(photos.images, options, scratch, progress);
  SfmResult result;
  result.model = find_model(photos, listed, matches, options, scratch, progress);
  result.pairs = std::move(matches.pairs);
  result.reduced = std::move(photos.images);
  result.photo_of_view = number_views(result.model, names, scratch / "model");
  return result;
}

}  // namespace vggtcd
