#include "photogrammetry/photograph/photograph.h"

#include <utility>

#include "photogrammetry/photograph/decoders.h"
#include "photogrammetry/photograph/file_signature.h"
#include "photogrammetry/photograph/input_file.h"
#include "photogrammetry/photograph/photograph_file.h"
#include "photogrammetry/photograph/photograph_format.h"
#include "photogrammetry/photograph/sha256.h"

namespace hexcal {
namespace {

constexpr std::uintmax_t kMaxFileBytes = 1U << 29;

DecodedImage decode(const std::filesystem::path& path, std::string_view bytes) {
  const FileSignature signature = file_signature(bytes);
  if (signature == FileSignature::jpeg) return decode_jpeg_luma(bytes);
  if (signature == FileSignature::heif) return decode_heif_luma(bytes);
  if (is_raw(photograph_format(path))) return decode_raw_green(bytes);
  if (std::string advice = unread_format_advice(path); !advice.empty()) {
    return {PhotographStatus::unreadable, std::move(advice), {}, ToneCurve::srgb};
  }
  return decode_raster(bytes);
}

}  // namespace

PhotographFile read_photograph_file(const std::filesystem::path& path) {
  PhotographFile file;
  file.path = path;
  const auto failed = [&file](PhotographStatus status, const std::string& reason) {
    file.status = status;
    file.reason = reason;
    file.bytes.clear();
    return file;
  };
  InputFile in(path);
  if (!in.exists()) return failed(PhotographStatus::missing, "no such file");
  if (in.is_pipe()) return failed(PhotographStatus::unreadable, "is a pipe, wanted a file");
  if (!in.failure().empty()) return failed(PhotographStatus::unreadable, in.failure());
  const std::uintmax_t size = in.size();
  if (size == 0) return failed(PhotographStatus::empty, "the file has no content");
  if (size > kMaxFileBytes) return failed(PhotographStatus::too_large, std::to_string(size) + " bytes");
  file.bytes.resize(size);
  if (in.read(file.bytes.data(), size) != size) {
    return failed(PhotographStatus::unreadable, in.failure().empty() ? "became shorter" : in.failure());
  }
  file.status = PhotographStatus::ok;
  file.sha256 = sha256_hex(file.bytes);
  return file;
}

Photograph decode_photograph(const PhotographFile& file) {
  Photograph photograph;
  photograph.path = file.path;
  photograph.status = file.status;
  photograph.reason = file.reason;
  if (file.status != PhotographStatus::ok) return photograph;
  photograph.sha256 = file.sha256;
  photograph.info = read_exif(file.bytes);
  DecodedImage image = decode(file.path, file.bytes);
  photograph.status = image.status;
  photograph.reason = image.reason;
  photograph.tone = image.tone;
  photograph.grey = image.grey;
  if (image.status == PhotographStatus::ok) {
    photograph.info.width_px = image.grey.cols;
    photograph.info.height_px = image.grey.rows;
  }
  return photograph;
}

Photograph read_photograph(const std::filesystem::path& path) {
  return decode_photograph(read_photograph_file(path));
}

PhotographInfo photograph_info(const PhotographFile& file) {
  return file.status == PhotographStatus::ok ? read_exif(file.bytes) : PhotographInfo{};
}

PhotographInfo read_photograph_info(const std::filesystem::path& path) {
  return photograph_info(read_photograph_file(path));
}

const char* photograph_status_name(PhotographStatus status) {
  switch (status) {
    case PhotographStatus::ok:
      return "ok";
    case PhotographStatus::missing:
      return "missing";
    case PhotographStatus::empty:
      return "empty";
    case PhotographStatus::unreadable:
      return "unreadable";
    case PhotographStatus::truncated:
      return "truncated";
    case PhotographStatus::too_large:
      return "too_large";
  }
  return "";
}

}  // namespace hexcal
