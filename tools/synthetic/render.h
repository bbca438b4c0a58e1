#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "tools/synthetic/ray_lattice.h"
#include "tools/synthetic/surface.h"

namespace hexcal {

/// Directional light with an ambient part, growing linearly through space.
struct Lamp {
  Eigen::Vector3d towards{0.6, -0.3, 0.74};  ///< direction to the lamp (any length)
  double ambient = 0.35;                     ///< irradiance of a surface that faces away
  double strength = 0.65;                    ///< added where a surface faces the lamp
  Eigen::Vector3d gradient_per_mm{0, 0, 0};
};

struct Scene {
  std::vector<Surface> surfaces;
  Lamp lamp;
};

/// Light that falls on the sensor, 1 = clipping, before noise and tone curve.
struct SensorImage {
  cv::Mat light;                            ///< CV_32FC1
  cv::Mat tint;                             ///< CV_8UC1, index into tints
  std::vector<std::array<float, 3>> tints;  ///< red, green, blue factor
  cv::Mat depth_mm;                         ///< CV_32FC1, along the camera's z, where asked for
};

struct OpticsOptions {
  double blur_px = 0.8;                                  ///< standard deviation of the Gaussian point spread
  double exposure = 1.0;                                 ///< factor on all light
  std::array<double, 3> vignetting{-0.40, 0.41, -0.23};  ///< of r^2, r^4, r^6; r = 1 in the frame's corner
  bool depth = false;                                    ///< also SensorImage::depth_mm
  void validate() const;
};

/// Photographs a scene: one ray per sample through the lens to the nearest surface; pixels with an edge take
/// 256 samples of a (0,2)-net (Sobol 1967, scrambled per pixel) on a 4 x 4 grid of sub-pixels, which the blur
/// and the pixel's own area then integrate. The same bytes for any number of threads.
[[nodiscard]] SensorImage render(const Scene& scene, const RayLattice& lens, const Rigid3& camera_from_world,
                                 const OpticsOptions& options, std::uint64_t seed);

enum class ToneCurveKind { srgb, gamma22, s_curve, linear };

/// An ideal sensor and processing (camera_effects.h: real ones). The noise of a pixel in linear light v (1 =
/// clipping) has the variance v / full_well_electrons + read_noise^2, independent between pixels and
/// channels.
struct SensorOptions {
  double full_well_electrons = 8000;                       ///< 0: no shot noise
  double read_noise = 0.0008;                              ///< standard deviation, 1 = clipping
  std::array<float, 3> white_balance{1.02F, 1.0F, 0.95F};  ///< red, green, blue
  ToneCurveKind tone = ToneCurveKind::srgb;
  void validate() const;
};

/// Value in [0, 1] that the tone curve gives for linear light in [0, 1].
[[nodiscard]] double toned(ToneCurveKind tone, double light);

/// 8-bit photograph, CV_8UC3 in OpenCV's order blue, green, red.
[[nodiscard]] cv::Mat develop(const SensorImage& image, const SensorOptions& options, std::uint64_t seed);

}  // namespace hexcal
