#pragma once

#include <optional>
#include <string>
#include <vector>

#include "photogrammetry/photograph/photograph.h"

namespace hexcal {

/// The setting of body and lens for which a camera was calibrated: a zoom lens is one camera per setting.
struct LensSetting {
  int width_px = 0;
  int height_px = 0;
  std::optional<std::string> make, model, serial, lens;
  std::optional<int> lens_id;  ///< Nikon LensIDNumber
  std::optional<double> focal_length_mm;
  std::optional<int> focus_distance_code;  ///< Nikon's byte v; about 0.01 * 10^(v/40) m
  std::optional<double> f_number;
  std::optional<bool> vibration_reduction;
};

/// One difference between a camera's setting and a photograph, both values named: "focal length: camera 35
/// mm, photograph 50 mm".
struct SettingDifference {
  bool fatal = false;  ///< body, serial, lens, focal length, image size, VR on; else aperture and focus
  std::string words;
};

[[nodiscard]] LensSetting lens_setting(const PhotographInfo& info);

/// What differs, fatal first. What either side does not say is not compared.
[[nodiscard]] std::vector<SettingDifference> compare_setting(const LensSetting& camera,
                                                             const PhotographInfo& photograph);

/// A file name that tells the setting: "NIKON_D3200_1234567_35mm_f8_focus108".
[[nodiscard]] std::string setting_file_stem(const LensSetting& setting);

}  // namespace hexcal
