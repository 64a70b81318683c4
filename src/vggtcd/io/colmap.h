// SPDX-License-Identifier: Apache-2.0
// COLMAP's sparse models, text and binary: cameras, images, points3D.
// Source: COLMAP's documentation, "Output Format". COLMAP puts the centre of the first pixel at
// (0.5, 0.5), we at (0, 0): principal points are converted on the way in and out.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "vggtcd/io/named_pose.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct ColmapCamera {
  std::string model;  // "PINHOLE", "OPENCV", ...
  int64_t width = 0, height = 0;
  std::vector<double> params;  // as in the file
};

struct ColmapImage {
  std::string name;
  uint32_t camera_id = 0;
  Rigid3 camera_from_world;
};

struct ColmapPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::array<uint8_t, 3> rgb{};
  double error_px = 0;
  std::vector<uint32_t> image_ids;  // the images that see it
};

struct ColmapModel {
  std::map<uint32_t, ColmapCamera> cameras;
  std::map<uint32_t, ColmapImage> images;
  std::vector<ColmapPoint> points;
};

// Reads DIR/cameras.bin, images.bin and points3D.bin, or the .txt files if there is no images.bin.
// Missing points are no error. Coordinates are bounded (coordinate.h). Throws Error{kInput}.
ColmapModel read_colmap(const std::filesystem::path& directory);

// The views of a model without distortion (PINHOLE, SIMPLE_PINHOLE) in natural order of
// their names. Throws Error{kInput} naming the first camera of another kind.
std::vector<View> colmap_views(const ColmapModel& model);
// The poses alone, whatever the camera model, in natural order of their names: photo_2 before
// photo_10, as photos are read (natural_less).
Trajectory colmap_trajectory(const ColmapModel& model);
// The same of a directory; only images.bin or images.txt is read, so that the cameras may be of any
// model, also of one that is newer than this program.
Trajectory read_colmap_trajectory(const std::filesystem::path& directory);

struct ColoredPoint {
  Eigen::Vector3d position;
  std::array<uint8_t, 3> rgb;
};

// Writes the model into an existing directory, as text; and as binary as well if a name has a
// space: COLMAP reads a name in images.txt up to the first space, and takes the binary files where
// there are both. Throws Error{kOutput}.
void write_colmap(const std::filesystem::path& directory, std::span<const View> views,
                  std::span<const ColoredPoint> points = {});
// Writes the three text files into an existing directory: a PINHOLE camera and an image per view,
// and points without tracks. Names must be distinct. Throws Error{kOutput}.
void write_colmap_text(const std::filesystem::path& directory, std::span<const View> views,
                       std::span<const ColoredPoint> points = {});
// The same as binary files.
void write_colmap_binary(const std::filesystem::path& directory, std::span<const View> views,
                         std::span<const ColoredPoint> points = {});

}  // namespace vggtcd
