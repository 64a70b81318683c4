// SPDX-License-Identifier: Apache-2.0
// Rendering and labelling, one row of pixels at a time.
#include "vggtcd/evaluation/synthetic/render.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/evaluation/synthetic/random.h"
#include "vggtcd/evaluation/synthetic/ray_caster.h"
#include "vggtcd/evaluation/synthetic/shading.h"

namespace vggtcd {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

Vector3d ray_direction(const View& view, const Pinhole& pinhole, double u_px, double v_px) {
  return view.camera_from_world.rotation.transpose() * pinhole.unproject(u_px, v_px, 1.0);
}

std::vector<View> make_views(const SyntheticScene& scene, Epoch epoch,
                             const RenderOptions& options) {
  const int frames = options.frames > 0 ? options.frames : scene.frames[static_cast<int>(epoch)];
  const int height = 2 * static_cast<int>(std::lround(options.width * 392.0 / 518.0 / 2));
  const double half_fov = scene.horizontal_fov_deg * std::numbers::pi / 360;
  Pinhole pinhole;
  pinhole.width = options.width;
  pinhole.height = height;
  pinhole.fx = pinhole.fy = options.width / 2.0 / std::tan(half_fov);
  pinhole.cx = (options.width - 1) / 2.0;
  pinhole.cy = (height - 1) / 2.0;
  std::vector<View> views;
  for (const Rigid3& camera_from_world : sample_path(scene, epoch, frames)) {
    views.push_back({camera_from_world, pinhole, fmt::format("{:04d}.jpg", views.size())});
  }
  return views;
}

Image render_photo(const SyntheticScene& scene, Epoch epoch, const RayCaster& caster,
                   const View& view, int frame, const RenderOptions& options) {
  const Pinhole pinhole = scaled_pinhole(view.pinhole, options.photo_scale);
  const Lighting& lighting = scene.lighting[static_cast<int>(epoch)];
  const Vector3d eye = camera_center(view.camera_from_world);
  const uint64_t noise_key =
      mix64(scene.key, static_cast<uint64_t>(2 * frame + static_cast<int>(epoch)));
  Image photo(pinhole.width, pinhole.height);
  parallel_for(pinhole.height, 4, [&](int64_t begin, int64_t end) {
    for (int v = static_cast<int>(begin); v < end; ++v) {
      for (int u = 0; u < pinhole.width; ++u) {
        Vector3f sum = Vector3f::Zero();
        for (int s = 0; s < options.samples * options.samples; ++s) {
          const double du = (s % options.samples + 0.5) / options.samples - 0.5;
          const double dv = (s / options.samples + 0.5) / options.samples - 0.5;
          const Vector3d direction = ray_direction(view, pinhole, u + du, v + dv).normalized();
          const auto hit = caster.cast(eye, direction);
          const float footprint_m =
              hit ? static_cast<float>(hit->distance_m / (pinhole.fx * options.samples)) : 0;
          sum += radiance(scene, lighting, caster, eye, direction, hit, footprint_m);
        }
        sum /= static_cast<float>(options.samples * options.samples);
        develop(lighting, sum, mix64(noise_key, static_cast<uint64_t>(v * pinhole.width + u)),
                photo.pixel(u, v));
      }
    }
  });
  return photo;
}

// Appends the average of every scale x scale block.
void append_averaged(const Image& photo, int scale, std::vector<uint8_t>& color) {
  for (int v = 0; v < photo.height / scale; ++v) {
    for (int u = 0; u < photo.width / scale; ++u) {
      for (int channel = 0; channel < 3; ++channel) {
        int sum = scale * scale / 2;
        for (int k = 0; k < scale * scale; ++k) {
          sum += photo.pixel(u * scale + k % scale, v * scale + k / scale)[channel];
        }
        color.push_back(static_cast<uint8_t>(sum / (scale * scale)));
      }
    }
  }
}

void cast_depth(const RayCaster& caster, EpochTruth& truth, int frame) {
  const View& view = truth.views[static_cast<size_t>(frame)];
  const Vector3d eye = camera_center(view.camera_from_world);
  const size_t first = static_cast<size_t>(frame) * truth.pixels_per_frame();
  parallel_for(truth.height, 8, [&](int64_t begin, int64_t end) {
    for (int v = static_cast<int>(begin); v < end; ++v) {
      for (int u = 0; u < truth.width; ++u) {
        const size_t pixel = first + static_cast<size_t>(v * truth.width + u);
        const Vector3d ray = ray_direction(view, view.pinhole, u, v);  // z = 1 in camera axes
        const auto hit = caster.cast(eye, ray.normalized());
        truth.depth_m[pixel] = hit ? static_cast<float>(hit->distance_m / ray.norm()) : 0.0f;
        truth.object[pixel] = hit ? static_cast<uint16_t>(hit->object + 1) : uint16_t{0};
      }
    }
  });
}

Vector3d world_point(const EpochTruth& truth, int frame, int u, int v, float depth_m) {
  const View& view = truth.views[static_cast<size_t>(frame)];
  return view.camera_from_world.inverse() * view.pinhole.unproject(u, v, depth_m);
}

// Whether some camera of `looking` has the point in its image with nothing in between. `last` is
// tried first: neighbouring pixels are mostly seen by the same camera.
bool seen_by_any(const EpochTruth& looking, const RayCaster& caster, const Vector3d& point,
                 size_t& last) {
  const auto sees = [&](const View& view) {
    const Vector3d in_camera = view.camera_from_world * point;
    if (in_camera.z() < 0.05) return false;
    const Eigen::Vector2d pixel = view.pinhole.project(in_camera);
    return view.pinhole.contains(pixel.x(), pixel.y()) &&
           !caster.blocked(camera_center(view.camera_from_world), point);
  };
  if (sees(looking.views[last])) return true;
  for (size_t k = 0; k < looking.views.size(); ++k) {
    if (k != last && sees(looking.views[k])) {
      last = k;
      return true;
    }
  }
  return false;
}

void label_frame(const SyntheticScene& scene, EpochTruth& truth, const EpochTruth& other,
                 const RayCaster& other_caster, double resolution_m, int frame) {
  const size_t first = static_cast<size_t>(frame) * truth.pixels_per_frame();
  parallel_for(truth.height, 4, [&](int64_t begin, int64_t end) {
    size_t last = 0;
    for (int v = static_cast<int>(begin); v < end; ++v) {
      for (int u = 0; u < truth.width; ++u) {
        const size_t pixel = first + static_cast<size_t>(v * truth.width + u);
        if (truth.object[pixel] == 0) continue;  // sky: void, nobody looked
        const Vector3d point = world_point(truth, frame, u, v, truth.depth_m[pixel]);
        const SceneObject& object = scene.objects[truth.object[pixel] - 1u];
        if (object.change() == ObjectChange::kUnchanged) {
          truth.label[pixel] = kLabelUnchanged;
        } else if (!other_caster.surface_within(point, resolution_m)) {
          truth.label[pixel] = kLabelChanged;
        }
        truth.other_looked[pixel] = seen_by_any(other, other_caster, point, last) ? 1 : 0;
      }
    }
  });
}

double scene_extent(const SceneTruth& truth) {
  std::vector<double> axis[3];
  for (const EpochTruth& epoch : truth.epoch) {
    for (int frame = 0; frame < epoch.num_frames(); ++frame) {
      for (int v = 0; v < epoch.height; v += 8) {
        for (int u = 0; u < epoch.width; u += 8) {
          const float depth = epoch.depth_m[static_cast<size_t>(frame) * epoch.pixels_per_frame() +
                                            static_cast<size_t>(v * epoch.width + u)];
          if (depth <= 0) continue;
          const Vector3d point = world_point(epoch, frame, u, v, depth);
          for (int k = 0; k < 3; ++k) axis[k].push_back(point[k]);
        }
      }
    }
  }
  double extent = 0;
  for (std::vector<double>& values : axis) {
    if (values.empty()) continue;
    std::sort(values.begin(), values.end());
    const size_t margin = values.size() / 100;
    extent = std::max(extent, values[values.size() - 1 - margin] - values[margin]);
  }
  return extent;
}

}  // namespace

