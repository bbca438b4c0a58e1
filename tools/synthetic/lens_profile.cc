#include "tools/synthetic/lens_profile.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

struct PtLensTerms {
  double focal_mm, a, b, c;
};

// lensfun database, slr-nikon.xml, "Nikon AF-S DX Zoom-Nikkor 18-105mm f/3.5-5.6G ED VR", crop factor 1.534.
constexpr std::array<PtLensTerms, 6> kTerms{{{18, .02437, -.06486, .00154},
                                             {24, .01857, -.03885, .01733},
                                             {35, .00716, -.00354, .00352},
                                             {50, .00477, -.00182, .00982},
                                             {75, -.0024, .02231, -.01516},
                                             {105, -.00026, .02117, -.02621}}};
constexpr double kProfileCrop = 1.534;

struct LateralColourTerms {
  double focal_mm, red_b, red_v, blue_b, blue_v;
};

// The same lens, tca model poly3.
constexpr std::array<LateralColourTerms, 6> kLateralColour{{{18, .0000278, 1.0005774, -.0000782, 1.0002245},
                                                            {24, .0000228, 1.0003575, -.0000433, 1.0002590},
                                                            {35, -.0000268, 1.0001459, .0000296, 1.0002736},
                                                            {50, -.0000121, .9999792, -.0000053, 1.0002278},
                                                            {70, -.0000235, .9998510, -.0000448, 1.0001296},
                                                            {105, .0000014, .9996695, -.0000464, .9998467}}};

// The profile's unit of radius: half the short side of its calibration sensor.
double profile_unit_mm() { return std::hypot(36.0, 24.0) / kProfileCrop / std::hypot(1.5, 1.0) / 2; }

// The two entries of a table around a focal length, and how far it lies between them.
template <typename Table>
auto entries_around(const Table& table, double focal_mm) {
  if (!(focal_mm >= table.front().focal_mm && focal_mm <= table.back().focal_mm)) {
    throw InputError(fmt::format("focal length {} mm: the lens profile reaches from 18 to 105 mm", focal_mm));
  }
  const auto upper = std::find_if(table.begin() + 1, table.end() - 1,
                                  [&](const auto& entry) { return entry.focal_mm >= focal_mm; });
  const auto& low = *(upper - 1);
  return std::tuple(low, *upper, (focal_mm - low.focal_mm) / (upper->focal_mm - low.focal_mm));
}

PtLensTerms terms_at(double focal_mm) {
  const auto [low, high, w] = entries_around(kTerms, focal_mm);
  const auto mix = [&, low = low, high = high, w = w](double a, double b) {
    return ((1 - w) * a * low.focal_mm + w * b * high.focal_mm) / focal_mm;
  };
  return {focal_mm, mix(low.a, high.a), mix(low.b, high.b), mix(low.c, high.c)};
}

}  // namespace

int frame_height_px(int width_px) {
  return static_cast<int>(std::lround(static_cast<double>(width_px) * kSensorHeightPx / kSensorWidthPx));
}

const std::vector<double>& profile_focal_lengths_mm() {
  static const std::vector<double> focal_lengths = [] {
    std::vector<double> all;
    for (const PtLensTerms& terms : kTerms) all.push_back(terms.focal_mm);
    return all;
  }();
  return focal_lengths;
}

CameraModel profile_camera(double focal_mm, int width_px) {
  const PtLensTerms terms = terms_at(focal_mm);
  const double d = 1 - terms.a - terms.b - terms.c;
  const double paraxial_mm = focal_mm * d;
  const double ratio = paraxial_mm / profile_unit_mm();
  CameraModel camera(width_px, frame_height_px(width_px), paraxial_mm * width_px / kSensorWidthMm,
                     LensModel::radial);
  camera.parameters[4] = terms.c * ratio / (d * d);
  camera.parameters[5] = terms.b * ratio * ratio / (d * d * d);
  camera.parameters[6] = terms.a * ratio * ratio * ratio / (d * d * d * d);
  return camera;
}

LateralColour profile_lateral_colour(double focal_mm, int width_px) {
  const auto [low, high, w] = entries_around(kLateralColour, focal_mm);
  const auto mix = [w = w](double a, double b) { return (1 - w) * a + w * b; };
  const auto mix_b = [&, low = low, high = high](double a, double b) {
    return mix(a * low.focal_mm, b * high.focal_mm) / focal_mm;
  };
  LateralColour colour;
  colour.unit_px = profile_unit_mm() * width_px / kSensorWidthMm;
  colour.v = {mix(low.red_v, high.red_v), 1, mix(low.blue_v, high.blue_v)};
  colour.b = {mix_b(low.red_b, high.red_b), 0, mix_b(low.blue_b, high.blue_b)};
  return colour;
}

CameraModel brown_camera(double focal_mm, int width_px) {
  CameraModel camera(width_px, frame_height_px(width_px), focal_mm * width_px / kSensorWidthMm,
                     LensModel::brown);
  // Given at 35 mm; a longer lens bends the same frame about as much, over a smaller angle.
  const double ratio = (focal_mm / 35) * (focal_mm / 35);
  camera.parameters.tail<5>() << -0.055 * ratio, 0.40 * ratio * ratio, 2.0e-4, -1.5e-4,
      -0.30 * ratio * ratio * ratio;
  return camera;
}

}  // namespace hexcal
