#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

namespace hexcal {

/// What the printer and the paper do to a marker or sheet.
struct PrintEffects {
  double ink_spread_mm = 0;    ///< every edge of ink lies so much further out (dot gain)
  double sheet_curl_mm = 0;    ///< height of the sheet's middle over its left and right ends
  double sticker_curl_mm = 0;  ///< height of a sticker's middle line over its corners
  double sticker_gloss = 0;    ///< share of the lamp's light mirrored in the middle of the highlight
  bool operator==(const PrintEffects&) const = default;
};

/// How far the platform is from its mean pose in a photograph: sigma per axis, independent between
/// photographs.
struct PlatformEffects {
  double tremble_mm = 0;
  double tremble_mrad = 0;
  bool operator==(const PlatformEffects&) const = default;
};

/// What the lens and a moving camera do to the light.
struct LensEffects {
  double lateral_colour = 0;  ///< 1: red and blue magnified as the lens profile says (lens_profile.h)
  double f_number = 0;        ///< of the aperture that sets the depth of field; 0: all in focus
  double focus_mm = 0;        ///< camera to the plane in focus; 0: in each photograph the mean of the prints
  double field_curvature_mm = 0;  ///< the focus lies so far off the sensor in the frame's corner, like r^2
  double shake_px = 0;            ///< the image moves so far while exposed, in a direction of its own
  double rolling_shutter_px = 0;  ///< the image moves so far between the first row read and the last
  double veiling_glare = 0;       ///< share of the light that spreads over a wide part of the frame
  bool operator==(const LensEffects&) const = default;
};

enum class Demosaicing {
  none,     ///< three full channels
  linear,   ///< Malvar, He and Cutler 2004: gradient-corrected linear interpolation
  adaptive  ///< Hamilton and Adams 1997: green along the edge, then colour differences
};

/// What the sensor does. Pixels are those of the photograph, whatever its width.
struct SensorEffects {
  double exposure = 1;  ///< factor on the light; more than 1.2 clips white paper
  Demosaicing demosaicing = Demosaicing::none;
  /// Row by row XYZ (D65) to the sensor's red, green and blue, as in Adobe's DNG files; none: colours as
  /// seen.
  std::optional<std::array<double, 9>> colour_matrix;
  double hot_pixels_per_mpx = 0;
  int dust_specks = 0;
  bool operator==(const SensorEffects&) const = default;
};

/// What the camera makes of the raw values, in this order.
struct ProcessingEffects {
  /// Picture profile: nodes of a monotone curve from linear to linear light, before the tone curve of the
  /// file.
  std::vector<std::array<double, 2>> tone_curve;
  double noise_reduction = 0;  ///< 1: noise of a few grey values is smoothed away, colour noise over 5 px
  double sharpening = 0;       ///< amount of an unsharp mask of the luminance
  double sharpening_radius_px = 1;  ///< sigma of its Gaussian
  bool operator==(const ProcessingEffects&) const = default;
};

/// What real prints, lenses and cameras add to the ideal photograph. The default adds nothing.
struct CameraEffects {
  PrintEffects print;
  PlatformEffects platform;
  LensEffects lens;
  SensorEffects sensor;
  ProcessingEffects processing;

  bool operator==(const CameraEffects&) const = default;
  [[nodiscard]] bool ideal() const { return *this == CameraEffects{}; }
  /// Throws InputError naming key and value.
  void validate() const;
};

/// The Nikon D3200 with its 18-105 at f/11 on a tripod, JPEG, picture control Standard; sources beside the
/// values.
[[nodiscard]] CameraEffects d3200_effects();

/// Nikon D3200, XYZ to camera, as in dcraw and LibRaw from Adobe's DNG converter.
[[nodiscard]] const std::array<double, 9>& d3200_colour_matrix();

}  // namespace hexcal
