// SPDX-License-Identifier: Apache-2.0
// test-media: makes a video or a HEIC file from photos, for tests of the program.
// Usage: test-media video OUT.avi PHOTO... | test-media heic OUT.heic PHOTO
// Exit status 77 if this build or machine has no encoder for it.
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#ifdef VGGTCD_WITH_VIDEO
#include <opencv2/videoio.hpp>
#endif
#ifdef VGGTCD_WITH_HEIF
#include <libheif/heif.h>
#endif

namespace {

constexpr int kNoEncoder = 77;

int write_video([[maybe_unused]] const char* out, [[maybe_unused]] int count,
                [[maybe_unused]] char** photos) {
#ifdef VGGTCD_WITH_VIDEO
  const cv::Mat first = cv::imread(photos[0]);
  cv::VideoWriter video(out, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 10,
                        first.size());
  if (!video.isOpened()) return kNoEncoder;
  video.set(cv::VIDEOWRITER_PROP_QUALITY, 95);
  for (int i = 0; i < count; ++i) video.write(cv::imread(photos[i]));
  return 0;
#else
  return kNoEncoder;
#endif
}

int write_heic([[maybe_unused]] const char* out, [[maybe_unused]] const char* photo) {
#ifdef VGGTCD_WITH_HEIF
  cv::Mat picture;
  cv::cvtColor(cv::imread(photo), picture, cv::COLOR_BGR2RGB);
  heif_context* context = heif_context_alloc();
  heif_encoder* encoder = nullptr;
  if (heif_context_get_encoder_for_format(context, heif_compression_HEVC, &encoder).code !=
      heif_error_Ok) {
    return kNoEncoder;
  }
  heif_image* image = nullptr;
  heif_image_create(picture.cols, picture.rows, heif_colorspace_RGB, heif_chroma_interleaved_RGB,
                    &image);
  heif_image_add_plane(image, heif_channel_interleaved, picture.cols, picture.rows, 8);
  int stride = 0;
  uint8_t* plane = heif_image_get_plane(image, heif_channel_interleaved, &stride);
  picture.copyTo(cv::Mat(picture.rows, picture.cols, CV_8UC3, plane, static_cast<size_t>(stride)));
  heif_encoder_set_lossy_quality(encoder, 90);
  const bool encoded =
      heif_context_encode_image(context, image, encoder, nullptr, nullptr).code == heif_error_Ok;
  return encoded && heif_context_write_to_file(context, out).code == heif_error_Ok ? 0 : 1;
#else
  return kNoEncoder;
#endif
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 3 ? argv[1] : "";
  if (what == "video") return write_video(argv[2], argc - 3, argv + 3);
  if (what == "heic" && argc == 4) return write_heic(argv[2], argv[3]);
  std::fprintf(stderr, "usage: test-media video OUT.avi PHOTO... | heic OUT.heic PHOTO\n");
  return 2;
}
