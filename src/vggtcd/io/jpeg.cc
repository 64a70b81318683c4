// SPDX-License-Identifier: Apache-2.0
// JPEG through OpenCV.
#include "vggtcd/io/jpeg.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vggtcd/core/error.h"
#include "vggtcd/io/output_file.h"

namespace vggtcd {

void write_jpeg(const std::filesystem::path& path, const Image& image, int quality) {
  check(quality >= 1 && quality <= 100, "write_jpeg: quality is 1 to 100");
  // OpenCV has no read-only view of pixels; imencode and cvtColor do not write to their input.
  const cv::Mat rgb(image.height, image.width, CV_8UC3, const_cast<uint8_t*>(image.rgb.data()));
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  std::vector<uint8_t> bytes;
  if (!cv::imencode(".jpg", bgr, bytes, {cv::IMWRITE_JPEG_QUALITY, quality})) {
    throw_error(ErrorCode::kOutput, "{}: could not be encoded as JPEG", path.string());
  }
  OutputFile file(path);
  file.write(std::as_bytes(std::span(bytes)));
  file.commit();
}

}  // namespace vggtcd
