#pragma once

#include "photogrammetry/markers/photometric_fit.h"
#include "photogrammetry/markers/refine.h"

namespace hexcal {

/// From approximate corners to a fit: edges first, then the photometric fit.
[[nodiscard]] PhotometricFit fit_marker(const cv::Mat& grey, const PhotographModel& photograph,
                                        const MarkerPattern& pattern,
                                        const std::array<Eigen::Vector2d, 4>& corners_px, bool free_tone,
                                        bool free_lens);

/// The same marker again, from its fit with an earlier model of the photograph. With `free_lens` the marker's
/// own curvature may differ a little from that of the photograph's lens stand-in.
[[nodiscard]] PhotometricFit fit_marker_again(const cv::Mat& grey, const PhotographModel& photograph,
                                              const MarkerPattern& pattern, const PhotometricFit& before,
                                              bool free_lens);

/// How a photograph's residuals compare with its noise model.
struct ResidualLevel {
  double noise = 1;        ///< variance at edges over that of the noise model, which JPEG makes too small
  double correlation = 1;  ///< by which neighbouring residuals' correlation enlarges covariances
};

/// What is reported of a fit.
[[nodiscard]] MarkerObservation observation_from(const PhotometricFit& fit, const cv::Mat& grey,
                                                 const CameraModel* camera, const ResidualLevel& level,
                                                 const RefineOptions& options);

/// Angle between a square's normal and the line of sight, from its corners; by weak perspective without a
/// camera.
[[nodiscard]] double tilt_of_square(const std::array<Eigen::Vector2d, 4>& corners_px,
                                    const CameraModel* camera);

}  // namespace hexcal