void RenderOptions::validate() const {
  check_field(frames == 0 || frames >= 2, "frames", frames, "0 or at least 2");
  check_field(width >= 32 && width <= 4096 && width % 2 == 0, "width", width, "even, 32 to 4096");
  check_field(photo_scale >= 1 && photo_scale <= 4, "photo_scale", photo_scale, "1 to 4");
  check_field(samples >= 1 && samples <= 4, "samples", samples, "1 to 4");
  check_field(label_resolution > 0, "label_resolution", label_resolution, "> 0");
}

Pinhole scaled_pinhole(const Pinhole& pinhole, int scale) {
  // Pixel centres are integers: u_large = scale * u + (scale - 1) / 2.
  const double shift = (scale - 1) / 2.0;
  return {scale * pinhole.fx,         scale * pinhole.fy,    scale * pinhole.cx + shift,
          scale * pinhole.cy + shift, scale * pinhole.width, scale * pinhole.height};
}

double changed_share(const SceneTruth& truth) {
  int64_t changed = 0, surface = 0;
  for (const EpochTruth& epoch : truth.epoch) {
    for (size_t pixel = 0; pixel < epoch.label.size(); ++pixel) {
      surface += epoch.object[pixel] != 0 ? 1 : 0;
      changed += epoch.label[pixel] == kLabelChanged ? 1 : 0;
    }
  }
  return static_cast<double>(changed) / static_cast<double>(std::max<int64_t>(1, surface));
}

