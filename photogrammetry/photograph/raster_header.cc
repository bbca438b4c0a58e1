#include "photogrammetry/photograph/raster_header.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <optional>

namespace hexcal {
namespace {

// The largest sensors of today; decoding takes up to five bytes a pixel.
constexpr long long kMaxPixels = 155'000'000;
// Of a black JPEG, the emptiest picture of a camera, a byte holds about 250 pixels.
constexpr long long kMaxPixelsPerByte = 500;
constexpr long long kAlwaysPixels = 4'000'000;  // that do no harm, however few bytes they come from

std::uint32_t big_endian_32(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = at; i < at + 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
  return value;
}

std::uint32_t little_endian(std::string_view bytes, std::size_t at, std::size_t size) {
  std::uint32_t value = 0;
  for (std::size_t i = at + size; i-- > at;) value = value << 8 | static_cast<unsigned char>(bytes[i]);
  return value;
}

// OpenCV fills what is missing of a PNG with black and only prints a warning.
bool is_cut_png(std::string_view bytes) {
  return bytes.size() < 45 || bytes.substr(bytes.size() - 8, 4) != "IEND";
}

void judge_size(RasterHeader& header, std::size_t file_bytes) {
  header.reason = size_fault(header.width_px, header.height_px, file_bytes);
  if (header.width_px < 1 || header.height_px < 1) return;
  header.status = header.reason.empty() ? PhotographStatus::ok : PhotographStatus::too_large;
}

constexpr std::uint32_t kWidth = 256, kHeight = 257, kBits = 258, kSamples = 277;
constexpr std::uint32_t kRowsPerStrip = 278, kTileWidth = 322, kTileHeight = 323;
constexpr std::array kTags{kWidth, kHeight, kBits, kSamples, kRowsPerStrip, kTileWidth, kTileHeight};

// The first directory of a TIFF (Revision 6.0), of each entry its first value.
class TiffDirectory {
 public:
  explicit TiffDirectory(std::string_view bytes) : bytes_(bytes), big_(bytes.starts_with('M')) {
    const auto start = number(4, 4);
    const auto count = start ? number(*start, 2) : std::nullopt;
    if (!count) return;
    for (std::size_t i = 0; i < *count; ++i) {
      if (!read_entry(*start + 2 + 12 * i)) return;
    }
    whole_ = true;
  }

  // False if it is cut, or says a thing twice or in an unusual way, which readers understand differently.
  [[nodiscard]] bool whole() const { return whole_; }
  [[nodiscard]] std::optional<std::uint32_t> value(std::uint32_t tag) const {
    const auto found = values_.find(tag);
    return found == values_.end() ? std::nullopt : std::optional(found->second);
  }

 private:
  [[nodiscard]] std::optional<std::uint32_t> number(std::size_t at, std::size_t size) const {
    if (at > bytes_.size() || bytes_.size() - at < size) return std::nullopt;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const auto byte = static_cast<unsigned char>(bytes_[at + (big_ ? i : size - 1 - i)]);
      value = value << 8 | byte;
    }
    return value;
  }

  // False if the entry is one that is asked for and not as the standard wants it.
  bool read_entry(std::size_t at) {
    const auto tag = number(at, 2);
    const auto type = number(at + 2, 2);
    const auto count = number(at + 4, 4);
    const auto offset = number(at + 8, 4);
    if (!offset) return false;
    if (std::find(kTags.begin(), kTags.end(), *tag) == kTags.end()) return true;
    constexpr std::uint32_t kShort = 3;
    constexpr std::uint32_t kLong = 4;
    if ((*type != kShort && *type != kLong) || *count == 0) return false;
    const std::size_t size = *type == kShort ? 2 : 4;
    const auto first = number(*count * size <= 4 ? at + 8 : *offset, size);
    return first && values_.emplace(*tag, *first).second;
  }

  std::string_view bytes_;
  bool big_;
  bool whole_ = false;
  std::map<std::uint32_t, std::uint32_t> values_;
};

}  // namespace

