#include <libheif/heif.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "photogrammetry/photograph/decoders.h"
#include "photogrammetry/photograph/raster_header.h"

namespace hexcal {
namespace {

template <typename T, void (*Release)(T*)>
struct Releaser {
  void operator()(T* object) const { Release(object); }
};
void release_handle(heif_image_handle* handle) { heif_image_handle_release(handle); }
void release_image(heif_image* image) { heif_image_release(image); }

using Context = std::unique_ptr<heif_context, Releaser<heif_context, heif_context_free>>;
using Handle = std::unique_ptr<heif_image_handle, Releaser<heif_image_handle, release_handle>>;
using Image = std::unique_ptr<heif_image, Releaser<heif_image, release_image>>;
using Options =
    std::unique_ptr<heif_decoding_options, Releaser<heif_decoding_options, heif_decoding_options_free>>;

// The picture that a HEIF file shows first; its reason says why there is none.
struct Primary {
  Context context;
  Handle handle;
  std::string reason;
};

Primary primary_picture(std::string_view bytes) {
  Primary primary;
  primary.context.reset(heif_context_alloc());
  heif_error error =
      heif_context_read_from_memory_without_copy(primary.context.get(), bytes.data(), bytes.size(), nullptr);
  heif_image_handle* handle = nullptr;
  if (error.code == heif_error_Ok)
    error = heif_context_get_primary_image_handle(primary.context.get(), &handle);
  if (error.code != heif_error_Ok) primary.reason = error.message;
  primary.handle.reset(handle);
  return primary;
}

// Video range (16 to 235) is stretched: black and white are 0 and 255 everywhere else.
void stretch_video_range(const heif_image* image, cv::Mat& grey) {
  heif_color_profile_nclx* profile = nullptr;
  if (heif_image_get_nclx_color_profile(image, &profile).code != heif_error_Ok || profile == nullptr) return;
  const bool full = profile->full_range_flag != 0;
  heif_nclx_color_profile_free(profile);
  if (!full) grey.convertTo(grey, -1, 255.0 / 219, -16 * 255.0 / 219);
}

}  // namespace

DecodedImage decode_heif_luma(std::string_view bytes) {
  DecodedImage decoded;
  const Primary primary = primary_picture(bytes);
  decoded.reason = primary.reason;
  if (!primary.handle) return decoded;
  decoded.reason = size_fault(heif_image_handle_get_width(primary.handle.get()),
                              heif_image_handle_get_height(primary.handle.get()), bytes.size());
  if (!decoded.reason.empty()) {
    decoded.status = PhotographStatus::too_large;
    return decoded;
  }
  const Options options(heif_decoding_options_alloc());
  options->ignore_transformations = 1;  // pixels stay the sensor's
  heif_image* raw = nullptr;
  const heif_error error =
      heif_decode_image(primary.handle.get(), &raw, heif_colorspace_YCbCr, heif_chroma_420, options.get());
  const Image image(raw);
  if (error.code != heif_error_Ok) {
    decoded.reason = error.message;
    return decoded;
  }
  int stride = 0;
  const std::uint8_t* luma = heif_image_get_plane_readonly(image.get(), heif_channel_Y, &stride);
  const int bits = luma != nullptr ? heif_image_get_bits_per_pixel_range(image.get(), heif_channel_Y) : 0;
  if (bits != 8) {
    decoded.reason = "a HEIF picture without 8-bit luminance";
    return decoded;
  }
  const cv::Mat view(heif_image_get_height(image.get(), heif_channel_Y),
                     heif_image_get_width(image.get(), heif_channel_Y), CV_8UC1,
                     const_cast<std::uint8_t*>(luma), static_cast<std::size_t>(stride));
  decoded.grey = view.clone();
  stretch_video_range(image.get(), decoded.grey);
  decoded.status = PhotographStatus::ok;
  return decoded;
}

HeifHead read_heif_head(std::string_view bytes) {
  HeifHead head;
  const Primary primary = primary_picture(bytes);
  if (!primary.handle) return head;
  head.width_px = heif_image_handle_get_ispe_width(primary.handle.get());
  head.height_px = heif_image_handle_get_ispe_height(primary.handle.get());
  heif_item_id id = 0;
  if (heif_image_handle_get_list_of_metadata_block_IDs(primary.handle.get(), "Exif", &id, 1) != 1)
    return head;
  std::string block(heif_image_handle_get_metadata_size(primary.handle.get(), id), '\0');
  if (heif_image_handle_get_metadata(primary.handle.get(), id, block.data()).code != heif_error_Ok)
    return head;
  // Four bytes tell where in the rest the TIFF header begins.
  if (block.size() < 4) return head;
  std::size_t start = 4;
  for (std::size_t i = 0, offset = 0; i < 4; ++i) {
    offset = offset << 8 | static_cast<unsigned char>(block[i]);
    if (i == 3) start += offset;
  }
  if (start < block.size()) head.exif = block.substr(start);
  return head;
}

}  // namespace hexcal
