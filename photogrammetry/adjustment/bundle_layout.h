#pragma once

#include <Eigen/Core>
#include <vector>

#include "photogrammetry/adjustment/projection.h"

namespace hexcal {

/// Columns of the parameters that several epochs share ("common"): the cameras' interior orientation, the
/// print scale, shared stations, poses of features on their bodies, shapes. Stations of one photograph and
/// poses of bodies are eliminated before them. Columns ascend in this order.
/// The interior orientation is z with parameters = calibrated + basis * z, basis * basis^T the calibration's
/// covariance, so that z has the unit matrix as its prior and parameters that were not estimated do not move.
struct BundleLayout {
  std::vector<int> interior;                                      ///< per camera: first column
  std::vector<Eigen::MatrixXd> interior_basis, interior_inverse;  ///< inverse * basis = unit matrix
  std::vector<Eigen::VectorXd> interior_start;
  int print_scale = -1;           ///< -1: known
  std::vector<int> station;       ///< per shared station: first of 6 columns, -1: held or not in the network
  std::vector<int> feature_pose;  ///< per feature: first column, -1: known, or holds its body's frame
  std::vector<int> shape;         ///< per shape parameter: column, -1: as drawn
  bool free_shape = false;        ///< some shape has a column
  int num_interior = 0;           ///< columns 0 to num_interior - 1 are the cameras'
  int size = 0;
};

/// Columns of a feature's pose: six, of a single point its position alone.
[[nodiscard]] inline int pose_columns(const NetworkFeature& feature) { return feature.points() == 1 ? 3 : 6; }

/// Which parameters are estimated: `free_shape` adds the shapes, `free_scale` the print scale. Features
/// without used sightings get no columns; on a body of which no feature is known, the best seen one holds the
/// frame.
[[nodiscard]] BundleLayout make_bundle_layout(const Network& network, const NetworkGeometry& geometry,
                                              const std::vector<Sighting>& sightings, bool free_shape,
                                              bool free_scale);

/// All common parameters held: no columns, but the same interior orientation.
[[nodiscard]] BundleLayout without_columns(const BundleLayout& full);

/// Interior coordinates z of a geometry.
[[nodiscard]] Eigen::VectorXd interior_coordinates(const NetworkGeometry& geometry,
                                                   const BundleLayout& layout);

/// Columns that the points of a feature depend on, ascending.
[[nodiscard]] std::vector<int> feature_columns(const Network& network, const BundleLayout& layout,
                                               int feature);

/// Point of a feature (-1: mean of its points) in its body's frame, mm, and its derivatives by
/// feature_columns().
[[nodiscard]] Eigen::Vector3d feature_point(const Network& network, const NetworkGeometry& geometry,
                                            const BundleLayout& layout, int feature, int point,
                                            Eigen::Matrix3Xd* by_columns);

/// Derivatives of a whitened sighting by the common parameters: columns it touches, ascending, and values.
struct CommonJacobian {
  static constexpr int kMax = CameraModel::kMaxParameters + 1 + 6 + 6 + kMaxModes;
  std::array<int, kMax> column{};
  Eigen::Matrix<double, 8, Eigen::Dynamic, 0, 8, kMax> values;
};
void common_jacobian(const Network& network, const BundleLayout& layout, const Sighting& sighting,
                     const FeatureJacobian& jacobian, CommonJacobian& out);

/// The photograph's station is its own and free: eliminated with its epoch.
[[nodiscard]] inline bool has_own_station(const Network& network, int photo) {
  return network.photos[static_cast<std::size_t>(photo)].station < 0;
}

}  // namespace hexcal
