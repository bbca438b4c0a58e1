#pragma once

#include "photogrammetry/markers/photometric_fit.h"
#include "photogrammetry/markers/refine.h"

namespace hexcal {

/// From approximate corners to a fit: edges first, then the photometric fit.
[[nodiscard]] PhotometricFit fit_marker(const cv::Mat& grey, const PhotographModel& photograph,
                                        const MarkerPattern& pattern,
                                        const std::array<Eigen::Vector2d, 4>& corners_px, bool free_tone,
                                        bool free_lens);

/// What is reported of a fit. `noise_factor`: by how much the photograph's noise at edges exceeds its noise
/// model.
[[nodiscard]] MarkerObservation observation_from(const PhotometricFit& fit, const cv::Mat& grey,
                                                 const CameraModel* camera, double noise_factor,
                                                 const RefineOptions& options);

/// Angle between a square's normal and the line of sight, from its corners; by weak perspective without a
/// camera.
[[nodiscard]] double tilt_of_square(const std::array<Eigen::Vector2d, 4>& corners_px,
                                    const CameraModel* camera);

}  // namespace hexcal
