// SPDX-License-Identifier: Apache-2.0
// One reconstructor per number of keyframes, over the same kept passes of the epochs.
#include "vggtcd/pipeline/predict_epochs.h"

#include <algorithm>

#include "vggtcd/core/timer.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/io/kept_files.h"
#include "vggtcd/io/output_directory.h"
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

// What says from which photos and by which network the files are, and where they are made.
constexpr const char* kNote = "photos.json";
constexpr const char* kWork = ".work";

OutputContents contents_of(const std::vector<JointPass>& joints) {
  OutputContents contents{"predictions", {kNote}};
  for (const auto& epoch : kEpochs) contents.names.push_back(epoch.file);
  for (const JointPass& joint : joints) contents.names.push_back(joint.file);
  return contents;
}

bool is_of(const fs::path& note, const Json& made_from) {
  if (!exists_at(note)) return false;
  try {
    return read_json_file(note) == made_from;
  } catch (const Error&) {
    return false;  // damaged: made again
  }
}

// Leaves nothing in the directory that was made from other photos or by another network.
void claim(const fs::path& directory, const Json& made_from, const std::vector<JointPass>& joints) {
  OutputDirectory::check_usable(directory, contents_of(joints));  // what is there is whole
  if (is_of(directory / kNote, made_from)) return;
  OutputDirectory replaced(directory, contents_of(joints));
  remove_tree(directory / kWork);
  write_json_file(replaced / kNote, made_from);
  replaced.commit();
}

// The epochs that are there already, as the reconstructor finds them again.
void provide_epochs(const fs::path& directory, const fs::path& work) {
  make_folder(work);
  for (const auto& epoch : kEpochs) {
    if (!exists_at(directory / epoch.file) || is_kept(work, epoch.scratch)) continue;
    remove_tree(work / epoch.scratch);
    copy_unless_there(directory / epoch.file, work / epoch.scratch);
    keep(work, epoch.scratch);
  }
}

// The joint pass, and the epochs that are not there yet.
void put_in_place(const fs::path& work, const fs::path& directory, const JointPass& joint) {
  OutputContents contents{"predictions", {joint.file}, true};
  for (const auto& epoch : kEpochs) {
    if (!exists_at(directory / epoch.file)) contents.names.push_back(epoch.file);
  }
  OutputDirectory out(directory, contents);
  move_to(work / "joint.npz", out / joint.file);
  for (const auto& epoch : kEpochs) {
    if (!exists_at(directory / epoch.file)) move_to(work / epoch.scratch, out / epoch.file);
  }
  out.commit();
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
  const fs::path work = directory / kWork;
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
    provide_epochs(directory, work);
    remove_tree(work / "joint.npz");  // of another number of keyframes
    reconstructor.reconstruct(photos, work, progress);
    put_in_place(work, directory, joint);
  }
  remove_tree(work);
}

}  // namespace vggtcd
