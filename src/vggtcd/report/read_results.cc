// SPDX-License-Identifier: Apache-2.0
// What `detect` left in its directory, read back for the report page.
#include "vggtcd/report/read_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "vggtcd/core/error.h"
#include "vggtcd/io/colmap.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/image_file.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/io/ply.h"
#include "vggtcd/report/heat_map.h"
#include "vggtcd/report/overlay_names.h"
#include "vggtcd/scene/local_frame.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

Eigen::Vector3d three_numbers(const Json& json, const std::string& where) {
  const bool good = json.is_array() && json.size() == 3 &&
                    std::ranges::all_of(json, [](const Json& item) { return item.is_number(); });
  if (!good) throw_error(ErrorCode::kInput, "{}: expected 3 numbers", where);
  return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

double positive_member(const Json& json, std::string_view key, const fs::path& file) {
  const Json& value = json_member(json, key, file.string());
  if (!value.is_number() || !(value.get<double>() > 0)) {
    throw_error(ErrorCode::kInput, "{}: {}: expected a positive number, found {}", file.string(),
                key, value.dump());
  }
  return value.get<double>();
}

// "m", or "u" where nothing is said.
std::string unit_of(const Json& change, const fs::path& file) {
  const auto unit = change.find("unit");
  if (unit == change.end() || *unit == "u") return "u";
  if (*unit == "m") return "m";
  throw_error(ErrorCode::kInput, "{}: change: unit: expected \"u\" or \"m\", found {}",
              file.string(), unit->dump());
}

// Where the results' coordinates are large, the place that the page is drawn about.
Eigen::Vector3d origin_of(const Json& change, const std::string& unit, const fs::path& file) {
  const std::string key = "origin_" + unit;
  const auto origin = change.find(key);
  if (origin == change.end()) return Eigen::Vector3d::Zero();
  return three_numbers(*origin, fmt::format("{}: change: {}", file.string(), key));
}

// The list of changes about that place.
Json moved_near(Json changes, const Eigen::Vector3d& origin, const fs::path& file) {
  if (origin.isZero(0) || !changes.is_array()) return changes;
  const auto move = [&](Json& thing) {
    if (!thing.is_object() || !thing.contains("center")) return;
    const Eigen::Vector3d center = three_numbers(thing["center"], file.string() + ": center");
    const Eigen::Vector3d near = center - origin;
    thing["center"] = {near.x(), near.y(), near.z()};
  };
  for (Json& change : changes) {
    move(change);
    for (const char* epoch : {"before", "after"}) {
      if (change.is_object() && change.contains(epoch)) move(change[epoch]);
    }
  }
  return changes;
}

std::string input_name(const Json& summary, const char* epoch) {
  const Json::json_pointer path(fmt::format("/inputs/{}/file", epoch));
  return summary.contains(path) && summary[path].is_string() ? summary[path].get<std::string>()
                                                             : epoch;
}

ReportCloud read_cloud(const fs::path& path, const Eigen::Vector3d& origin) {
  const auto ply = std::make_shared<const PlyReader>(path);
  const auto has = [&](const char* name) {
    return std::ranges::find(ply->fields(), name) != ply->fields().end();
  };
  if (!has("change_distance")) {
    throw_error(ErrorCode::kInput,
                "{}: expected a scalar field change_distance, found none; is this a "
                "result of vggt-cd detect?",
                path.string());
  }
  ReportCloud cloud;
  cloud.size = ply->size();
  cloud.has_labels = has("label");
  std::vector<std::string> fields = {"change_distance"};
  if (cloud.has_labels) fields.push_back("label");
  cloud.for_each_block = [ply, fields, origin](const auto& sink) {
    ReportPoints points;
    const auto take = [&](const PlyCloud& block) {
      points.positions = block.positions;
      points.color = block.rgb;
      if (points.color.empty()) points.color.assign(3 * points.positions.size(), 128);
      points.change_distance = block.fields[0].values;
      points.label.clear();
      for (size_t i = 0; fields.size() > 1 && i < points.positions.size(); ++i) {
        const float value = block.fields[1].values[i];
        points.label.push_back(value >= 0 && value <= 4 ? static_cast<uint8_t>(value) : uint8_t{3});
      }
      sink(points);
    };
    ply->read(fields, take, origin);
  };
  return cloud;
}

// The cameras of one epoch in the order in which detect wrote them: that of the frames.
void add_photos(const ColmapModel& model, std::string_view prefix, const fs::path& file,
                const Eigen::Vector3d& origin, ReportEpoch& epoch) {
  for (const auto& [id, image] : model.images) {
    if (!image.name.starts_with(prefix)) continue;
    ReportPhoto photo;
    photo.name = image.name.substr(prefix.size());
    photo.camera_from_world = camera_from_world(image.camera_from_world, -origin);
    const auto camera = model.cameras.find(image.camera_id);
    if (camera != model.cameras.end() && camera->second.model == "PINHOLE") {
      const std::vector<double>& p =
          camera->second.params;  // COLMAP's first pixel centre: (0.5, 0.5)
      photo.pinhole = Pinhole{p.at(0),
                              p.at(1),
                              p.at(2) - 0.5,
                              p.at(3) - 0.5,
                              static_cast<int>(camera->second.width),
                              static_cast<int>(camera->second.height)};
    }
    epoch.photos.push_back(std::move(photo));
  }
  const size_t frames =
      epoch.score.size() / (static_cast<size_t>(epoch.width) * static_cast<size_t>(epoch.height));
  if (epoch.photos.size() != frames) {
    throw_error(ErrorCode::kInput, "{}: expected the {} cameras {}* of change.npz, found {}",
                file.string(), frames, prefix, epoch.photos.size());
  }
}

void read_scores(const NpzReader& npz, const std::string& key, ReportEpoch& epoch) {
  npz.expect_shape(key, std::vector<int64_t>{-1, -1, -1});
  const auto& shape = npz.header(key).shape;
  if (std::ranges::any_of(shape, [](int64_t size) { return size == 0 || size > 100000; })) {
    throw_error(ErrorCode::kInput, "{}: {}: expected 1 to 100000 frames, rows and columns",
                npz.name(), key);
  }
  epoch.height = static_cast<int>(shape[1]);
  epoch.width = static_cast<int>(shape[2]);
  epoch.score = npz.read<float>(key);
}

void read_labels(const NpzReader& npz, const std::string& key, ReportEpoch& epoch) {
  if (!npz.has(key)) return;
  npz.expect_shape(key, std::vector<int64_t>{static_cast<int64_t>(epoch.photos.size()),
                                             epoch.height, epoch.width});
  epoch.label = npz.read<uint8_t>(key);
}

// The left part of an overlay is the photo, each pixel overlay_zoom() times as large.
Image read_photo(const fs::path& overlay, int width, int height) {
  if (!exists_at(overlay)) return {};
  const Image whole = read_image(overlay);
  const int zoom = overlay_zoom(width, height);
  if (whole.width < zoom * width || whole.height < zoom * height) {
    throw_error(ErrorCode::kInput,
                "{}: expected at least {} x {} px for the frames of change.npz, found {} x {}",
                overlay.string(), zoom * width, zoom * height, whole.width, whole.height);
  }
  Image photo(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      std::copy_n(whole.pixel(zoom * x, zoom * y), 3, photo.pixel(x, y));
    }
  }
  return photo;
}

