#include "tools/synthetic/jpeg_file.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <exiv2/exiv2.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "kinematics/geometry/input_error.h"
#include "tools/io/atomic_file.h"

namespace hexcal {
namespace {

Exiv2::Rational rational(double value, int denominator) {
  return {static_cast<std::int32_t>(std::lround(value * denominator)), denominator};
}

Exiv2::ExifData exif_of(const cv::Mat& photograph, const PhotographTags& tags) {
  Exiv2::ExifData exif;
  exif["Exif.Image.Make"] = "NIKON CORPORATION";
  exif["Exif.Image.Model"] = "NIKON D3200";
  exif["Exif.Image.Orientation"] = static_cast<std::uint16_t>(tags.orientation);
  exif["Exif.Image.Software"] = "hexcal simulate";
  exif["Exif.Image.DateTime"] = tags.capture_time;
  exif["Exif.Photo.DateTimeOriginal"] = tags.capture_time;
  exif["Exif.Photo.ExposureTime"] =
      Exiv2::Rational(1, static_cast<std::int32_t>(std::lround(1 / tags.exposure_s)));
  exif["Exif.Photo.FNumber"] = rational(tags.f_number, 10);
  exif["Exif.Photo.ISOSpeedRatings"] = static_cast<std::uint16_t>(tags.iso);
  exif["Exif.Photo.FocalLength"] = rational(tags.focal_mm, 10);
  exif["Exif.Photo.FocalLengthIn35mmFilm"] = static_cast<std::uint16_t>(std::lround(1.5 * tags.focal_mm));
  exif["Exif.Photo.PixelXDimension"] = static_cast<std::uint32_t>(photograph.cols);
  exif["Exif.Photo.PixelYDimension"] = static_cast<std::uint32_t>(photograph.rows);
  exif["Exif.Photo.LensModel"] = tags.lens;
  exif["Exif.Photo.BodySerialNumber"] = tags.serial;
  return exif;
}

}  // namespace

void write_jpeg(const std::filesystem::path& path, const cv::Mat& photograph, const JpegOptions& options,
                const PhotographTags& tags) {
  cv::Mat pixels = photograph;
  if (options.grey) cv::cvtColor(photograph, pixels, cv::COLOR_BGR2GRAY);
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", pixels, bytes, {cv::IMWRITE_JPEG_QUALITY, options.quality});
  const auto image = Exiv2::ImageFactory::open(bytes.data(), static_cast<long>(bytes.size()));
  image->readMetadata();
  image->setExifData(exif_of(photograph, tags));
  image->writeMetadata();
  Exiv2::BasicIo& io = image->io();
  io.open();
  std::string data(static_cast<std::size_t>(io.size()), '\0');
  io.read(reinterpret_cast<Exiv2::byte*>(data.data()), static_cast<long>(data.size()));
  write_file_atomically(path, data);
}

std::string capture_time(int seconds) {
  const int of_day = 9 * 3600 + seconds;
  return fmt::format("2026:03:{:02d} {:02d}:{:02d}:{:02d}", 2 + of_day / 86400, of_day / 3600 % 24,
                     of_day / 60 % 60, of_day % 60);
}

}  // namespace hexcal
