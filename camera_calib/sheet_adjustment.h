#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "camera_calib/shared_error_factor.h"
#include "camera_calib/sheet.h"
#include "camera_calib/sheet_observation.h"
#include "kinematics/geometry/rigid3.h"
#include "photogrammetry/camera/camera_model.h"

namespace hexcal {

/// How far a printed sheet may differ from its drawing.
enum class BoardFreedom {
  ideal,   ///< as drawn
  warped,  ///< paper stretched and sheared in its plane, bent to a quadratic surface
  points,  ///< every printed point has three free coordinates (calibration with released points)
};

[[nodiscard]] const char* board_freedom_name(BoardFreedom freedom);

/// Shape of a printed sheet; a common scale cannot be seen by a camera and is never estimated.
struct SheetShape {
  /// stretch a: x (1 + a/2), y (1 - a/2); shear s: x + s y / 2, y + s x / 2; sag in mm of z = w1 u^2 + w2 u v
  /// + w3 v^2 with u, v = -1 .. 1 over the pattern.
  Eigen::Matrix<double, 5, 1> deformation = Eigen::Matrix<double, 5, 1>::Zero();
  std::vector<Eigen::Vector3d> shift_mm;  ///< per point, added last; zero unless points are free
};

/// Where the points of a sheet really are, in the sheet's frame (mm), in the order of sheet_points().
[[nodiscard]] std::vector<Eigen::Vector3d> shaped_points(const Sheet& sheet, const SheetShape& shape);

/// One sheet seen in one photograph; every such pair has a pose of its own, so that sheets may be moved
/// freely.
struct SheetView {
  int photograph = 0;
  int sheet = 0;
  Rigid3 camera_from_sheet;
  std::vector<FeatureObservation> features;  ///< only usable ones
  std::vector<char> rejected;                ///< per feature: 1 if an outlier
};

/// All unknowns of a calibration.
struct CalibrationState {
  CameraModel camera;
  std::vector<SheetView> views;
  std::vector<SheetShape> shapes;  ///< per sheet
};

struct SheetAdjustmentOptions {
  BoardFreedom board = BoardFreedom::ideal;
  /// Which camera parameters are free, by index; empty: all but the affinity.
  std::vector<char> free_parameters;
  /// Noise in px of every coordinate beside the measured covariances: what the model leaves unexplained.
  double extra_sigma_px = 0;
  bool robust = false;      ///< Huber's loss at the 99 % point of each feature's chi^2
  bool only_poses = false;  ///< camera and boards stay: for photographs left out of a calibration
  bool with_covariance = true;
  bool with_left_out = false;
  int max_iterations = 50;
  double function_tolerance = 1e-10;  ///< relative change of the cost at which to stop
  double point_prior_mm = 0;          ///< free points: sigma of a shift; 0: 0.5 % of the sheet's diagonal
};

struct SheetAdjustmentResult {
  bool converged = false;
  CalibrationState state;
  std::vector<std::vector<FeatureObservation::Vector>>
      residuals_px;      ///< per view and feature, measured - model
  double chi2 = 0;       ///< of the whitened residuals that were used, without priors
  int observations = 0;  ///< coordinates used
  int unknowns = 0;      ///< free ones, less those that only the priors determine
  SharedErrorFactors shared_errors;
  /// Per photograph with views: its chi^2 by a camera that has not seen it (with_left_out).
  std::vector<double> left_out_chi2;
  /// n x n, widened by shared_errors.largest(), not scaled by sigma0; zero rows for fixed parameters.
  Eigen::MatrixXd camera_covariance;
  std::vector<Eigen::Matrix<double, 6, 6>> pose_covariance;  ///< per view, perturbation of covariance.h

  /// Root mean square distance of the points that were used from where the model has them; 0 without any.
  [[nodiscard]] double rms_px() const;

  [[nodiscard]] double sigma0() const {
    return observations > unknowns ? std::sqrt(chi2 / (observations - unknowns)) : 0.0;
  }
};

/// Maximum-likelihood adjustment of camera, sheet poses and sheet shapes (Levenberg-Marquardt with analytic
/// derivatives; Triggs et al. 2000). Lens coefficients carry a weak prior, half the image radius at the
/// corner, that only keeps undetermined ones finite; free points carry one that fixes the seven freedoms of a
/// free network.
[[nodiscard]] SheetAdjustmentResult adjust_sheets(const std::vector<Sheet>& sheets,
                                                  const CalibrationState& start,
                                                  const SheetAdjustmentOptions& options);

/// Every parameter free but the affinity, which a lens of round elements does not have.
[[nodiscard]] std::vector<char> all_but_affinity(LensModel lens);

}  // namespace hexcal
