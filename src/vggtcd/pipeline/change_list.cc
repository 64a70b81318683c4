// SPDX-License-Identifier: Apache-2.0
// The list of changed things as files: changes.json, changes.csv (docs/formats.md).
#include "vggtcd/pipeline/change_list.h"

#include <fmt/format.h>

#include "vggtcd/io/output_file.h"

namespace vggtcd {
namespace {

Json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json rows_json(const Eigen::Matrix3d& m) {
  return {vector_json(m.row(0)), vector_json(m.row(1)), vector_json(m.row(2))};
}

const std::string& photo_name(const Reconstruction& epoch, const InstancePhoto& photo) {
  return epoch.views[static_cast<size_t>(photo.frame)].name;
}

// Why it is taken for a thing.
Json signs_json(const ThingSigns& signs) {
  return {{"pixel_confidence", signs.pixel_confidence},
          {"gap_sigmas", signs.evidence},
          {"seen_through", signs.seen_through},
          {"called_changed", signs.called_changed},
          {"fill", signs.fill},
          {"length", signs.length},
          {"width", signs.width},
          {"photos", signs.photos},
          {"photos_with_body", signs.photos_with_body},
          {"body", signs.body},
          {"at_edge", signs.at_edge}};
}

Json part_json(const InstancePart& part, const Reconstruction& epoch) {
  Json photos = Json::array();
  for (const InstancePhoto& photo : part.photos) {
    photos.push_back({{"name", photo_name(epoch, photo)},
                      {"frame", photo.frame},
                      {"pixels", photo.pixels},
                      {"evidence", photo.evidence}});
  }
  return {{"center", vector_json(part.box.center)},
          {"rotation", rows_json(part.box.rotation)},
          {"size", vector_json(part.box.size)},
          {"volume_u3", part.volume_u3},
          {"volume_sigma_u3", part.volume_sigma_u3},
          {"surface_u2", part.surface_u2},
          {"surface_sigma_u2", part.surface_sigma_u2},
          {"confidence", part.confidence},
          {"pixels", part.pixels},
          {"signs", signs_json(part.signs)},
          {"photos", photos}};
}

int64_t pixels_of(const ChangeInstance& instance) {
  return (instance.before ? instance.before->pixels : 0) +
         (instance.after ? instance.after->pixels : 0);
}

Json instance_json(const ChangeInstance& instance, size_t id, const Reconstruction& before,
                   const Reconstruction& after, int64_t changed_pixels) {
  const InstancePart& main = instance.main();
  Json json = {{"id", id},
               {"class", enum_to_string(instance.kind)},
               {"center", vector_json(main.box.center)},
               {"size", vector_json(main.box.size)},
               {"volume_u3", main.volume_u3},
               {"volume_sigma_u3", main.volume_sigma_u3},
               {"confidence", instance.confidence()},
               {"share", static_cast<double>(pixels_of(instance)) /
                             static_cast<double>(std::max<int64_t>(1, changed_pixels))}};
  if (instance.before && instance.after) {
    json["moved_by_u"] = (instance.after->box.center - instance.before->box.center).norm();
  }
  if (instance.before) json["before"] = part_json(*instance.before, before);
  if (instance.after) json["after"] = part_json(*instance.after, after);
  return json;
}

// A field of RFC 4180.
std::string csv_text(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string best_photo(const std::optional<InstancePart>& part, const Reconstruction& epoch) {
  return part && !part->photos.empty() ? csv_text(photo_name(epoch, part->photos.front())) : "";
}

std::string csv_line(const ChangeInstance& instance, size_t id, const Reconstruction& before,
                     const Reconstruction& after) {
  const InstancePart& main = instance.main();
  const Eigen::Vector3d &c = main.box.center, &s = main.box.size;
  return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", id,
                     enum_to_string(instance.kind), instance.confidence(), main.volume_u3,
                     main.volume_sigma_u3, main.surface_u2, main.surface_sigma_u2, c.x(), c.y(),
                     c.z(), s.x(), s.y(), s.z(), instance.before ? instance.before->pixels : 0,
                     instance.after ? instance.after->pixels : 0,
                     best_photo(instance.before, before), best_photo(instance.after, after));
}

}  // namespace

void write_change_list(const std::filesystem::path& directory, const ChangeInstances& instances,
                       const Reconstruction& before, const Reconstruction& after,
                       const ChangeSet& changes, const ResultFrame& frame) {
  Json json = {{"frame", frame.name},
               {"unit", frame.unit},
               {"scene_extent_u", changes.scene_extent_u},
               {"voxel_size_u", instances.voxel_size_u},
               {"unsure_regions", instances.unsure},
               {"unsure_confidence", instances.unsure_confidence},
               {"changes", Json::array()}};
  std::string csv;
  for (const char* column :
       {"id", "class", "confidence", "volume_u3", "volume_sigma_u3", "surface_u2",
        "surface_sigma_u2", "center_x_u", "center_y_u", "center_z_u", "size_1_u", "size_2_u",
        "size_3_u", "pixels_before", "pixels_after", "best_photo_before", "best_photo_after"}) {
    csv += (csv.empty() ? "" : ",") + frame.key(column);
  }
  csv += '\n';
  for (size_t i = 0; i < instances.instances.size(); ++i) {
    const ChangeInstance& instance = instances.instances[i];
    json["changes"].push_back(
        instance_json(instance, i + 1, before, after, changes.t1.changed + changes.t2.changed));
    csv += csv_line(instance, i + 1, before, after);
  }
  write_json_file(directory / "changes.json", frame.renamed(json));
  write_text_file(directory / "changes.csv", csv);
}

}  // namespace vggtcd
