// SPDX-License-Identifier: Apache-2.0
// One reconstructor per number of keyframes, over the same kept passes of the epochs.
#include "vggtcd/pipeline/predict_epochs.h"

#include <algorithm>

#include "vggtcd/core/timer.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/reconstruction/vggt_reconstructor.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

// The epochs' files here, and what the reconstructor calls them in its scratch folder.
constexpr struct {
  const char* file;
  const char* scratch;
} kEpochs[] = {{"t1.npz", "before.npz"}, {"t2.npz", "after.npz"}};

std::vector<PhotoRef> references(const std::vector<fs::path>& paths) {
  std::vector<PhotoRef> photos;
  for (const fs::path& path : paths) photos.push_back({path, path.filename().string(), nullptr});
  return photos;
}

Json identity(const PhotoEpochs& photos, const VggtReconstructor& network) {
  Json json{{"network", network.fingerprint()}};
  for (const auto& [key, epoch] : {std::pair("t1", &photos.before), {"t2", &photos.after}}) {
    Json list = Json::array();
    for (const PhotoRef& photo : epoch->photos) {
      list.push_back(fmt::format("{} {:016x}", photo.name, content_hash(photo)));
    }
    json[key] = std::move(list);
  }
  return json;
}

// Leaves nothing in the directory that was made from other photos or by another network.
void claim(const fs::path& directory, const Json& made_from, const std::vector<JointPass>& joints) {
  make_folder(directory);
  const fs::path note = directory / "photos.json";
  if (exists_at(note) && read_json_file(note) == made_from) return;
  remove_tree(directory / "work");
  for (const auto& epoch : kEpochs) remove_tree(directory / epoch.file);
  for (const JointPass& joint : joints) remove_tree(directory / joint.file);
  write_json_file(note, made_from);
}

}  // namespace

void predict_epochs(const PhotoPaths& paths, const fs::path& weights, const VggtOptions& network,
                    const std::vector<JointPass>& joints, const fs::path& directory,
                    ProgressSink& progress) {
  check(!joints.empty(), "predict_epochs: at least one joint pass");
  const PhotoEpochs photos{
      {references(paths.before), nullptr}, {references(paths.after), nullptr}, {}};
  // Keyframes are in the names of the files, so they are left out of what identifies the epochs.
  claim(
      directory,
      identity(photos, VggtReconstructor({.weights = weights, .keyframes = 0, .network = network})),
      joints);
  const fs::path work = directory / "work";
  const int all = static_cast<int>(std::max(paths.before.size(), paths.after.size()));
  for (const JointPass& joint : joints) {
    const bool complete = exists_at(directory / joint.file) &&
                          exists_at(directory / kEpochs[0].file) &&
                          exists_at(directory / kEpochs[1].file);
    if (complete) continue;
    const VggtReconstructor reconstructor(
        {.weights = weights,
         .keyframes = joint.keyframes == 0 ? all : joint.keyframes,
         .network = network});
    const int64_t needed = reconstructor.plan(photos).memory_bytes;
    if (&joint != &joints.front() && needed > available_memory_bytes()) {
      progress.notice(fmt::format("{}: left out, its pass needs {:.1f} GB of memory",
                                  (directory / joint.file).string(),
                                  static_cast<double>(needed) * 1e-9));
      continue;
    }
    make_folder(work);
    for (const auto& epoch : kEpochs) {
      if (!exists_at(directory / epoch.file)) continue;
      copy_unless_there(directory / epoch.file, work / epoch.scratch);
    }
    remove_tree(work / "joint.npz");
    reconstructor.reconstruct(photos, work, progress);
    move_to(work / "joint.npz", directory / joint.file);
    for (const auto& epoch : kEpochs) {
      if (!exists_at(directory / epoch.file)) {
        move_to(work / epoch.scratch, directory / epoch.file);
      }
    }
  }
  remove_tree(work);
}

}  // namespace vggtcd
