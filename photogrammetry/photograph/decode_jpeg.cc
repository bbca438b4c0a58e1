#include <cstddef>
#include <cstdio>
// jpeglib.h needs size_t and FILE to be declared before it.
#include <jerror.h>
#include <jpeglib.h>

#include <array>
#include <csetjmp>

#include "photogrammetry/photograph/decoders.h"
#include "photogrammetry/photograph/raster_header.h"

namespace hexcal {
namespace {

struct ErrorState {
  jpeg_error_mgr manager{};
  jpeg_progress_mgr progress{};
  std::jmp_buf escape{};
  std::array<char, JMSG_LENGTH_MAX> message{};
  bool damaged = false;
};

[[noreturn]] void on_error(j_common_ptr info) {
  auto* state = reinterpret_cast<ErrorState*>(info->err);
  state->manager.format_message(info, state->message.data());
  std::longjmp(state->escape, 1);
}

// libjpeg repairs damaged data with grey and only warns; such pixels must not be measured. Stray bytes
// between markers and unusual headers harm no pixel.
void on_message(j_common_ptr info, int level) {
  if (level >= 0) return;
  auto* state = reinterpret_cast<ErrorState*>(info->err);
  switch (state->manager.msg_code) {
    case JWRN_EXTRANEOUS_DATA:
    case JWRN_ADOBE_XFORM:
    case JWRN_JFIF_MAJOR:
      return;
    default:
      break;
  }
  if (!state->damaged) state->manager.format_message(info, state->message.data());
  state->damaged = true;
}

void print_nothing(j_common_ptr) {}

// Cameras' and editors' progressive JPEGs have about ten scans; each of thousands would take a pass over the
// whole picture.
constexpr int kMaxScans = 100;
// Of libjpeg itself, which keeps all coefficients of a progressive JPEG.
constexpr long kMaxMemoryBytes = 640L << 20;

void stop_at_many_scans(j_common_ptr info) {
  if (reinterpret_cast<j_decompress_ptr>(info)->input_scan_number <= kMaxScans) return;
  auto* state = reinterpret_cast<ErrorState*>(info->err);
  std::snprintf(state->message.data(), state->message.size(), "more than %d scans", kMaxScans);
  std::longjmp(state->escape, 1);
}

// Everything between setjmp and the last libjpeg call; holds no object with a destructor.
bool decode(jpeg_decompress_struct& info, ErrorState& errors, std::string_view bytes, cv::Mat& grey,
            std::string& too_large) {
  if (setjmp(errors.escape) != 0) return false;
  jpeg_create_decompress(&info);
  info.mem->max_memory_to_use = kMaxMemoryBytes;
  info.progress = &errors.progress;
  jpeg_mem_src(&info, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  if (jpeg_read_header(&info, TRUE) != JPEG_HEADER_OK) return false;
  too_large = size_fault(info.image_width, info.image_height, bytes.size());
  if (!too_large.empty()) return false;
  info.out_color_space = JCS_GRAYSCALE;
  jpeg_start_decompress(&info);
  grey.create(static_cast<int>(info.output_height), static_cast<int>(info.output_width), CV_8UC1);
  while (info.output_scanline < info.output_height) {
    JSAMPROW row = grey.ptr(static_cast<int>(info.output_scanline));
    jpeg_read_scanlines(&info, &row, 1);
  }
  jpeg_finish_decompress(&info);
  return true;
}

}  // namespace

DecodedImage decode_jpeg_luma(std::string_view bytes) {
  DecodedImage image;
  jpeg_decompress_struct info{};
  ErrorState errors;
  info.err = jpeg_std_error(&errors.manager);
  errors.manager.error_exit = on_error;
  errors.manager.emit_message = on_message;
  errors.manager.output_message = print_nothing;
  errors.progress.progress_monitor = stop_at_many_scans;
  std::string too_large;
  const bool done = decode(info, errors, bytes, image.grey, too_large);
  if (!too_large.empty()) {
    image.status = PhotographStatus::too_large;
    image.reason = too_large;
  } else if (!done) {
    image.reason = errors.message.data();
    image.grey.release();
  } else if (errors.damaged) {
    image.status = PhotographStatus::truncated;
    image.reason = errors.message.data();
    image.grey.release();
  } else {
    image.status = PhotographStatus::ok;
  }
  jpeg_destroy_decompress(&info);
  return image;
}

}  // namespace hexcal
