// SPDX-License-Identifier: Apache-2.0
// Reading the WAT layout.
#include "vggtcd/evaluation/wat.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "vggtcd/core/error.h"
#include "vggtcd/evaluation/paper_numbers.h"
#include "vggtcd/io/colmap.h"
#include "vggtcd/io/file_system.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

bool is_photo(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".jpg" || extension == ".jpeg" || extension == ".png";
}

std::vector<Rigid3> poses_of_sequence(const std::map<std::string, Rigid3>& registered,
                                      const WatSequence& sequence, const Reconstruction& epoch,
                                      const fs::path& scene) {
  const std::string prefix = sequence.name + "/";
  std::vector<Rigid3> poses;
  const bool named = std::all_of(epoch.views.begin(), epoch.views.end(), [&](const View& view) {
    return registered.contains(prefix + fs::path(view.name).filename().string());
  });
  if (!named && epoch.views.size() != sequence.photos.size()) {
    throw_error(
        ErrorCode::kInput,
        "{}: expected predictions whose frame names are photos of sequence '{}', or as many "
        "frames as its {} photos; found {} frames, the first named '{}'",
        scene.string(), sequence.name, sequence.photos.size(), epoch.views.size(),
        epoch.views.empty() ? "" : epoch.views[0].name);
  }
  for (size_t k = 0; k < epoch.views.size(); ++k) {
    const std::string name =
        prefix + (named ? fs::path(epoch.views[k].name).filename().string() : sequence.photos[k]);
    const auto found = registered.find(name);
    if (found == registered.end()) {
      throw_error(ErrorCode::kInput,
                  "{}: expected a COLMAP pose for {}, found none; leave the photo "
                  "out of the predictions",
                  (scene / "sparse" / "0").string(), name);
    }
    poses.push_back(found->second);
  }
  return poses;
}

std::map<std::string, Rigid3> registered_poses(const fs::path& scene_directory) {
  std::map<std::string, Rigid3> registered;
  for (const NamedPose& pose : read_colmap_trajectory(scene_directory / "sparse" / "0")) {
    registered[pose.name] = pose.camera_from_world;
  }
  return registered;
}

}  // namespace

std::vector<WatSequence> list_wat_sequences(const fs::path& scene_directory) {
  std::vector<WatSequence> sequences;
  const fs::path images = scene_directory / "images";
  for (const fs::path& entry : list_folder(images)) {
    if (!is_folder(entry)) continue;
    WatSequence sequence{entry.filename().string(), {}};
    for (const fs::path& file : list_folder(entry)) {
      if (is_photo(file)) sequence.photos.push_back(file.filename().string());
    }
    std::sort(sequence.photos.begin(), sequence.photos.end());
    if (!sequence.photos.empty()) sequences.push_back(std::move(sequence));
  }
  std::sort(sequences.begin(), sequences.end(),
            [](const WatSequence& a, const WatSequence& b) { return a.name < b.name; });
  // Generated scenes name their sequences by what they are, not by order.
  if (sequences.size() == 2 && sequences[0].name == "after" && sequences[1].name == "before") {
    std::swap(sequences[0], sequences[1]);
  }
  if (sequences.size() < 2) {
    throw_error(ErrorCode::kInput,
                "{}: expected a folder of photos per sequence, at least 2, found {}",
                images.string(), sequences.size());
  }
  return sequences;
}

std::vector<std::string> list_wat_scenes(const fs::path& data) {
  std::vector<std::string> found;
  for (const fs::path& entry : list_folder(data)) {
    if (is_folder(entry / "images") && is_folder(entry / "sparse" / "0")) {
      found.push_back(entry.filename().string());
    }
  }
  if (found.empty()) {
    throw_error(ErrorCode::kInput,
                "{}: expected scenes as SCENE/images and SCENE/sparse/0, found none",
                data.string());
  }
  const auto rank = [](const std::string& name) {
    const auto names = wat_scene_names();
    return std::find(names.begin(), names.end(), name) - names.begin();
  };
  std::sort(found.begin(), found.end(), [&](const std::string& a, const std::string& b) {
    return std::pair(rank(a), a) < std::pair(rank(b), b);
  });
  return found;
}

WatPhotos list_wat_photos(const fs::path& scene_directory) {
  const std::vector<WatSequence> sequences = list_wat_sequences(scene_directory);
  const std::map<std::string, Rigid3> registered = registered_poses(scene_directory);
  const auto photos_of = [&](const WatSequence& sequence) {
    std::vector<fs::path> photos;
    for (const std::string& name : sequence.photos) {
      if (registered.contains(sequence.name + "/" + name)) {
        photos.push_back(scene_directory / "images" / sequence.name / name);
      }
    }
    if (photos.size() < 2) {
      throw_error(ErrorCode::kInput,
                  "{}: expected at least 2 photos of sequence '{}' with a COLMAP pose, found {}",
                  scene_directory.string(), sequence.name, photos.size());
    }
    return photos;
  };
  return {photos_of(sequences[0]), photos_of(sequences[1])};
}

std::string wat_joint_name(int keyframes) {
  return keyframes == 0 ? "joint_all.npz" : fmt::format("joint_{}.npz", keyframes);
}

BitemporalTrajectory read_wat_truth(const fs::path& scene_directory, const Reconstruction& before,
                                    const Reconstruction& after) {
  const std::vector<WatSequence> sequences = list_wat_sequences(scene_directory);
  const std::map<std::string, Rigid3> registered = registered_poses(scene_directory);
  return {poses_of_sequence(registered, sequences[0], before, scene_directory),
          poses_of_sequence(registered, sequences[1], after, scene_directory)};
}

}  // namespace vggtcd
