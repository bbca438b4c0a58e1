#pragma once

#include <array>
#include <vector>

#include "photogrammetry/adjustment/network.h"

namespace hexcal {

using Vector8d = Eigen::Matrix<double, 8, 1>;
using Matrix8d = Eigen::Matrix<double, 8, 8>;
using Matrix86d = Eigen::Matrix<double, 8, 6>;

/// Why an observed marker or corner stands outside the adjustment.
enum class SightingStatus {
  used,
  not_measured,  ///< the detector's own status is not ok
  unknown_id,    ///< no marker of the campaign
  repeated_id,   ///< the same id twice in the photograph
  seen_once,     ///< its marker is in no other photograph
  unoriented,    ///< its photograph, pose or marker is not connected with the rest
  outlier,       ///< does not agree with the rest: moved, mislabelled or disturbed
};

/// One marker in one photograph as the adjustment sees it.
struct Sighting {
  int photo = 0;
  int marker = -1;  ///< index into Network::markers
  SightingStatus status = SightingStatus::used;
  Vector8d px = Vector8d::Zero();
  Matrix8d covariance_px2 = Matrix8d::Identity();
  std::array<bool, 4> corner_used{true, true, true, true};
  /// Rows 0..rows-1 take a displacement of all corners to independent unit residuals of the used ones.
  Matrix8d whitener = Matrix8d::Identity();
  int rows = 8;
  double side_px = 0;
};

/// Whitener of the used corners from the covariance; false if that is not positive definite.
bool whiten(Sighting& sighting);

/// All observations of a network in the order of photos and their markers; those that cannot be used are
/// marked.
[[nodiscard]] std::vector<Sighting> collect_sightings(const Network& network);

/// Derivatives of a marker's four projections (rows x0, y0, x1, ...) by perturbations (covariance.h) of the
/// three motions, by the shape (1/mm), the print scale and the camera's parameters.
struct SightingJacobian {
  Matrix86d photo, epoch, marker, shape;
  Vector8d print_scale;
  Eigen::Matrix<double, 8, Eigen::Dynamic, 0, 8, CameraModel::kMaxParameters> interior;
};

/// Chain of motions from a marker to a camera; fixed_from_moving is null for the fixed body.
struct MarkerView {
  const CameraModel& camera;
  const Rigid3& camera_from_fixed;
  const Rigid3* fixed_from_moving;
  const Rigid3& body_from_marker;
};

/// Corner (u, v) s/2 with its shape in the marker's frame, mm.
[[nodiscard]] Eigen::Vector3d corner_in_marker(int corner, double edge_mm, const SquareShape& shape_mm);

/// Projections of the corners; false if one is behind the camera. `jacobian` may be null.
bool project_marker(const MarkerView& view, double size_mm, double print_scale, const SquareShape& shape_mm,
                    Vector8d& px, SightingJacobian* jacobian);

/// The view of a sighting under a geometry.
[[nodiscard]] MarkerView view_of(const Network& network, const NetworkGeometry& geometry,
                                 const Sighting& sighting);

}  // namespace hexcal
