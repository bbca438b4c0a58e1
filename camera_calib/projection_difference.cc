#include "camera_calib/projection_difference.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>

namespace hexcal {
namespace {

std::vector<Eigen::Vector2d> frame_grid(const CameraModel& camera, int columns, int rows) {
  std::vector<Eigen::Vector2d> px;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      px.emplace_back(i * (camera.width_px - 1.0) / (columns - 1), j * (camera.height_px - 1.0) / (rows - 1));
    }
  }
  return px;
}

// Jacobian of a pixel by a small rotation of its ray, exp(w) ray.
Eigen::Matrix<double, 2, 3> by_rotation(const Eigen::Matrix2d& by_point, const Eigen::Vector3d& ray) {
  Eigen::Matrix<double, 2, 3> perspective;
  perspective << 1, 0, -ray.x() / ray.z(), 0, 1, -ray.y() / ray.z();
  return by_point * perspective / ray.z() * -skew(ray);
}

}  // namespace

ProjectionDifference projection_difference(const CameraModel& first, const CameraModel& second, int columns,
                                           int rows) {
  ProjectionDifference out;
  out.columns = columns;
  out.rows = rows;
  out.px = frame_grid(first, columns, rows);
  std::vector<std::optional<Eigen::Vector3d>> rays;
  for (const auto& px : out.px) {
    const auto n = first.normalised_from_image(px);
    rays.push_back(n ? std::optional<Eigen::Vector3d>(n->homogeneous()) : std::nullopt);
  }
  for (int iteration = 0; iteration < 20; ++iteration) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double sum = 0;
    double count = 0;
    out.max_px = 0;
    out.difference_px.assign(out.px.size(), Eigen::Vector2d::Zero());
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (!rays[i]) continue;
      const Eigen::Vector3d ray = out.second_from_first * *rays[i];
      Eigen::Matrix2d by_point;
      const Eigen::Vector2d px = second.image_from_normalised(ray.head<2>() / ray.z(), &by_point, nullptr);
      const Eigen::Vector2d difference = px - out.px[i];
      const Eigen::Matrix<double, 2, 3> j = by_rotation(by_point, ray);
      normal += j.transpose() * j;
      right += j.transpose() * difference;
      out.difference_px[i] = difference;
      sum += difference.squaredNorm();
      out.max_px = std::max(out.max_px, difference.norm());
      count += 1;
    }
    if (count < 3) return out;
    out.rms_px = std::sqrt(sum / count);
    const Eigen::Vector3d step = -normal.ldlt().solve(right);
    if (step.norm() < 1e-13) break;
    out.second_from_first = (quaternion_from_rotation_vector(step) * out.second_from_first).normalized();
  }
  return out;
}

double ProjectionUncertainty::sigma_px(std::size_t i) const {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen;
  eigen.computeDirect(covariance_px2[i], Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, eigen.eigenvalues()[1]));
}

double ProjectionUncertainty::mean_variance_px2() const {
  double sum = 0;
  for (std::size_t i = 0; i < covariance_px2.size(); ++i)
    if (known[i]) sum += covariance_px2[i].trace();
  return sum / std::max(1.0, static_cast<double>(px.size()) - unknown());
}

int ProjectionUncertainty::unknown() const {
  return static_cast<int>(std::count(known.begin(), known.end(), false));
}

ProjectionUncertainty projection_uncertainty(const CameraModel& camera, const Eigen::MatrixXd& covariance,
                                             int columns, int rows) {
  ProjectionUncertainty out;
  out.columns = columns;
  out.rows = rows;
  out.px = frame_grid(camera, columns, rows);
  const double diagonal2 = std::pow(camera.width_px, 2) + std::pow(camera.height_px, 2);
  const Eigen::Index n = camera.parameters.size();
  std::vector<Eigen::MatrixXd> by_parameters;
  std::vector<Eigen::Matrix<double, 2, 3>> by_turn;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(3, n);
  for (const auto& px : out.px) {
    Eigen::Matrix2d by_point = Eigen::Matrix2d::Identity();
    CameraModel::ByParameters j = CameraModel::ByParameters::Zero(2, n);
    Eigen::Matrix<double, 2, 3> turn = Eigen::Matrix<double, 2, 3>::Zero();
    const auto normalised = camera.normalised_from_image(px);
    out.known.push_back(normalised.has_value());
    if (normalised) {
      (void)camera.image_from_normalised(*normalised, &by_point, &j);
      turn = by_rotation(by_point, normalised->homogeneous());
      normal += turn.transpose() * turn;
      right += turn.transpose() * j;
    }
    by_parameters.emplace_back(j);
    by_turn.push_back(turn);
  }
  const Eigen::MatrixXd rotation_by_parameters = normal.ldlt().solve(right);
  for (std::size_t i = 0; i < out.px.size(); ++i) {
    const Eigen::MatrixXd j = by_parameters[i] - by_turn[i] * rotation_by_parameters;
    // A lens that folds back before it reaches a pixel says nothing of it: as uncertain as the frame is
    // large.
    out.covariance_px2.emplace_back(out.known[i] ? Eigen::Matrix2d(j * covariance * j.transpose())
                                                 : Eigen::Matrix2d(diagonal2 * Eigen::Matrix2d::Identity()));
  }
  return out;
}

}  // namespace hexcal
