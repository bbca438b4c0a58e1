#include "camera_calib/lens_setting.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace hexcal {
namespace {

// EXIF states a zoom's focal length in steps of at most 0.5 mm; a real turn of the ring is more than 1 %.
bool same_focal_length(double a, double b) {
  return std::abs(a - b) <= std::max(0.05, 0.01 * std::min(a, b));
}

bool same_f_number(double a, double b) { return std::abs(a - b) <= 0.02 * std::min(a, b); }

template <typename T, typename Same>
void compare(std::vector<SettingDifference>& out, bool fatal, const char* what,
             const std::optional<T>& camera, const std::optional<T>& photograph, const char* unit,
             Same same) {
  if (!camera || !photograph || same(*camera, *photograph)) return;
  out.push_back(
      {fatal, fmt::format("{}: camera {}{}, photograph {}{}", what, *camera, unit, *photograph, unit)});
}

std::string with_clean_characters(std::string text) {
  for (char& c : text) {
    const bool good = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.';
    if (!good) c = '-';
  }
  return text;
}

}  // namespace

LensSetting lens_setting(const PhotographInfo& info) {
  LensSetting setting;
  setting.width_px = info.width_px;
  setting.height_px = info.height_px;
  setting.make = info.make;
  setting.model = info.model;
  setting.serial = info.serial;
  setting.lens = info.lens;
  setting.lens_id = info.lens_id;
  setting.focal_length_mm = info.focal_length_mm;
  setting.focus_distance_code = info.focus_distance_code;
  setting.f_number = info.f_number;
  setting.vibration_reduction = info.vibration_reduction;
  return setting;
}

std::vector<SettingDifference> compare_setting(const LensSetting& camera, const PhotographInfo& photograph) {
  std::vector<SettingDifference> out;
  const auto equal = [](const auto& a, const auto& b) { return a == b; };
  if (camera.width_px != photograph.width_px || camera.height_px != photograph.height_px) {
    out.push_back({true, fmt::format("image size: camera {} x {} px, photograph {} x {} px", camera.width_px,
                                     camera.height_px, photograph.width_px, photograph.height_px)});
  }
  compare(out, true, "make", camera.make, photograph.make, "", equal);
  compare(out, true, "body", camera.model, photograph.model, "", equal);
  compare(out, true, "serial number", camera.serial, photograph.serial, "", equal);
  compare(out, true, "lens id", camera.lens_id, photograph.lens_id, "", equal);
  if (!camera.lens_id || !photograph.lens_id)
    compare(out, true, "lens", camera.lens, photograph.lens, "", equal);
  compare(out, true, "focal length", camera.focal_length_mm, photograph.focal_length_mm, " mm",
          same_focal_length);
  if (photograph.vibration_reduction.value_or(false)) {
    out.push_back({true, fmt::format("vibration reduction: camera {}, photograph on",
                                     !camera.vibration_reduction          ? "unknown"
                                     : camera.vibration_reduction.value() ? "on"
                                                                          : "off")});
  }
  compare(out, false, "aperture", camera.f_number, photograph.f_number, "", same_f_number);
  compare(out, false, "focus distance code", camera.focus_distance_code, photograph.focus_distance_code, "",
          equal);
  return out;
}

std::string setting_file_stem(const LensSetting& setting) {
  std::vector<std::string> parts{setting.model.value_or("camera")};
  if (setting.serial) parts.push_back(*setting.serial);
  if (setting.lens_id) {
    parts.push_back(fmt::format("lens{}", *setting.lens_id));
  } else if (setting.lens) {
    parts.push_back(*setting.lens);
  }
  if (setting.focal_length_mm) parts.push_back(fmt::format("{:g}mm", *setting.focal_length_mm));
  if (setting.f_number) parts.push_back(fmt::format("f{:g}", *setting.f_number));
  if (setting.focus_distance_code) parts.push_back(fmt::format("focus{}", *setting.focus_distance_code));
  parts.push_back(fmt::format("{}x{}", setting.width_px, setting.height_px));
  for (std::string& part : parts) part = with_clean_characters(part);
  return fmt::format("{}", fmt::join(parts, "_"));
}

}  // namespace hexcal
