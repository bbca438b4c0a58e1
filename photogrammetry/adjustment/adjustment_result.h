#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "kinematics/geometry/covariance.h"
#include "photogrammetry/adjustment/network.h"
#include "photogrammetry/adjustment/sighting.h"

namespace hexcal {

enum class AdjustmentStatus { ok, nothing_connected, not_converged, no_redundancy };

/// Residuals of a group of sightings.
struct ResidualSummary {
  int markers = 0;        ///< sightings used
  int rejected = 0;       ///< sightings taken out as outliers
  double rms_px = 0;      ///< per coordinate
  double worst_px = 0;    ///< largest residual of a point
  double redundancy = 0;  ///< share of the observations that is checked by the others, 0 to 1
};

// Errors of estimates. All estimates of one result share independent errors e of unit variance: the error of
// an estimate is by_error * e, so that the covariance of any two is by_error_a * by_error_b^T, and what is
// computed from estimates carries its error along by the chain rule. Motions of an epoch or a photograph have
// noise of their own beside it, which no other estimate shares.

struct EstimatedPoint {
  Eigen::Vector3d in_body = Eigen::Vector3d::Zero();  ///< mm
  Eigen::Matrix3Xd by_error;
  [[nodiscard]] Eigen::Matrix3d covariance() const { return by_error * by_error.transpose(); }
};

/// The pose of a moving body in an epoch.
struct PoseIndex {
  int epoch = 0;
  int body = kMovingBody;
  PoseIndex(int of_epoch, int of_body = kMovingBody) : epoch(of_epoch), body(of_body) {}  // NOLINT
};

/// Errors are perturbations as in covariance.h.
struct EstimatedMotion {
  Rigid3 motion;
  Matrix6Xd by_error;
  Matrix6d own = Matrix6d::Zero();  ///< covariance of its own noise
  [[nodiscard]] Matrix6d covariance() const { return by_error * by_error.transpose() + own; }
};

struct EstimatedNumber {
  double value = 0;
  Eigen::RowVectorXd by_error;
  [[nodiscard]] double sigma() const { return by_error.norm(); }
};

struct ResultErrors;  // adjustment_errors.h

struct AdjustmentResult {
  AdjustmentStatus status = AdjustmentStatus::nothing_connected;
  std::string reason = "not run";
  NetworkGeometry geometry;
  std::vector<Sighting> sightings;  ///< all, in the order of photos and observations, with their fate
  std::vector<Vector8d>
      residuals_px;  ///< per sighting, observed minus projected; zero where there is no geometry
  std::vector<double> redundancy;  ///< per sighting, 0 to 1
  double sigma0 = 0;  ///< root of the variance factor: residuals over what the observations promised
  double redundancy_total = 0;
  double rms_px = 0;
  bool shape_free = false;  ///< corners were freed
  double size_sigma = 0;    ///< relative spread of the markers' own sizes, where corners were freed
  /// Factor by which the sigmas of the known lengths had to be widened because they contradict each other.
  double length_inflation = 1;
  double interior_chi2 =
      0;  ///< squared distance of the interior orientation from the calibration, in its sigmas
  int interior_dof = 0;
  bool interior_loosened = false;  ///< the prior had to be widened: the camera is not as it was calibrated
  int iterations = 0;
  std::vector<ResidualSummary> photo_residuals, feature_residuals, epoch_residuals;
  std::shared_ptr<const ResultErrors> errors;  ///< null where nothing is connected

  /// Length of e, the columns of every by_error.
  [[nodiscard]] int num_errors() const;
  /// Point 0, 1, ... of a feature of the geometry, or -1 the mean of its points.
  [[nodiscard]] EstimatedPoint point(int feature, int point = -1) const;
  [[nodiscard]] EstimatedMotion body_from_feature(int feature) const;
  [[nodiscard]] EstimatedMotion reference_from_body(PoseIndex pose) const;
  [[nodiscard]] EstimatedMotion camera_from_reference(int photo) const;
  /// Printed lengths over stated ones, minus 1; none where it was not estimated.
  [[nodiscard]] std::optional<EstimatedNumber> print_scale() const;
  /// Covariance of (reference_from_body of pose a, of pose b).
  [[nodiscard]] Matrix6d pose_covariance(PoseIndex a, PoseIndex b) const;
};

}  // namespace hexcal
