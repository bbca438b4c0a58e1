#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "photogrammetry/markers/blurred_pattern.h"
#include "photogrammetry/markers/image_noise.h"
#include "photogrammetry/markers/pixel_map.h"
#include "photogrammetry/markers/processing.h"

namespace hexcal {

/// What all markers of a photograph share.
struct PhotographModel {
  PixelMap map;
  ToneResponse tone;
  NoiseModel noise;
  Sharpening sharpening = {};
};

/// Parameters of the photograph that one marker's fit may estimate: the tone curve's two, the lens stand-in's
/// two, the sharpening's two.
constexpr int kNumShared = 6;

/// FitRequest::window_cells of a pattern that is fitted whole.
constexpr double kNoWindow = 1e9;

struct FitRequest {
  BlurredPattern pattern;
  double square_cells = 0;                      ///< the measured square, centred on the pattern
  std::array<Eigen::Vector2d, 4> corners_px{};  ///< of that square, within 0.5 px or so
  bool affine = false;                          ///< no perspective: a saddle point's small window
  bool free_tone = false;
  bool free_lens = false;  ///< only without a camera
  bool free_sharpening = false;
  double lens_sigma = 0.3;  ///< of the lens stand-in's parameters as they are
  /// Half the side of the window of a saddle point in cells; markers are fitted whole.
  double window_cells = kNoWindow;
  int max_pixels = 6000;  ///< more are thinned
  /// From an earlier fit whose corners these are: the coarse stage is left out.
  std::optional<double> blur_px = std::nullopt;
};

struct PhotometricFit {
  bool converged = false;
  std::array<Eigen::Vector2d, 4> corners_px;
  Eigen::Matrix<double, 8, 8> covariance_px2;  ///< for the noise model as it is
  Eigen::Vector2d centre_px;                   ///< image of the square's centre
  Eigen::Matrix2d centre_covariance_px2;
  double chi2_per_dof = 0;
  double misfit = 0;  ///< rms residual over the contrast, both of encoded values
  double covariance_factor =
      1;  ///< by which correlated residuals (JPEG blocks, misfit) make the covariance too small
  double blur_px = 0;
  double black = 0, white = 0;  ///< light, share of full scale
  double visible = 0;           ///< share of the transitions' pixels that agree with the model
  double saturated = 0;         ///< share of the pixels used that clip
  int pixels = 0;
  /// Information of this marker alone about the shared parameters, others marginalised, and its estimate of
  /// them.
  Eigen::Matrix<double, kNumShared, kNumShared> shared_information;
  Eigen::Matrix<double, kNumShared, 1> shared;
};

/// Levenberg-Marquardt on the pixels around the transitions: homography, blur (symmetric 2x2), black, white,
/// illumination gradient, and whatever of the photograph is free. Whitened by the noise model, Huber weights,
/// cells whose pixels disagree as a block are dropped (occlusion).
[[nodiscard]] PhotometricFit fit_pattern(const cv::Mat& grey, const PhotographModel& photograph,
                                         const FitRequest& request);

}  // namespace hexcal