std::function<Image(int)> photo_reader(const fs::path& overlays, const ReportEpoch& epoch) {
  std::vector<std::string> names;
  for (const ReportPhoto& photo : epoch.photos) names.push_back(photo.name);
  std::vector<fs::path> paths;
  for (const std::string& name : overlay_names(names)) paths.push_back(overlays / name);
  return [paths, width = epoch.width, height = epoch.height](int i) {
    return read_photo(paths[static_cast<size_t>(i)], width, height);
  };
}

}  // namespace

ReportInput read_results(const fs::path& directory) try {
  const fs::path summary_path = directory / "summary.json";
  if (!exists_at(summary_path)) {
    throw_error(ErrorCode::kInput,
                "{}: expected a result directory of vggt-cd detect, found no summary.json",
                directory.string());
  }
  ReportInput input;
  input.summary = read_json_file(summary_path);
  if (exists_at(directory / "sim3.json")) input.sim3 = read_json_file(directory / "sim3.json");
  const Json& change = json_member(input.summary, "change", summary_path.string());
  input.unit = unit_of(change, summary_path);
  input.origin = origin_of(change, input.unit, summary_path);
  if (const fs::path list = directory / "changes.json"; exists_at(list)) {
    input.changes =
        moved_near(json_member(read_json_file(list), "changes", list.string()), input.origin, list);
  }
  input.extent_u = positive_member(change, "scene_extent_" + input.unit, summary_path);
  input.threshold_u = positive_member(change, "threshold_" + input.unit, summary_path);
  input.bound_u = positive_member(change, "bound_" + input.unit, summary_path);
  input.title = fmt::format("{} → {}", input_name(input.summary, "before"),
                            input_name(input.summary, "after"));

  const NpzReader npz(directory / "change.npz");
  const ColmapModel model = read_colmap(directory / "colmap");
  const auto read_epoch = [&](const char* name, const std::string& suffix, const char* cloud,
                              ReportEpoch& epoch) {
    read_scores(npz, "score_" + suffix, epoch);
    add_photos(model, fmt::format("{}/", name), directory / "colmap", input.origin, epoch);
    read_labels(npz, "label_" + suffix, epoch);
    epoch.cloud = read_cloud(directory / cloud, input.origin);
    epoch.image = photo_reader(directory / "overlays" / name, epoch);
  };
  read_epoch("before", "t1", "before_aligned.ply", input.before);
  read_epoch("after", "t2", "after.ply", input.after);
  return input;
} catch (...) {
  rethrow_naming(directory);
}

}  // namespace vggtcd
