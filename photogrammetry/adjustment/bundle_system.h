#pragma once

#include <Eigen/Core>
#include <vector>

#include "kinematics/geometry/pose.h"
#include "photogrammetry/adjustment/sighting.h"

namespace hexcal {

using Matrix6Xd = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// Columns of the parameters that all photographs share ("common"): the cameras' interior orientation, the
/// print scale, the markers' poses and shapes. Camera poses and moving-body poses are eliminated before them.
/// The interior orientation is z with parameters = calibrated + basis * z, basis * basis^T the calibration's
/// covariance, so that z has the unit matrix as its prior and parameters that were not estimated do not move.
struct BundleLayout {
  std::vector<int> interior;                                      ///< per camera: first column
  std::vector<Eigen::MatrixXd> interior_basis, interior_inverse;  ///< inverse * basis = unit matrix
  std::vector<Eigen::VectorXd> interior_start;
  int print_scale = -1;  ///< -1: known
  std::vector<int>
      marker_pose;  ///< per marker: first of 6 columns, -1: holds the body's frame, or not in the network
  std::vector<int> marker_shape;  ///< per marker: first of 6 columns, -1: rigid square
  int num_interior = 0;           ///< columns 0 to num_interior - 1 are the cameras'
  int size = 0;
};

struct BundleSettings {
  double data_variance = 1;                ///< factor on all observation covariances
  double squareness_sigma_mm = 0;          ///< prior of the shapes in their plane
  double flatness_sigma_mm = 0;            ///< and out of it
  double print_scale_sigma = 0;            ///< prior of the print scale; 0: none
  std::vector<double> interior_inflation;  ///< per camera: factor on the calibration's sigmas
  double converged = 1e-9;                 ///< decrease of the sum of squares that is no longer worth a step
  bool interior_moves = true;              ///< false: kept, but its uncertainty goes into the covariances
  /// false: all common parameters are known from elsewhere, with a covariance; only photographs and epochs
  /// are estimated, and BundleSystem::normal stays empty.
  bool common_moves = true;
};

/// Photograph after elimination: step = start - by_epoch * epoch step - by_common * common step.
struct PhotoElimination {
  int photo = 0;
  Matrix6d inverse = Matrix6d::Zero();
  Matrix6d by_epoch = Matrix6d::Zero();
  Matrix6Xd by_common;  ///< columns as in EpochElimination::columns
  Vector6d start = Vector6d::Zero();
  double decrease = 0;  ///< of the sum of squares, by this unknown
};

/// Epoch after elimination of its photographs and then of the moving body's pose.
struct EpochElimination {
  std::vector<int> columns;  ///< common columns that its sightings touch
  std::vector<PhotoElimination> photos;
  bool has_pose = false;
  Matrix6d inverse = Matrix6d::Zero();
  Matrix6Xd by_common;
  Vector6d start = Vector6d::Zero();
  double decrease = 0;
};

/// Normal equations reduced to the common parameters.
struct BundleSystem {
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
  std::vector<EpochElimination> epochs;
};

struct BundleStep {
  Eigen::VectorXd common;
  std::vector<Vector6d> photo, epoch;
  double predicted_decrease = 0;  ///< of the sum of squares, along the undamped model
};

/// Whitened residual (observed minus projected, rows 0..rows-1) and, if asked, Jacobian of a sighting; false
/// if a corner is behind the camera.
bool sighting_residual(const Network& network, const NetworkGeometry& geometry, const Sighting& sighting,
                       Vector8d& residual, SightingJacobian* jacobian);

/// Jacobian of the whitened sighting by the common parameters: columns it touches and their derivatives.
struct CommonJacobian {
  static constexpr int kMax = CameraModel::kMaxParameters + 13;
  std::array<int, kMax> column{};
  Eigen::Matrix<double, 8, Eigen::Dynamic, 0, 8, kMax> values;
};
void common_jacobian(const BundleLayout& layout, int camera, const Sighting& sighting,
                     const SightingJacobian& jacobian, CommonJacobian& out);

/// Assembles and reduces; `weights` per sighting (0 leaves it out), `damping` relative to the diagonals.
[[nodiscard]] BundleSystem assemble_bundle(const Network& network, const NetworkGeometry& geometry,
                                           const std::vector<Sighting>& sightings,
                                           const std::vector<double>& weights, const BundleLayout& layout,
                                           const BundleSettings& settings, double damping);

[[nodiscard]] BundleStep solve_bundle(const BundleSystem& system, const BundleLayout& layout,
                                      const BundleSettings& settings, std::size_t num_photos);

/// Geometry after a step.
[[nodiscard]] NetworkGeometry stepped(const NetworkGeometry& geometry, const BundleLayout& layout,
                                      const BundleStep& step);

/// Interior coordinates z of a geometry (see BundleLayout).
[[nodiscard]] Eigen::VectorXd interior_coordinates(const NetworkGeometry& geometry,
                                                   const BundleLayout& layout);

/// Sum of squares of the priors and known lengths; their number of rows goes to `rows` if that is not null.
[[nodiscard]] double prior_cost(const Network& network, const NetworkGeometry& geometry,
                                const BundleLayout& layout, const BundleSettings& settings, int* rows);

/// Point of a marker (corner 0..3, or -1 the mean of the four) in its body's frame, and its derivatives by
/// all common parameters (3 x layout.size).
[[nodiscard]] Eigen::Vector3d marker_point(const Network& network, const NetworkGeometry& geometry,
                                           const BundleLayout& layout, int marker, int corner,
                                           Eigen::Matrix3Xd* by_common);

}  // namespace hexcal
