#include "tests/faults/image_variants.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace hexcal {
namespace {

// One directory of a little-endian TIFF; values that do not fit into four bytes follow it.
class TiffDirectory {
 public:
  enum Type : std::uint16_t { kByte = 1, kAscii = 2, kShort = 3, kLong = 4, kSignedRational = 10 };

  void add(std::uint16_t tag, Type type, std::uint32_t count, const std::string& value) {
    entries_.push_back({tag, type, count, value});
  }
  void add_short(std::uint16_t tag, std::uint16_t value) { add(tag, kShort, 1, little(value, 2)); }
  void add_long(std::uint16_t tag, std::uint32_t value) { add(tag, kLong, 1, little(value, 4)); }

  // Tags must have been added in rising order; `strip_tag` gets the offset of `data`.
  [[nodiscard]] std::string file(const std::string& data, std::uint16_t strip_tag) const {
    const auto directory = static_cast<std::uint32_t>(2 + 12 * entries_.size() + 4);
    std::uint32_t extra = 8 + directory;
    std::uint32_t extras = 0;
    for (const Entry& entry : entries_) extras += entry.value.size() > 4 ? padded(entry.value.size()) : 0;
    std::string head =
        "II" + little(42, 2) + little(8, 4) + little(static_cast<std::uint32_t>(entries_.size()), 2);
    std::string values;
    for (const Entry& entry : entries_) {
      head += little(entry.tag, 2) + little(entry.type, 2) + little(entry.count, 4);
      if (entry.tag == strip_tag) {
        head += little(8 + directory + extras, 4);
      } else if (entry.value.size() > 4) {
        head += little(extra + static_cast<std::uint32_t>(values.size()), 4);
        values += entry.value + std::string(padded(entry.value.size()) - entry.value.size(), '\0');
      } else {
        head += entry.value + std::string(4 - entry.value.size(), '\0');
      }
    }
    return head + little(0, 4) + values + data;
  }

  static std::string little(std::uint32_t value, int bytes) {
    std::string text;
    for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i) & 0xFFU);
    return text;
  }

 private:
  struct Entry {
    std::uint16_t tag;
    Type type;
    std::uint32_t count;
    std::string value;
  };
  static std::uint32_t padded(std::size_t size) { return static_cast<std::uint32_t>((size + 3) / 4 * 4); }
  std::vector<Entry> entries_;
};

double light_of(std::uint8_t value) {
  const double encoded_value = value / 255.0;
  return encoded_value <= 0.04045 ? encoded_value / 12.92 : std::pow((encoded_value + 0.055) / 1.055, 2.4);
}

}  // namespace

cv::Mat pixels_of(const std::string& jpeg) {
  return cv::imdecode(std::vector<char>(jpeg.begin(), jpeg.end()),
                      cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
}

std::string encoded(const cv::Mat& pixels, const std::string& extension, const std::vector<int>& parameters) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(extension, pixels, bytes, parameters);
  return {bytes.begin(), bytes.end()};
}

cv::Mat sixteen_bit(const cv::Mat& pixels) {
  cv::Mat wide;
  pixels.convertTo(wide, CV_16U, 257);
  return wide;
}

std::string dng_of(const cv::Mat& pixels) {
  std::string data;
  for (int y = 0; y < pixels.rows; ++y) {
    for (int x = 0; x < pixels.cols; ++x) {
      const int channel = y % 2 == 0 ? (x % 2 == 0 ? 2 : 1) : (x % 2 == 0 ? 1 : 0);
      const double light = light_of(pixels.at<cv::Vec3b>(y, x)[channel]);
      data += TiffDirectory::little(static_cast<std::uint32_t>(std::lround(light * 60000)), 2);
    }
  }
  std::string matrix;
  for (int i = 0; i < 9; ++i)
    matrix += TiffDirectory::little(i % 4 == 0 ? 1 : 0, 4) + TiffDirectory::little(1, 4);
  using Tiff = TiffDirectory;
  TiffDirectory tiff;
  tiff.add_long(254, 0);
  tiff.add_long(256, static_cast<std::uint32_t>(pixels.cols));
  tiff.add_long(257, static_cast<std::uint32_t>(pixels.rows));
  tiff.add_short(258, 16);
  tiff.add_short(259, 1);
  tiff.add_short(262, 32803);  // a mosaic
  tiff.add_long(273, 0);       // set to where the data begin
  tiff.add_short(274, 1);
  tiff.add_short(277, 1);
  tiff.add_long(278, static_cast<std::uint32_t>(pixels.rows));
  tiff.add_long(279, static_cast<std::uint32_t>(data.size()));
  tiff.add_short(284, 1);
  tiff.add(33421, Tiff::kShort, 2, Tiff::little(2, 2) + Tiff::little(2, 2));
  tiff.add(33422, Tiff::kByte, 4, std::string("\0\1\1\2", 4));
  tiff.add(50706, Tiff::kByte, 4, std::string("\1\4\0\0", 4));
  tiff.add(50707, Tiff::kByte, 4, std::string("\1\1\0\0", 4));
  tiff.add(50708, Tiff::kAscii, 7, std::string("hexcal\0", 7));
  tiff.add_long(50714, 0);
  tiff.add_long(50717, 60000);
  tiff.add(50721, Tiff::kSignedRational, 9, matrix);
  tiff.add_short(50778, 21);
  return tiff.file(data, 273);
}

std::string jpeg_with_tags(const cv::Mat& pixels, const PhotographTags& tags) {
  const TemporaryFolder folder;
  write_jpeg(folder.path() / "a.jpg", pixels, {}, tags);
  return contents(folder.path() / "a.jpg");
}

}  // namespace hexcal
