#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "photogrammetry/markers/refine.h"

namespace hexcal {

/// A chessboard's inner corner by the photometric fit of refine_saddle(); where that does not converge, by
/// the gradients around it. The covariance is then a guess; the calibration estimates the noise itself.
[[nodiscard]] PointObservation measure_saddle(const cv::Mat& grey, ToneCurve tone, const SaddleGuess& guess);

/// The image of a dot's centre by the photometric fit of refine_dot(), from the centroid and the area of its
/// darkness, so that its nominal radius need not be right; where clipped or processed pixels defeat the fit,
/// by the centroid less the eccentricity (Luhmann 2014). `image_from_plane` near the dot; centre and radius
/// in the plane.
[[nodiscard]] PointObservation measure_dot(const cv::Mat& grey, ToneCurve tone,
                                           const Eigen::Matrix3d& image_from_plane,
                                           const Eigen::Vector2d& centre_in_plane, double radius);

}  // namespace hexcal
