#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

namespace hexcal {

/// What the virtual camera writes into a photograph's EXIF.
struct PhotographTags {
  double focal_mm = 35;
  double f_number = 8;
  double exposure_s = 1.0 / 60;
  int iso = 200;
  int orientation = 1;
  std::string serial = "2419077";
  std::string lens = "AF-S DX Nikkor 18-105mm f/3.5-5.6G ED VR";
  std::string capture_time = "2026:03:02 09:00:00";
};

struct JpegOptions {
  int quality = 92;   ///< 4:2:0
  bool grey = false;  ///< one channel instead of three
};

/// Writes a JPEG as a Nikon D3200 would, atomically.
void write_jpeg(const std::filesystem::path& path, const cv::Mat& photograph, const JpegOptions& options,
                const PhotographTags& tags);

/// "2026:03:02 09:00:00" and so many seconds later.
[[nodiscard]] std::string capture_time(int seconds);

}  // namespace hexcal
