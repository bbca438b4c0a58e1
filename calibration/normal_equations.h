#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/leg_residuals.h"

namespace hexcal {

/// Standard deviations that make up the covariance of the leg residuals.
struct LegNoise {
  double leg_sigma_mm = 0;
  /// Factors of the measured covariances of position and of orientation; both 1 where these are known.
  double position_factor = 1;
  double orientation_factor = 1;
};

/// The leg residuals of one pose reduced to what was measured: with m of 6 coordinates observed, the m
/// combinations of legs that the missing ones do not move. Their covariance is
///   by_pose Cov(pose) by_pose^T + sigma_l^2 I.
struct ReducedPose {
  Eigen::VectorXd residuals;  ///< m
  Eigen::MatrixXd jacobian;   ///< m x free parameters
  Eigen::MatrixXd by_pose;    ///< m x 6; zero columns where missing
};

[[nodiscard]] ReducedPose reduce_to_observed(const LegLinearization& legs,
                                             const std::array<bool, 6>& observed,
                                             const ParameterSelection& selection);

/// Sums over the poses of a linearised, whitened least-squares problem.
struct NormalEquations {
  Eigen::MatrixXd information;          ///< J^T C^-1 J
  Eigen::VectorXd gradient;             ///< J^T C^-1 r
  double squares = 0;                   ///< r^T C^-1 r
  double rows = 0;                      ///< number of equations, down-weighted poses counted by their weight
  std::vector<double> squares_of_pose;  ///< without robust weight
  std::vector<Eigen::MatrixXd> information_of_pose;  ///< empty unless asked for

  /// One variance component: C = sum of components. Foerstner's estimate of its factor is
  /// quadratic / (trace - tr(posterior covariance * information)).
  struct Component {
    double quadratic = 0;
    double trace = 0;
    Eigen::MatrixXd information;
    [[nodiscard]] double factor(const Eigen::MatrixXd& posterior) const;
  };
  Component leg;
  Component position;
  Component orientation;
};

struct NormalEquationsRequest {
  bool components = false;
  bool information_of_pose = false;
};

/// `weights`: robust weight of each pose; it divides the covariance of the pose's residuals.
[[nodiscard]] NormalEquations normal_equations(const std::vector<ReducedPose>& reduced,
                                               const ObservationSet& observations,
                                               const std::vector<double>& weights, const LegNoise& noise,
                                               const NormalEquationsRequest& request = {});

/// Covariance of the pose parameters of one pose under the noise model.
[[nodiscard]] Matrix6d pose_covariance(const ObservationSet& observations, std::size_t index,
                                       const LegNoise& noise);

}  // namespace hexcal
