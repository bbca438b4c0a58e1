#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

namespace hexcal {

/// What EXIF says of a photograph. Absent entries are absent in the file.
struct PhotographInfo {
  int width_px = 0;
  int height_px = 0;
  std::optional<std::string> make, model, serial, lens, capture_time;
  std::optional<int> lens_id;  ///< Nikon LensIDNumber
  std::optional<double> focal_length_mm;
  std::optional<int> focus_distance_code;  ///< Nikon's byte v; about 0.01 * 10^(v/40) m
  std::optional<double> f_number;
  std::optional<double> exposure_s;
  std::optional<int> iso;
  std::optional<bool> vibration_reduction;
};

enum class PhotographStatus { ok, missing, empty, unreadable, truncated, too_large };

[[nodiscard]] const char* photograph_status_name(PhotographStatus status);

/// How pixel values came from light: gamma-encoded as in a camera's JPEG (sRGB to start with) or linear as in
/// RAW.
enum class ToneCurve { srgb, linear };

/// A decoded photograph in sensor orientation: the EXIF orientation tag is never applied.
struct Photograph {
  std::filesystem::path path;
  PhotographStatus status = PhotographStatus::unreadable;
  std::string reason;  ///< why status is not ok, in words
  cv::Mat grey;        ///< CV_8UC1 or CV_16UC1 luminance
  ToneCurve tone = ToneCurve::srgb;
  PhotographInfo info;
  std::string sha256;  ///< of the file, hexadecimal
};

/// Reads and decodes one file in any of the formats of photograph_format.h. Never throws for a bad
/// photograph: see status.
[[nodiscard]] Photograph read_photograph(const std::filesystem::path& path);

/// Reads EXIF and the size only.
[[nodiscard]] PhotographInfo read_photograph_info(const std::filesystem::path& path);

}  // namespace hexcal
