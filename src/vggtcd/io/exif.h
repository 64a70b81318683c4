// SPDX-License-Identifier: Apache-2.0
// The few fields of EXIF that matter here: how the picture is turned, and which camera took it.
// Source: CIPA DC-008 (EXIF 2.32), TIFF 6.0; where formats keep it: JPEG APP1, PNG eXIf, WebP EXIF.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace vggtcd {

struct Exif {
  int orientation = 1;  // 1 to 8: the first row and column of the file are ..., 1: top and left
  std::string make, model, lens;
  double focal_mm = 0, focal_35mm = 0;  // 0: not known
  double digital_zoom = 0;

  // The same text for photos that one camera with one lens at one focal length took; "" where the
  // file does not tell.
  std::string camera() const;
};

// Of a JPEG, PNG or WebP file; what is missing, cut off or senseless stays as it is above.
Exif read_exif(std::span<const std::byte> file);

// Of a block of EXIF: a TIFF header, with or without "Exif\0\0" before it.
Exif parse_exif(std::span<const std::byte> block);

}  // namespace vggtcd
