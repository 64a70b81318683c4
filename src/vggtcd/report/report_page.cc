// SPDX-License-Identifier: Apache-2.0
// The report page: one HTML file that shows the change (docs/formats.md, "report.html").
#include "vggtcd/report/report_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "vggtcd/core/version.h"
#include "vggtcd/io/output_file.h"
#include "vggtcd/report/base64.h"
#include "vggtcd/report/page_template.h"
#include "vggtcd/report/photo_codec.h"
#include "vggtcd/report/point_codec.h"

namespace vggtcd {
namespace {

using Json = nlohmann::ordered_json;

// Collects the binary blocks; JSON refers to them by number.
class Blocks {
 public:
  size_t add(std::string_view bytes) {
    encoded_.push_back(base64_encode(bytes));
    return encoded_.size() - 1;
  }
  const std::vector<std::string>& encoded() const { return encoded_; }

 private:
  std::vector<std::string> encoded_;
};

void check_input(const ReportInput& input) {
  check(input.threshold_u > 0 && input.extent_u > 0, "write_report: positive threshold and extent");
  for (const ReportEpoch* epoch : {&input.before, &input.after}) {
    check(epoch->cloud.for_each_block != nullptr, "write_report: a cloud, if an empty one");
    const size_t pixels = epoch->photos.size() * static_cast<size_t>(epoch->width) *
                          static_cast<size_t>(epoch->height);
    check(epoch->score.empty() || epoch->score.size() == pixels,
          "write_report: size of the scores");
    check(epoch->label.empty() || epoch->label.size() == epoch->score.size(),
          "write_report: a label for every score or none");
  }
}

std::string_view epoch_name(bool after) { return after ? "after" : "before"; }

struct PhotoSet {
  std::vector<EncodedPhoto> before, after;
  size_t bytes() const {
    size_t sum = 0;
    for (const auto* photos : {&before, &after}) {
      for (const EncodedPhoto& photo : *photos) sum += photo.bytes();
    }
    return sum;
  }
};

// Smaller and smaller until they fit: first the maps, of which a half is enough to see the shape of
// a change, then the photos as well.
PhotoSet encode_within(const ReportInput& input, const LevelScale& scale, int64_t max_bytes) {
  PhotoQuality quality;
  PhotoSet photos;
  for (int attempt = 0; attempt < 6; ++attempt) {
    photos = {encode_photos(input.before, scale, quality),
              encode_photos(input.after, scale, quality)};
    const double ratio =
        static_cast<double>(max_bytes) / std::max<double>(1, static_cast<double>(photos.bytes()));
    if (ratio >= 1) break;
    if (attempt == 0) {
      quality = {1.0, 0.5, 80};
    } else {
      const double shrink = std::clamp(0.95 * std::sqrt(ratio), 0.1, 0.9);
      quality = {quality.photo_scale * shrink, quality.heat_scale * shrink, 70};
    }
  }
  return photos;
}

Json photo_json(const ReportPhoto& photo, const EncodedPhoto& encoded, bool after, Blocks& blocks) {
  Json json = {{"epoch", epoch_name(after)},
               {"name", photo.name},
               {"width", encoded.width},
               {"height", encoded.height},
               {"camera_from_world", nullptr},
               {"intrinsics", nullptr},
               {"image", nullptr},
               {"heat", nullptr},
               {"pixels", encoded.pixels},
               {"changed", encoded.changed}};
  if (photo.camera_from_world) {
    Json pose = Json::array();
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 3; ++col) pose.push_back(photo.camera_from_world->rotation(row, col));
      pose.push_back(photo.camera_from_world->translation[row]);
    }
    json["camera_from_world"] = pose;
  }
  if (photo.pinhole && photo.pinhole->width > 0 && photo.pinhole->height > 0) {
    // Pixel centres are integers: u + 1/2 scales with the width.
    const double x = encoded.width / static_cast<double>(photo.pinhole->width);
    const double y = encoded.height / static_cast<double>(photo.pinhole->height);
    json["intrinsics"] = {photo.pinhole->fx * x, photo.pinhole->fy * y,
                          (photo.pinhole->cx + 0.5) * x - 0.5, (photo.pinhole->cy + 0.5) * y - 0.5};
  }
  if (!encoded.jpeg.empty()) {
    json["image"] = {{"type", "image/jpeg"}, {"block", blocks.add(encoded.jpeg)}};
  }
  if (encoded.heat_width > 0) {
    Json heat = {{"width", encoded.heat_width},
                 {"height", encoded.heat_height},
                 {"level", blocks.add(encoded.heat_level)}};
    if (!encoded.heat_label.empty()) heat["label"] = blocks.add(encoded.heat_label);
    json["heat"] = heat;
  }
  return json;
}

