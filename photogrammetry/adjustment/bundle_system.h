#pragma once

#include <Eigen/Core>
#include <vector>

#include "kinematics/geometry/pose.h"
#include "photogrammetry/adjustment/bundle_priors.h"

namespace hexcal {

/// Own station of a photograph after elimination: step = start - by_poses * steps of the epoch's poses -
/// by_common * common step.
struct StationElimination {
  int photo = 0;
  Matrix6d inverse = Matrix6d::Zero();
  Matrix6Xd by_poses;   ///< 6 columns per moving body of the epoch
  Matrix6Xd by_common;  ///< columns as in EpochElimination::columns
  Vector6d start = Vector6d::Zero();
  double decrease = 0;  ///< of the sum of squares, by this unknown
};

/// Epoch after elimination of its own stations and then of the poses of its moving bodies, six rows each.
struct EpochElimination {
  std::vector<int> columns;  ///< common columns that its sightings touch, ascending
  std::vector<StationElimination> stations;
  std::vector<int> bodies;  ///< moving ones with sightings, ascending
  Eigen::MatrixXd inverse;
  Eigen::MatrixXd by_common;
  Eigen::VectorXd start;
  double decrease = 0;

  /// First row of a body's pose; -1 if it has none here.
  [[nodiscard]] int row_of(int body) const;
  /// The photograph's own station; null if it has none here.
  [[nodiscard]] const StationElimination* station_of(int photo) const;
};

/// Normal equations reduced to the common parameters.
struct BundleSystem {
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
  std::vector<EpochElimination> epochs;
};

struct BundleStep {
  Eigen::VectorXd common;
  std::vector<Vector6d> station;            ///< per photo with a station of its own
  std::vector<std::vector<Vector6d>> pose;  ///< per body and epoch
  double predicted_decrease = 0;            ///< of the sum of squares, along the undamped model
};

/// Assembles and reduces; `weights` per sighting (0 leaves it out), `damping` relative to the diagonals.
[[nodiscard]] BundleSystem assemble_bundle(const Network& network, const NetworkGeometry& geometry,
                                           const std::vector<Sighting>& sightings,
                                           const std::vector<double>& weights, const BundleLayout& layout,
                                           const BundleSettings& settings, double damping);

[[nodiscard]] BundleStep solve_bundle(const Network& network, const BundleSystem& system,
                                      const BundleLayout& layout, const BundleSettings& settings);

/// Geometry after a step.
[[nodiscard]] NetworkGeometry stepped(const Network& network, const NetworkGeometry& geometry,
                                      const BundleLayout& layout, const BundleStep& step);

}  // namespace hexcal
