#pragma once

#include "photogrammetry/adjustment/sighting.h"

namespace hexcal {

inline constexpr int kMaxModes = 18;  ///< of one feature

/// Chain of motions from a feature to a camera; reference_from_body is null for the reference body.
struct FeatureView {
  const CameraModel& camera;
  const Rigid3& camera_from_reference;
  const Rigid3* reference_from_body;
  const Rigid3& body_from_feature;
};

/// Derivatives of a feature's projections (rows x0, y0, x1, ...) by perturbations (covariance.h) of the three
/// motions, by the shape parameters of its modes, the print scale and the camera's parameters.
struct FeatureJacobian {
  bool with_shape = true;  ///< false: the shape's is not wanted and left as it is
  Matrix86d station = Matrix86d::Zero(), pose = Matrix86d::Zero(), feature = Matrix86d::Zero();
  Eigen::Matrix<double, 8, Eigen::Dynamic, 0, 8, kMaxModes> shape;
  Vector8d print_scale = Vector8d::Zero();
  Eigen::Matrix<double, 8, Eigen::Dynamic, 0, 8, CameraModel::kMaxParameters> interior;
};

/// Projections of points given in the feature's frame, with the modes that moved them there; false if one is
/// behind the camera. `jacobian` may be null. The one place where an adjustment derives a projection.
bool project_feature(const FeatureView& view, const NetworkFeature& feature, const DrawnPoints& printed_mm,
                     double print_scale, Vector8d& px, FeatureJacobian* jacobian);

/// The same of a feature as drawn.
bool project_drawn(const FeatureView& view, const NetworkFeature& feature, Vector8d& px,
                   FeatureJacobian* jacobian);

/// The view of a sighting under a geometry.
[[nodiscard]] FeatureView view_of(const Network& network, const NetworkGeometry& geometry,
                                  const Sighting& sighting);

/// Residual of a sighting, observed minus projected in px; false if a point is behind the camera.
bool residual_px(const Network& network, const NetworkGeometry& geometry, const Sighting& sighting,
                 Vector8d& residual, FeatureJacobian* jacobian);

/// Whitened residual (rows 0..rows-1, zero beyond) and, if asked, derivatives of the whitened projection.
bool whitened_residual(const Network& network, const NetworkGeometry& geometry, const Sighting& sighting,
                       Vector8d& residual, FeatureJacobian* jacobian);

}  // namespace hexcal