Json cloud_json(const ReportCloud& cloud, const Candidates& candidates, const EncodedCloud& encoded,
                int64_t changed_shown, bool after, Blocks& blocks) {
  const auto& [min, size] = candidates.box;
  Json json = {{"epoch", epoch_name(after)},
               {"points", cloud.size},
               {"shown", encoded.points},
               {"changed", candidates.all_changed},
               {"changed_shown", changed_shown},
               {"far_away", candidates.far_away},
               {"box_min", {min.x(), min.y(), min.z()}},
               {"box_size", {size.x(), size.y(), size.z()}},
               {"position", blocks.add(encoded.position)},
               {"color", blocks.add(encoded.color)},
               {"level", blocks.add(encoded.level)}};
  if (cloud.has_labels) json["label"] = blocks.add(encoded.label);
  return json;
}

struct CloudPair {
  Shares shares;
  EncodedCloud before, after;
  size_t bytes() const {
    size_t sum = 0;
    for (const EncodedCloud* c : {&before, &after}) {
      sum += c->position.size() + c->color.size() + c->level.size() + c->label.size();
    }
    return sum;
  }
};

EncodedCloud encode_share(const ReportCloud& cloud, const Candidates& candidates, int64_t changed,
                          int64_t unchanged, const LevelScale& scale) {
  std::vector<uint32_t> chosen = spread_sample(candidates.changed, changed);
  const std::vector<uint32_t> rest = spread_sample(candidates.unchanged, unchanged);
  chosen.insert(chosen.end(), rest.begin(), rest.end());
  return encode_cloud(cloud, std::move(chosen), candidates.box, scale);
}

// As many points as allowed that fit into max_bytes.
CloudPair encode_within(const ReportInput& input, const Candidates& before, const Candidates& after,
                        const LevelScale& scale, int64_t max_points, int64_t max_bytes) {
  CloudPair clouds;
  for (int attempt = 0; attempt < 6; ++attempt) {
    clouds.shares = share_points(before, after, max_points);
    const Shares& s = clouds.shares;
    clouds.before =
        encode_share(input.before.cloud, before, s.changed_before, s.unchanged_before, scale);
    clouds.after =
        encode_share(input.after.cloud, after, s.changed_after, s.unchanged_after, scale);
    const double ratio = static_cast<double>(std::max<int64_t>(max_bytes, 0)) /
                         std::max<double>(1, static_cast<double>(clouds.bytes()));
    if (ratio >= 1) break;
    const int64_t shown = clouds.before.points + clouds.after.points;
    max_points = attempt == 4 ? 0 : static_cast<int64_t>(0.97 * ratio * static_cast<double>(shown));
  }
  return clouds;
}

// How many pixels have each label; others have no evidence.
std::array<int64_t, 5> count_labels(std::span<const uint8_t> labels) {
  std::array<int64_t, 256> counts{};
  for (const uint8_t label : labels) ++counts[label];
  std::array<int64_t, 5> known{};
  std::copy_n(counts.begin(), known.size(), known.begin());
  return known;
}

Json score_json(const ReportEpoch& epoch, const LevelScale& scale) {
  const ScoreCounts counts = count_scores(epoch.score, scale);
  Json json = {{"pixels", counts.pixels}, {"above", counts.above}};
  if (!epoch.label.empty()) json["labels"] = count_labels(epoch.label);
  return json;
}

