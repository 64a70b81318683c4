// SPDX-License-Identifier: Apache-2.0
// HEIC and AVIF: libheif's C interface, with every answer looked at.
#include "vggtcd/io/heif_image.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "vggtcd/core/error.h"
#include "vggtcd/io/picture_header.h"
#ifdef VGGTCD_WITH_HEIF
#include <libheif/heif.h>

#include <memory>
#include <vector>
#endif

namespace vggtcd {

bool is_heif(std::span<const std::byte> file) {
  // Pictures and sequences, HEVC and AV1, and the brands of libraries that write no other.
  constexpr std::array<std::string_view, 11> kBrands = {
      "heic", "heix", "heim", "heis", "hevc", "hevx", "hevm", "avif", "avis", "mif1", "msf1"};
  if (file.size() < 12) return false;
  const std::string_view start(reinterpret_cast<const char*>(file.data()), 12);
  return start.substr(4, 4) == "ftyp" &&
         std::find(kBrands.begin(), kBrands.end(), start.substr(8)) != kBrands.end();
}

#ifdef VGGTCD_WITH_HEIF
namespace {

template <auto Release>
struct ReleaseWith {
  template <typename T>
  void operator()(T* object) const {
    Release(object);
  }
};
template <typename T, auto Release>
using Owned = std::unique_ptr<T, ReleaseWith<Release>>;

void require(const heif_error& error, const std::string& name) {
  if (error.code == heif_error_Ok) return;
  std::string reason = error.message ? error.message : "unknown reason";
  std::replace(reason.begin(), reason.end(), '\n', ' ');
  throw_error(ErrorCode::kInput,
              "{}: not a readable photo: HEIC or AVIF that cannot be decoded ({}); copy it again, "
              "or save it as JPEG",
              name, reason);
}

Image image_of(const heif_image* decoded, bool has_alpha) {
  int stride = 0;
  const uint8_t* plane = heif_image_get_plane_readonly(decoded, heif_channel_interleaved, &stride);
  Image image(heif_image_get_width(decoded, heif_channel_interleaved),
              heif_image_get_height(decoded, heif_channel_interleaved));
  check(plane != nullptr, "libheif gives interleaved pixels as asked");
  const int channels = has_alpha ? 4 : 3;
  for (int y = 0; y < image.height; ++y) {
    const uint8_t* from = plane + static_cast<ptrdiff_t>(y) * stride;
    uint8_t* to = image.pixel(0, y);
    for (int x = 0; x < image.width; ++x, from += channels) {
      for (int c = 0; c < 3; ++c) *to++ = has_alpha ? on_white(from[c], from[3]) : from[c];
    }
  }
  return image;
}

Exif exif_of(const heif_image_handle* handle) {
  heif_item_id item = 0;
  if (heif_image_handle_get_list_of_metadata_block_IDs(handle, "Exif", &item, 1) != 1) return {};
  std::vector<std::byte> block(heif_image_handle_get_metadata_size(handle, item));
  if (block.size() <= 4 || heif_image_handle_get_metadata(handle, item, block.data()).code != 0) {
    return {};
  }
  // Where the TIFF header starts, counted from behind this number.
  size_t skip = 0;
  for (size_t i = 0; i < 4; ++i) skip = skip << 8 | std::to_integer<size_t>(block[i]);
  if (skip > block.size() - 4) return {};
  return parse_exif(std::span(block).subspan(4 + skip));
}

// Whether the file itself says how its picture is turned or mirrored. libheif 1.15 applies these
// properties and does not tell of them.
bool has_terms_of_its_own(std::span<const std::byte> file) {
  const std::string_view bytes(reinterpret_cast<const char*>(file.data()), file.size());
  const std::string_view properties = bytes.substr(0, bytes.find("mdat"));
  return properties.find("irot") != std::string_view::npos ||
         properties.find("imir") != std::string_view::npos;
}

bool is_avif(std::span<const std::byte> file) {
  const std::string_view start(reinterpret_cast<const char*>(file.data()), 12);
  return start.ends_with("avif") || start.ends_with("avis");
}

}  // namespace

Image decode_heif(std::span<const std::byte> file, const std::string& name,
                  const ImageReadOptions& read, PhotoFacts& facts) {
  const Owned<heif_context, heif_context_free> context(heif_context_alloc());
  require(
      heif_context_read_from_memory_without_copy(context.get(), file.data(), file.size(), nullptr),
      name);
  heif_image_handle* found = nullptr;
  require(heif_context_get_primary_image_handle(context.get(), &found), name);
  const Owned<heif_image_handle, heif_image_handle_release> handle(found);
  facts.exif = exif_of(handle.get());
  const int64_t pixels =
      int64_t{heif_image_handle_get_width(found)} * heif_image_handle_get_height(found);
  if (pixels > kMaxPixels) {
    throw_error(ErrorCode::kInput,
                "{}: too large: expected at most {} megapixels, found {}; save it smaller", name,
                kMaxPixels / 1'000'000, pixels / 1'000'000);
  }
  const bool has_alpha = heif_image_handle_has_alpha_channel(handle.get()) != 0;
  const Owned<heif_decoding_options, heif_decoding_options_free> options(
      heif_decoding_options_alloc());
  options->convert_hdr_to_8bit = 1;
  options->strict_decoding = 1;  // a cut-off file is an error, not a picture with a grey part
  heif_image* decoded = nullptr;
  require(heif_decode_image(handle.get(), &decoded, heif_colorspace_RGB,
                            has_alpha ? heif_chroma_interleaved_RGBA : heif_chroma_interleaved_RGB,
                            options.get()),
          name);
  const Owned<heif_image, heif_image_release> owned(decoded);
  const bool turn = read.apply_exif_orientation && is_avif(file) && !has_terms_of_its_own(file);
  return turned_upright(image_of(decoded, has_alpha), turn ? facts.exif.orientation : 1);
}
#else
Image decode_heif(std::span<const std::byte>, const std::string& name, const ImageReadOptions&,
                  PhotoFacts&) {
  throw_error(ErrorCode::kUnavailable,
              "{}: this build reads no HEIC or AVIF photos (libheif-dev was missing); build it "
              "again with libheif-dev, or convert them to JPEG (heif-convert of libheif-examples)",
              name);
}
#endif

}  // namespace vggtcd
