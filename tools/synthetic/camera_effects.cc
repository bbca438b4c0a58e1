#include "tools/synthetic/camera_effects.h"

#include <fmt/format.h>

#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

void check_effect(const char* key, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    throw InputError(fmt::format("camera effects: {} is {}, wanted {} to {}", key, value, low, high));
  }
}

// The tone curve that darktable measured for Nikon's four-digit bodies (D3200 among them).
const std::vector<std::array<double, 2>>& nikon_tone_curve() {
  // darktable, src/iop/basecurve.c, preset "nikon like alternate" for the models "NIKON D____".
  static const std::vector<std::array<double, 2>> nodes{
      {0, 0}, {0.012097, 0.007322}, {0.072581, 0.130742}, {0.310484, 0.729291}, {0.611321, 0.951613}, {1, 1}};
  return nodes;
}

}  // namespace

const std::array<double, 9>& d3200_colour_matrix() {
  // dcraw.c, adobe_coeff(), "Nikon D3200", in units of 1/10000.
  static constexpr std::array<double, 9> kMatrix{0.7013, -0.1408, -0.0635, -0.5268, 1.2902,
                                                 0.2640, -0.1470, 0.2801,  0.7379};
  return kMatrix;
}

CameraEffects d3200_effects() {
  CameraEffects effects;
  // Laser print on paper: 0.01 to 0.05 mm a side; the lower end, that of a good print of solid squares.
  effects.print.ink_spread_mm = 0.01;
  effects.print.sheet_curl_mm = 0.3;
  // lensfun, slr-nikon.xml: the very lens (lens_profile.cc).
  effects.lens.lateral_colour = 1;
  // PHOTOGRAPHING.md asks for f/8 to f/11.
  effects.lens.f_number = 11;
  // Assumed: no published measurement of this lens. Half of the depth of focus of f/11 at 2 px.
  effects.lens.field_curvature_mm = 0.05;
  // ISO 9358 figures of zoom lenses are 1 to 3 %.
  effects.lens.veiling_glare = 0.015;
  // Nikon meters so that white paper lies well below clipping; the tone curve lifts it again.
  effects.sensor.exposure = 0.5;
  effects.sensor.demosaicing = Demosaicing::adaptive;
  effects.sensor.colour_matrix = d3200_colour_matrix();
  effects.sensor.hot_pixels_per_mpx = 1;
  effects.sensor.dust_specks = 6;
  effects.processing.tone_curve = nikon_tone_curve();
  effects.processing.noise_reduction = 0.5;
  // Nikon publishes only the step (3 of 9 in Standard). Edges of such JPEGs overshoot by 10 to 15 % of their
  // height, which an unsharp mask of this amount and radius gives on an edge of 0.8 px.
  effects.processing.sharpening = 0.8;
  effects.processing.sharpening_radius_px = 1.0;
  return effects;
}

void CameraEffects::validate() const {
  check_effect("ink_spread_mm", print.ink_spread_mm, 0, 5);
  check_effect("sheet_curl_mm", print.sheet_curl_mm, -50, 50);
  check_effect("sticker_curl_mm", print.sticker_curl_mm, -10, 10);
  check_effect("sticker_gloss", print.sticker_gloss, 0, 10);
  check_effect("tremble_mm", platform.tremble_mm, 0, 100);
  check_effect("tremble_mrad", platform.tremble_mrad, 0, 500);
  check_effect("lateral_colour", lens.lateral_colour, -20, 20);
  if (lens.f_number != 0) check_effect("f_number", lens.f_number, 0.7, 128);
  if (lens.focus_mm != 0) check_effect("focus_mm", lens.focus_mm, 120, 1e6);
  check_effect("field_curvature_mm", lens.field_curvature_mm, -2, 2);
  if (lens.field_curvature_mm != 0 && lens.f_number == 0) {
    throw InputError("camera effects: field_curvature_mm needs f_number, the aperture that blurs");
  }
  check_effect("shake_px", lens.shake_px, 0, 40);
  check_effect("rolling_shutter_px", lens.rolling_shutter_px, 0, 1000);
  check_effect("veiling_glare", lens.veiling_glare, 0, 0.9);
  check_effect("exposure", sensor.exposure, 1e-3, 100);
  check_effect("hot_pixels_per_mpx", sensor.hot_pixels_per_mpx, 0, 1e5);
  check_effect("dust_specks", sensor.dust_specks, 0, 10000);
  check_effect("noise_reduction", processing.noise_reduction, 0, 10);
  check_effect("sharpening amount", processing.sharpening, 0, 20);
  check_effect("sharpening radius_px", processing.sharpening_radius_px, 0.3, 20);
  const auto& nodes = processing.tone_curve;
  if (nodes.size() == 1) throw InputError("camera effects: tone_curve has one node, wanted two or more");
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (i > 0 && !(nodes[i][0] > nodes[i - 1][0] && nodes[i][1] >= nodes[i - 1][1])) {
      throw InputError(
          fmt::format("camera effects: tone_curve node {} ({}, {}) lies not above the one before", i + 1,
                      nodes[i][0], nodes[i][1]));
    }
    for (const double value : nodes[i]) check_effect("tone_curve", value, 0, 1);
  }
}

}  // namespace hexcal
