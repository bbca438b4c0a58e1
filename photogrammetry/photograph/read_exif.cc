#include <cstdint>
#include <exiv2/exiv2.hpp>
#include <limits>
#include <mutex>

#include "kinematics/geometry/printable_text.h"
#include "photogrammetry/photograph/decoders.h"
#include "photogrammetry/photograph/file_signature.h"

namespace hexcal {
namespace {

class ExifReader {
 public:
  explicit ExifReader(const Exiv2::ExifData& data) : data_(data) {}

  [[nodiscard]] std::optional<std::string> text(const char* key, bool interpreted = false) const {
    const auto entry = data_.findKey(Exiv2::ExifKey(key));
    if (entry == data_.end() || entry->count() == 0) return std::nullopt;
    std::string value = interpreted ? entry->print(&data_) : entry->toString();
    const auto last = value.find_last_not_of(std::string(" \0", 2));
    value.erase(last == std::string::npos ? 0 : last + 1);
    value.erase(0, value.find_first_not_of(' '));
    if (value.empty()) return std::nullopt;
    return printable_text(value);
  }

  [[nodiscard]] std::optional<double> number(const char* key) const {
    const auto entry = data_.findKey(Exiv2::ExifKey(key));
    if (entry == data_.end() || entry->count() == 0) return std::nullopt;
    const auto [over, under] = entry->toRational();
    if (under == 0 || !entry->value().ok()) return std::nullopt;
    return static_cast<double>(over) / under;
  }

  [[nodiscard]] std::optional<double> positive(const char* key) const {
    const auto value = number(key);
    return value && *value > 0 ? value : std::nullopt;
  }

  [[nodiscard]] std::optional<int> integer(const char* key) const {
    const auto entry = data_.findKey(Exiv2::ExifKey(key));
    if (entry == data_.end() || entry->count() == 0) return std::nullopt;
#if EXIV2_TEST_VERSION(0, 28, 0)
    const auto value = static_cast<int>(entry->toInt64());
#else
    const auto value = static_cast<int>(entry->toLong());
#endif
    if (!entry->value().ok()) return std::nullopt;
    return value;
  }

  // The Nikon maker note's lens data come in three layouts.
  [[nodiscard]] std::optional<int> nikon_lens_integer(const std::string& name) const {
    for (const char* group : {"Exif.NikonLd3.", "Exif.NikonLd2.", "Exif.NikonLd1."}) {
      try {
        if (const auto value = integer((group + name).c_str())) return value;
      } catch (const Exiv2::Error&) {  // the group has no such entry
      }
    }
    return std::nullopt;
  }

 private:
  const Exiv2::ExifData& data_;
};

// Of a damaged file Exiv2 tells any number; 0 is unknown.
int size_px(std::int64_t told) {
  return told > 0 && told <= std::numeric_limits<int>::max() ? static_cast<int>(told) : 0;
}

PhotographInfo info_from(const Exiv2::ExifData& data, std::int64_t width_px, std::int64_t height_px) {
  PhotographInfo info;
  info.width_px = size_px(width_px);
  info.height_px = size_px(height_px);
  const ExifReader exif(data);
  info.make = exif.text("Exif.Image.Make");
  info.model = exif.text("Exif.Image.Model");
  info.serial = exif.text("Exif.Nikon3.SerialNumber");
  if (!info.serial) info.serial = exif.text("Exif.Photo.BodySerialNumber");
  info.lens = exif.text("Exif.Photo.LensModel");
  if (!info.lens) info.lens = exif.text("Exif.Nikon3.Lens", true);
  info.capture_time = exif.text("Exif.Photo.DateTimeOriginal");
  info.lens_id = exif.nikon_lens_integer("LensIDNumber");
  info.focus_distance_code = exif.nikon_lens_integer("FocusDistance");
  // Adapted lenses without contacts, and some editors, write 0 for what they do not know.
  info.focal_length_mm = exif.positive("Exif.Photo.FocalLength");
  info.f_number = exif.positive("Exif.Photo.FNumber");
  info.exposure_s = exif.positive("Exif.Photo.ExposureTime");
  info.iso = exif.integer("Exif.Photo.ISOSpeedRatings");
  if (const auto reduction = exif.integer("Exif.NikonVr.VibrationReduction")) {
    info.vibration_reduction = *reduction == 1;
  }
  return info;
}

}  // namespace

PhotographInfo read_exif(std::string_view bytes) {
  const FileSignature signature = file_signature(bytes);
  if (signature == FileSignature::other) return {};
  static std::once_flag prepared;
  std::call_once(prepared, [] {
    Exiv2::LogMsg::setLevel(Exiv2::LogMsg::mute);
    Exiv2::XmpParser::initialize();  // not safe to leave to the first of several threads
  });
  try {
    if (signature == FileSignature::heif) {  // not every build of Exiv2 reads its boxes
      const HeifHead head = read_heif_head(bytes);
      Exiv2::ExifData data;
      if (!head.exif.empty()) {
        Exiv2::ExifParser::decode(data, reinterpret_cast<const Exiv2::byte*>(head.exif.data()),
                                  static_cast<std::uint32_t>(head.exif.size()));
      }
      return info_from(data, head.width_px, head.height_px);
    }
    const auto image = Exiv2::ImageFactory::open(reinterpret_cast<const Exiv2::byte*>(bytes.data()),
                                                 static_cast<long>(bytes.size()));
    image->readMetadata();
    return info_from(image->exifData(), image->pixelWidth(), image->pixelHeight());
  } catch (const std::exception&) {  // Exiv2 throws its own and the standard library's on damaged files
    return {};
  }
}

}  // namespace hexcal