std::string size_fault(long long width_px, long long height_px, std::size_t file_bytes) {
  const std::string size = std::to_string(width_px) + " x " + std::to_string(height_px) + " pixels";
  if (width_px < 1 || height_px < 1) return "a picture of " + size;
  if (width_px > kMaxPixels / height_px) return size;
  const long long pixels = width_px * height_px;
  if (pixels > kAlwaysPixels && pixels / kMaxPixelsPerByte > static_cast<long long>(file_bytes)) {
    return size + " in " + std::to_string(file_bytes) + " bytes";
  }
  return {};
}

RasterHeader read_png_header(std::string_view bytes) {
  RasterHeader header;
  if (is_cut_png(bytes)) {
    header.status = PhotographStatus::truncated;
    header.reason = "the PNG ends too early";
    return header;
  }
  header.width_px = big_endian_32(bytes, 16);
  header.height_px = big_endian_32(bytes, 20);
  judge_size(header, bytes.size());
  return header;
}

// Windows' bitmap: 14 bytes of file header, then the picture's (40 bytes or more); negative height: from the
// top.
RasterHeader read_bmp_header(std::string_view bytes) {
  RasterHeader header;
  constexpr std::size_t kHeads = 54;
  if (bytes.size() < kHeads || little_endian(bytes, 14, 4) < 40) {
    header.reason = "a BMP without a whole header of Windows' kind";
    return header;
  }
  header.width_px = static_cast<std::int32_t>(little_endian(bytes, 18, 4));
  header.height_px = std::abs(static_cast<long long>(static_cast<std::int32_t>(little_endian(bytes, 22, 4))));
  const std::uint32_t bits = little_endian(bytes, 28, 2);
  const std::uint32_t compression = little_endian(bytes, 30, 4);
  if ((bits != 8 && bits != 24 && bits != 32) || (compression != 0 && compression != 3)) {
    header.reason = "a BMP of " + std::to_string(bits) + " bit, compression " + std::to_string(compression) +
                    ", wanted 8, 24 or 32 bit without compression";
    return header;
  }
  judge_size(header, bytes.size());
  const long long row = (header.width_px * bits + 31) / 32 * 4;
  const long long wanted = little_endian(bytes, 10, 4) + row * header.height_px;
  if (header.status == PhotographStatus::ok && static_cast<long long>(bytes.size()) < wanted) {
    header.status = PhotographStatus::truncated;
    header.reason = "the BMP ends too early";
  }
  return header;
}

RasterHeader read_tiff_header(std::string_view bytes) {
  RasterHeader header;
  const TiffDirectory directory(bytes);
  const auto width = directory.value(kWidth);
  const auto height = directory.value(kHeight);
  if (!directory.whole() || !width || !height) {
    header.reason = "a TIFF without a whole directory that states width and height once";
    return header;
  }
  header.width_px = *width;
  header.height_px = *height;
  const std::uint32_t bits = directory.value(kBits).value_or(1);
  const std::uint32_t samples = directory.value(kSamples).value_or(1);
  if ((bits != 8 && bits != 16) || samples < 1 || samples > 4) {
    header.reason = "a TIFF of " + std::to_string(bits) + " bit and " + std::to_string(samples) +
                    " samples a pixel, wanted 8 or 16 bit and 1 to 4 samples";
    return header;
  }
  judge_size(header, bytes.size());
  if (header.status != PhotographStatus::ok) return header;
  // The decoder allocates a strip or tile as a whole.
  constexpr long long kLargestTile = 1 << 24;
  const auto tile_width = directory.value(kTileWidth);
  const auto tile_height = directory.value(kTileHeight);
  if (!tile_width && !tile_height) {
    const std::uint32_t rows = directory.value(kRowsPerStrip).value_or(*height);
    constexpr std::uint32_t kAllRows = 0xFFFFFFFF;
    if (rows <= *height || rows == kAllRows || rows <= kLargestTile / *width) return header;
    header.reason = "a TIFF with strips of " + std::to_string(rows) + " rows";
  } else {
    if (tile_width.value_or(0) > 0 && tile_height.value_or(0) > 0 &&
        *tile_width <= kLargestTile / *tile_height)
      return header;
    header.reason = "a TIFF with tiles of " + std::to_string(tile_width.value_or(0)) + " x " +
                    std::to_string(tile_height.value_or(0)) + " pixels";
  }
  header.status = PhotographStatus::unreadable;
  return header;
}

}  // namespace hexcal
