#include "photogrammetry/adjustment/projection.h"

namespace hexcal {
namespace {

constexpr double kNearestMm = 1e-3;

}  // namespace

bool project_feature(const FeatureView& view, const NetworkFeature& feature, const DrawnPoints& printed_mm,
                     double print_scale, Vector8d& px, FeatureJacobian* jacobian) {
  const Eigen::Matrix3d camera_reference = view.camera_from_reference.rotation_matrix();
  const Eigen::Matrix3d reference_body = view.reference_from_body != nullptr
                                             ? view.reference_from_body->rotation_matrix()
                                             : Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d body_feature = view.body_from_feature.rotation_matrix();
  const double scale = feature.print_scaled ? 1 + print_scale : 1.0;
  const auto points = static_cast<int>(printed_mm.cols());
  if (points < kMaxFeaturePoints) px.setZero();
  if (jacobian != nullptr) {
    jacobian->interior.resize(8, view.camera.parameters.size());
    if (jacobian->with_shape) jacobian->shape.resize(8, static_cast<Eigen::Index>(feature.modes.size()));
    if (points < kMaxFeaturePoints) {
      jacobian->station.setZero();
      jacobian->pose.setZero();
      jacobian->feature.setZero();
      jacobian->shape.setZero();
      jacobian->print_scale.setZero();
      jacobian->interior.setZero();
    }
  }
  for (int c = 0; c < points; ++c) {
    const Eigen::Vector3d turned_in_body = body_feature * printed_mm.col(c);
    const Eigen::Vector3d in_body = turned_in_body + view.body_from_feature.translation;
    const Eigen::Vector3d turned_in_reference = reference_body * in_body;
    const Eigen::Vector3d in_reference =
        view.reference_from_body != nullptr
            ? Eigen::Vector3d(turned_in_reference + view.reference_from_body->translation)
            : turned_in_reference;
    const Eigen::Vector3d turned_in_camera = camera_reference * in_reference;
    const Eigen::Vector3d x = turned_in_camera + view.camera_from_reference.translation;
    if (x.z() < kNearestMm) return false;
    const Eigen::Vector2d normalised = x.head<2>() / x.z();
    if (jacobian == nullptr) {
      px.segment<2>(2 * c) = view.camera.image_from_normalised(normalised);
      continue;
    }
    Eigen::Matrix2d by_normalised;
    CameraModel::ByParameters by_parameters;
    px.segment<2>(2 * c) = view.camera.image_from_normalised(normalised, &by_normalised, &by_parameters);
    Eigen::Matrix<double, 2, 3> perspective;
    perspective << 1, 0, -normalised.x(), 0, 1, -normalised.y();
    // By the point in the frames of the camera, the reference body, the body and the feature. A motion's
    // perturbation (dt, dr) moves the turned point by dt + dr x turned, hence [I, -skew(turned)]
    // (covariance.h; Barfoot 2017, eq. 7.89, with translation and rotation decoupled).
    const Eigen::Matrix<double, 2, 3> by_camera = by_normalised * perspective / x.z();
    const Eigen::Matrix<double, 2, 3> by_reference = by_camera * camera_reference;
    const Eigen::Matrix<double, 2, 3> by_body = by_reference * reference_body;
    const Eigen::Matrix<double, 2, 3> by_feature = by_body * body_feature;
    jacobian->station.block<2, 6>(2 * c, 0) << by_camera, -by_camera * skew(turned_in_camera);
    jacobian->pose.block<2, 6>(2 * c, 0) << by_reference, -by_reference * skew(turned_in_reference);
    jacobian->feature.block<2, 6>(2 * c, 0) << by_body, -by_body * skew(turned_in_body);
    if (feature.print_scaled) jacobian->print_scale.segment<2>(2 * c) = by_body * (turned_in_body / scale);
    for (std::size_t k = 0; jacobian->with_shape && k < feature.modes.size(); ++k) {
      jacobian->shape.block<2, 1>(2 * c, static_cast<Eigen::Index>(k)) =
          by_feature * (scale * feature.modes[k].displacement_mm.col(c));
    }
    jacobian->interior.middleRows<2>(2 * c) = by_parameters;
  }
  return true;
}

bool project_drawn(const FeatureView& view, const NetworkFeature& feature, Vector8d& px,
                   FeatureJacobian* jacobian) {
  return project_feature(view, feature, feature.drawn_mm, 0, px, jacobian);
}

FeatureView view_of(const Network& network, const NetworkGeometry& geometry, const Sighting& sighting) {
  const auto p = static_cast<std::size_t>(sighting.photo);
  const auto f = static_cast<std::size_t>(sighting.feature);
  const NetworkPhoto& photo = network.photos[p];
  const auto body = static_cast<std::size_t>(network.features[f].body);
  return {geometry.cameras[static_cast<std::size_t>(photo.camera)], geometry.camera_from_reference[p],
          body == kReferenceBody ? nullptr
                                 : &geometry.reference_from_body[body][static_cast<std::size_t>(photo.epoch)],
          geometry.body_from_feature[f]};
}

bool residual_px(const Network& network, const NetworkGeometry& geometry, const Sighting& sighting,
                 Vector8d& residual, FeatureJacobian* jacobian) {
  const NetworkFeature& feature = network.features[static_cast<std::size_t>(sighting.feature)];
  Vector8d px;
  if (!project_feature(view_of(network, geometry, sighting), feature, printed_points(feature, geometry),
                       geometry.print_scale, px, jacobian)) {
    return false;
  }
  residual = sighting.px - px;
  return true;
}

bool whitened_residual(const Network& network, const NetworkGeometry& geometry, const Sighting& sighting,
                       Vector8d& residual, FeatureJacobian* jacobian) {
  if (!residual_px(network, geometry, sighting, residual, jacobian)) return false;
  const Matrix8d& w = sighting.whitener;
  residual = (w * residual).eval();
  if (jacobian == nullptr) return true;
  jacobian->station = (w * jacobian->station).eval();
  jacobian->pose = (w * jacobian->pose).eval();
  jacobian->feature = (w * jacobian->feature).eval();
  if (jacobian->with_shape) jacobian->shape = (w * jacobian->shape).eval();
  jacobian->print_scale = (w * jacobian->print_scale).eval();
  jacobian->interior = (w * jacobian->interior).eval();
  return true;
}

}  // namespace hexcal