// JSON text that may stand inside an HTML element.
std::string escaped_dump(const Json& json) {
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string escaped;
  escaped.reserve(text.size() + 64);
  for (const char c : text) {
    switch (c) {
      case '<':
        escaped += "\\u003c";
        break;
      case '>':
        escaped += "\\u003e";
        break;
      case '&':
        escaped += "\\u0026";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string join(std::string header, const Blocks& blocks) {
  check(header.back() == '}', "make_report_data: header is an object");
  header.pop_back();
  header += ",\"blocks\":[";
  for (size_t i = 0; i < blocks.encoded().size(); ++i) {
    header += i == 0 ? "\"" : ",\"";
    header += blocks.encoded()[i];
    header += '"';
  }
  return header + "]}";
}

}  // namespace

void ReportOptions::validate() const {
  check_field(max_points >= 0, "max_points", max_points, "a number >= 0");
  check_field(max_bytes >= 1000000, "max_bytes", max_bytes, "at least 1000000");
}

ReportData make_report_data(const ReportInput& input, const ReportOptions& options) {
  options.validate();
  check_input(input);
  const LevelScale scale(input.threshold_u, input.bound_u);
  Json header = {
      {"format", "vggt-cd-report"},
      {"version", 1},
      {"generator", fmt::format("vggt-cd {}", kVersion)},
      {"title", input.title},
      {"unit", input.unit},
      {"scene", {{"extent", input.extent_u}}},
      {"levels",
       {{"count", LevelScale::kCount},
        {"threshold", scale.threshold_level()},
        {"threshold_value", scale.threshold_u()}}},
      {"evidence",
       {{"before", score_json(input.before, scale)}, {"after", score_json(input.after, scale)}}}};

  // Everything but photos and points is small; base64 makes four characters of three bytes.
  const auto room_for = [](int64_t characters) { return characters / 4 * 3; };
  const int64_t fixed =
      static_cast<int64_t>(page_template().size()) + 100000 +
      static_cast<int64_t>(
          input.summary.dump(-1, ' ', false, Json::error_handler_t::replace).size()) +
      700 * static_cast<int64_t>(input.before.photos.size() + input.after.photos.size());
  const int64_t room = std::max<int64_t>(0, options.max_bytes - fixed);
  const PhotoSet photos = encode_within(input, scale, room_for(room / 2));
  const Candidates before = find_candidates(input.before.cloud, scale);
  const Candidates after = find_candidates(input.after.cloud, scale);
  const CloudPair clouds = encode_within(input, before, after, scale, options.max_points,
                                         room_for(room) - static_cast<int64_t>(photos.bytes()));

  Blocks blocks;
  header["clouds"] = {cloud_json(input.before.cloud, before, clouds.before,
                                 clouds.shares.changed_before, false, blocks),
                      cloud_json(input.after.cloud, after, clouds.after,
                                 clouds.shares.changed_after, true, blocks)};
  if (!input.origin.isZero(0)) {
    header["origin"] = {input.origin.x(), input.origin.y(), input.origin.z()};
  }
  header["photos"] = Json::array();
  for (size_t i = 0; i < photos.before.size(); ++i) {
    header["photos"].push_back(photo_json(input.before.photos[i], photos.before[i], false, blocks));
  }
  for (size_t i = 0; i < photos.after.size(); ++i) {
    header["photos"].push_back(photo_json(input.after.photos[i], photos.after[i], true, blocks));
  }
  header["summary"] = input.summary.is_object() ? input.summary : Json::object();
  header["sim3"] = input.sim3;
  if (input.changes.is_array()) header["changes"] = input.changes;

  ReportData data;
  data.json = join(escaped_dump(header), blocks);
  data.size = {static_cast<int64_t>(data.json.size()),
               static_cast<int64_t>(input.before.cloud.size + input.after.cloud.size),
               clouds.before.points + clouds.after.points};
  return data;
}

ReportSize write_report(const ReportInput& input, const ReportOptions& options,
                        const std::filesystem::path& path) {
  const ReportData data = make_report_data(input, options);
  const std::string_view page = page_template();
  const size_t slot = page.find(kDataSlot);
  check(slot != std::string_view::npos && page.find(kDataSlot, slot + 1) == std::string_view::npos,
        "write_report: the page template has one data slot");
  OutputFile file(path);
  file.write(page.substr(0, slot));
  file.write(data.json);
  file.write(page.substr(slot + kDataSlot.size()));
  file.commit();
  ReportSize size = data.size;
  size.bytes += static_cast<int64_t>(page.size() - kDataSlot.size());
  return size;
}

}  // namespace vggtcd
