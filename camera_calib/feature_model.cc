#include "camera_calib/feature_model.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace hexcal {
namespace {

using Row = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Jacobian of exp(w) p by w: -[R p]x J_l(w), with the left Jacobian of SO(3) (Barfoot 2017, eq. 7.77).
Eigen::Matrix3d rotated_by_vector(const Eigen::Vector3d& w, const Eigen::Vector3d& rotated) {
  const double angle = w.norm();
  const Eigen::Matrix3d cross = skew(w);
  double a = 0.5;
  double b = 1.0 / 6.0;
  if (angle > 1e-4) {
    a = (1 - std::cos(angle)) / (angle * angle);
    b = (angle - std::sin(angle)) / (angle * angle * angle);
  }
  return -skew(rotated) * (Eigen::Matrix3d::Identity() + a * cross + b * cross * cross);
}

Eigen::Matrix<double, 3, 5> by_deformation(const Eigen::Vector3d& drawn, const Eigen::Vector2d& half) {
  const double u = drawn.x() / half.x();
  const double v = drawn.y() / half.y();
  Eigen::Matrix<double, 3, 5> j = Eigen::Matrix<double, 3, 5>::Zero();
  j.col(0) << 0.5 * drawn.x(), -0.5 * drawn.y(), 0;
  j.col(1) << 0.5 * drawn.y(), 0.5 * drawn.x(), 0;
  j.row(2).tail<3>() << u * u, u * v, v * v;
  return j;
}

}  // namespace

std::vector<Eigen::Vector3d> shaped_points(const Sheet& sheet, const SheetShape& shape) {
  const SheetGeometry geometry = sheet_geometry(sheet);
  std::vector<Eigen::Vector3d> out;
  for (const SheetPoint& point : sheet_points(geometry)) {
    const Eigen::Vector3d& drawn = point.position_mm;
    out.push_back(drawn + by_deformation(drawn, 0.5 * geometry.extent_mm) * shape.deformation);
    if (!shape.shift_mm.empty()) out.back() += shape.shift_mm[out.size() - 1];
  }
  return out;
}

FeatureModel::FeatureModel(const CameraModel& camera, const FeatureObservation& feature,
                           std::vector<Eigen::Vector3d> drawn_mm, const Eigen::Vector2d& half_extent_mm,
                           double extra_sigma_px)
    : camera_(camera), px_(feature.px), drawn_mm_(std::move(drawn_mm)), half_extent_mm_(half_extent_mm) {
  FeatureObservation::Matrix covariance = feature.covariance_px2;
  covariance.diagonal().array() += extra_sigma_px * extra_sigma_px;
  const Eigen::LLT<FeatureObservation::Matrix> llt(covariance);
  whitening_ = FeatureObservation::Matrix::Identity(px_.size(), px_.size());
  llt.matrixL().solveInPlace(whitening_);
}

std::vector<int> FeatureModel::block_sizes() const {
  return {static_cast<int>(camera_.parameters.size()), 6, 5, 3 * static_cast<int>(drawn_mm_.size())};
}

bool FeatureModel::evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  CameraModel camera = camera_;
  camera.parameters = Eigen::Map<const CameraModel::Parameters>(parameters[0], camera_.parameters.size());
  const Eigen::Map<const Eigen::Vector3d> rotation(parameters[1]);
  const Eigen::Map<const Eigen::Vector3d> translation(parameters[1] + 3);
  const Eigen::Map<const Eigen::Matrix<double, 5, 1>> deformation(parameters[2]);
  const Eigen::Matrix3d camera_from_sheet = quaternion_from_rotation_vector(rotation).toRotationMatrix();
  const auto points = static_cast<Eigen::Index>(drawn_mm_.size());
  FeatureObservation::Vector difference(2 * points);
  Eigen::Matrix<double, 8, CameraModel::kMaxParameters> by_camera;
  Eigen::Matrix<double, 8, 6> by_pose;
  Eigen::Matrix<double, 8, 5> by_shape;
  Eigen::Matrix<double, 8, 12> by_shift = Eigen::Matrix<double, 8, 12>::Zero();
  const Eigen::Index n = camera.parameters.size();
  for (Eigen::Index i = 0; i < points; ++i) {
    const Eigen::Vector3d& drawn = drawn_mm_[static_cast<std::size_t>(i)];
    const Eigen::Matrix<double, 3, 5> shape = by_deformation(drawn, half_extent_mm_);
    const Eigen::Vector3d shift = Eigen::Map<const Eigen::Vector3d>(parameters[3] + 3 * i);
    const Eigen::Vector3d rotated = camera_from_sheet * (drawn + shape * deformation + shift);
    const Eigen::Vector3d p = rotated + translation;
    if (!(p.z() > 1e-9)) return false;
    const Eigen::Vector2d normalised = p.head<2>() / p.z();
    Eigen::Matrix2d by_point;
    CameraModel::ByParameters by_parameters;
    const bool wanted = jacobians != nullptr;
    const Eigen::Vector2d px = camera.image_from_normalised(normalised, wanted ? &by_point : nullptr,
                                                            wanted ? &by_parameters : nullptr);
    difference.segment<2>(2 * i) = px_.segment<2>(2 * i) - px;
    if (!wanted) continue;
    Eigen::Matrix<double, 2, 3> perspective;
    perspective << 1, 0, -normalised.x(), 0, 1, -normalised.y();
    const Eigen::Matrix<double, 2, 3> by_p = -by_point * perspective / p.z();
    by_camera.block(2 * i, 0, 2, n) = -by_parameters;
    by_pose.block<2, 3>(2 * i, 0) = by_p * rotated_by_vector(rotation, rotated);
    by_pose.block<2, 3>(2 * i, 3) = by_p;
    by_shape.middleRows<2>(2 * i) = by_p * camera_from_sheet * shape;
    by_shift.block<2, 3>(2 * i, 3 * i) = by_p * camera_from_sheet;
  }
  const Eigen::Index rows = 2 * points;
  Eigen::Map<Eigen::VectorXd>(residuals, rows) = whitening_ * difference;
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr)
    Eigen::Map<Row>(jacobians[0], rows, n) = whitening_ * by_camera.topLeftCorner(rows, n);
  if (jacobians[1] != nullptr) Eigen::Map<Row>(jacobians[1], rows, 6) = whitening_ * by_pose.topRows(rows);
  if (jacobians[2] != nullptr) Eigen::Map<Row>(jacobians[2], rows, 5) = whitening_ * by_shape.topRows(rows);
  if (jacobians[3] != nullptr) {
    Eigen::Map<Row>(jacobians[3], rows, 3 * points) = whitening_ * by_shift.topLeftCorner(rows, 3 * points);
  }
  return true;
}

bool FeatureModel::residual_px(double const* const* parameters, FeatureObservation::Vector& out) const {
  out.resize(px_.size());
  if (!evaluate(parameters, out.data(), nullptr)) return false;
  out = whitening_.triangularView<Eigen::Lower>().solve(out);
  return true;
}

}  // namespace hexcal