SceneTruth render(const SyntheticScene& scene, const RenderOptions& options, ProgressSink& progress,
                  const PhotoSink& photo_sink) {
  options.validate();
  const RayCaster caster_t1(scene, Epoch::kT1), caster_t2(scene, Epoch::kT2);
  const RayCaster* casters[] = {&caster_t1, &caster_t2};
  SceneTruth result;
  for (const Epoch which : kEpochs) {
    const RayCaster& caster = *casters[static_cast<int>(which)];
    EpochTruth& truth = result.epoch[static_cast<int>(which)];
    truth.views = make_views(scene, which, options);
    truth.width = truth.views[0].pinhole.width;
    truth.height = truth.views[0].pinhole.height;
    const size_t pixels = truth.views.size() * truth.pixels_per_frame();
    truth.depth_m.resize(pixels);
    truth.object.resize(pixels);
    truth.label.assign(pixels, kLabelVoid);
    truth.other_looked.resize(pixels);
    truth.color.reserve(3 * pixels);
    ProgressStage stage(progress, which == Epoch::kT1 ? "photos before" : "photos after");
    for (int frame = 0; frame < truth.num_frames(); ++frame) {
      const View& view = truth.views[static_cast<size_t>(frame)];
      const Image photo = render_photo(scene, which, caster, view, frame, options);
      append_averaged(photo, options.photo_scale, truth.color);
      cast_depth(caster, truth, frame);
      if (photo_sink) photo_sink(which, frame, photo);
      stage.advance((frame + 1.0) / truth.num_frames());
    }
  }
  result.extent_m = scene_extent(result);
  ProgressStage stage(progress, "labels");
  for (const Epoch which : kEpochs) {
    EpochTruth& truth = result.epoch[static_cast<int>(which)];
    const Epoch other = other_epoch(which);
    for (int frame = 0; frame < truth.num_frames(); ++frame) {
      label_frame(scene, truth, result.of(other), *casters[static_cast<int>(other)],
                  options.label_resolution * result.extent_m, frame);
      stage.advance(0.5 * (static_cast<int>(which) + (frame + 1.0) / truth.num_frames()));
    }
  }
  return result;
}

}  // namespace vggtcd
