// SPDX-License-Identifier: Apache-2.0
// Overlaps between reported and true instances, counted once over the pixels of an epoch.
#include "vggtcd/evaluation/instance_metrics.h"

#include <map>

#include "vggtcd/core/error.h"
#include "vggtcd/evaluation/synthetic/render.h"

namespace vggtcd {
namespace {

using Rule = InstanceMatchRule;

struct Reported {
  int64_t pixels = 0, on_change = 0;
  std::map<uint16_t, int64_t> on_object;  // changed surface of each true object
  std::map<uint16_t, int64_t> covered;    // of it, what the other epoch looked at

  bool right() const {
    return static_cast<double>(on_change) >= Rule::kMinRight * static_cast<double>(pixels);
  }
};

struct Overlaps {
  std::map<int32_t, Reported> reported;
  std::map<uint16_t, int64_t> visible;  // changed pixels that the other epoch looked at
};

Overlaps count_overlaps(const InstancePixels& epoch) {
  const size_t size = epoch.object.size();
  check(epoch.reported.size() == size && epoch.label.size() == size &&
            epoch.other_looked.size() == size,
        "evaluate_instances: arrays of one size");
  Overlaps result;
  for (size_t pixel = 0; pixel < size; ++pixel) {
    const uint16_t object = epoch.object[pixel];
    const bool sky = object == 0;  // void, but whoever reports it as a thing is wrong
    if (epoch.label[pixel] == kLabelVoid && !sky) continue;
    const bool changed = epoch.label[pixel] == kLabelChanged;
    const bool seen = changed && epoch.other_looked[pixel] != 0;
    if (seen) ++result.visible[object];
    if (epoch.reported[pixel] == 0) continue;
    Reported& reported = result.reported[epoch.reported[pixel]];
    ++reported.pixels;
    if (!changed) continue;
    ++reported.on_change;
    ++reported.on_object[object];
    if (seen) ++reported.covered[object];
  }
  return result;
}

// 0: not found; 1: found; 2: told apart.
int how_found(const Overlaps& overlaps, uint16_t object, int64_t visible) {
  int best = 0;
  for (const auto& [id, reported] : overlaps.reported) {
    const auto covered = reported.covered.find(object);
    if (covered == reported.covered.end() || !reported.right()) continue;
    if (static_cast<double>(covered->second) < Rule::kMinCovered * static_cast<double>(visible)) {
      continue;
    }
    const double own = static_cast<double>(reported.on_object.at(object));
    best = std::max(best, own >= Rule::kMinRight * static_cast<double>(reported.on_change) ? 2 : 1);
  }
  return best;
}

}  // namespace

InstanceScores& InstanceScores::operator+=(const InstanceScores& other) {
  objects += other.objects;
  found += other.found;
  told_apart += other.told_apart;
  small += other.small;
  hardly_seen += other.hardly_seen;
  reported += other.reported;
  right += other.right;
  return *this;
}

InstanceScores evaluate_instances(std::span<const InstancePixels> epochs,
                                  std::span<const double> object_size) {
  InstanceScores scores;
  for (const InstancePixels& epoch : epochs) {
    const Overlaps overlaps = count_overlaps(epoch);
    const double min_visible = Rule::kMinVisible * static_cast<double>(epoch.object.size());
    for (const auto& [object, visible] : overlaps.visible) {
      check(object < object_size.size(), "evaluate_instances: a size for every object");
      if (object_size[object] <= Rule::kMinSize) {
        ++scores.small;
      } else if (static_cast<double>(visible) < min_visible) {
        ++scores.hardly_seen;
      } else {
        const int found = how_found(overlaps, object, visible);
        ++scores.objects;
        scores.found += found > 0 ? 1 : 0;
        scores.told_apart += found == 2 ? 1 : 0;
      }
    }
    for (const auto& [id, reported] : overlaps.reported) {
      ++scores.reported;
      scores.right += reported.right() ? 1 : 0;
    }
  }
  return scores;
}

}  // namespace vggtcd
