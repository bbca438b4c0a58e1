#pragma once

#include <Eigen/Core>
#include <vector>

#include "kinematics/geometry/rigid3.h"
#include "photogrammetry/camera/camera_model.h"

namespace hexcal {

/// How far two cameras put the same rays apart over the frame, at infinite distance, after the best rotation
/// between them (a rotation is never a camera's own: a campaign's poses absorb it).
struct ProjectionDifference {
  int columns = 0;
  int rows = 0;
  std::vector<Eigen::Vector2d> px;             ///< pixels of the first camera, row by row
  std::vector<Eigen::Vector2d> difference_px;  ///< second minus first
  Eigen::Quaterniond second_from_first = Eigen::Quaterniond::Identity();
  double rms_px = 0;  ///< root mean square length
  double max_px = 0;
};

/// Both cameras must have the same image size. Pixels that the first camera cannot invert are left at zero.
[[nodiscard]] ProjectionDifference projection_difference(const CameraModel& first, const CameraModel& second,
                                                         int columns = 30, int rows = 20);

/// Standard deviation of projection in px (the worst axis) over the same grid, from the covariance of a
/// camera's parameters, with the same best rotation taken out.
struct ProjectionUncertainty {
  int columns = 0;
  int rows = 0;
  std::vector<Eigen::Vector2d> px;
  std::vector<Eigen::Matrix2d> covariance_px2;
  /// Where false, the lens model leads to the pixel from no direction (it folds back before): as uncertain as
  /// the frame is large.
  std::vector<bool> known;

  [[nodiscard]] double sigma_px(std::size_t i) const;
  [[nodiscard]] int unknown() const;
  /// Mean over the known part of the frame of the variance of both coordinates together.
  [[nodiscard]] double mean_variance_px2() const;
};

[[nodiscard]] ProjectionUncertainty projection_uncertainty(const CameraModel& camera,
                                                           const Eigen::MatrixXd& covariance,
                                                           int columns = 30, int rows = 20);

}  // namespace hexcal
