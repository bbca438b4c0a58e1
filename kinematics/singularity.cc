#include "kinematics/singularity.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <limits>

#include "kinematics/geometry/covariance.h"
#include "kinematics/geometry/input_error.h"
#include "kinematics/leg_elimination.h"

namespace hexcal {
namespace {

// d(sigma)/d(dt, length dr) for a singular triple: left^T (dJ) right, with dJ of each row from
//   du = (I - u u^T)/l (dt + dr x arm),  d(arm) = dr x arm.
Vector6d sigma_gradient(const PlatformGeometry& geometry, const Rigid3& B_from_P, double length_mm,
                        const Vector6d& left, const Vector6d& right) {
  const Eigen::Vector3d centroid = platform_centroid_mm(geometry);
  const Eigen::Vector3d v = right.head<3>();
  const Eigen::Vector3d w = right.tail<3>() / length_mm;
  Vector6d gradient = Vector6d::Zero();
  for (std::size_t i = 0; i < 6; ++i) {
    const Eigen::Vector3d arm = B_from_P.rotation * (geometry.platform_joints_mm[i] - centroid);
    const Eigen::Vector3d d = B_from_P * geometry.platform_joints_mm[i] - geometry.base_joints_mm[i];
    const Eigen::Vector3d u = d.normalized();
    // row . right = u . (v + w x arm) = u . s
    const Eigen::Vector3d s = v + w.cross(arm);
    const Eigen::Vector3d by_joint = (s - u * u.dot(s)) / d.norm();
    const Eigen::Vector3d by_arm = u.cross(w);
    const double weight = left[static_cast<Eigen::Index>(i)];
    gradient.head<3>() += weight * by_joint;
    gradient.tail<3>() += weight * arm.cross(by_joint + by_arm) / length_mm;
  }
  return gradient;
}

struct SingularValues {
  Vector6d sigma;  // falling
  Vector6d left;   // of the smallest
  Vector6d right;
};

// The eigenvalues of J J^T cost a quarter of an SVD and give sigma_min to about 1e-16 condition^2,
// relatively; the SVD takes over where that is not enough.
SingularValues singular_values(const Matrix6d& j) {
  SingularValues result;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(j * j.transpose());
  const Vector6d squared = eigen.eigenvalues().reverse();
  if (squared[5] > 1e-8 * squared[0]) {
    result.sigma = squared.cwiseSqrt();
    result.left = eigen.eigenvectors().col(0);
    result.right = j.transpose() * result.left / result.sigma[5];
    return result;
  }
  const Eigen::JacobiSVD<Matrix6d> svd(j, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.singularValues(), svd.matrixU().col(5), svd.matrixV().col(5)};
}

double length_used_mm(const PlatformGeometry& geometry, const SingularityOptions& options) {
  return options.characteristic_length_mm > 0 ? options.characteristic_length_mm
                                              : characteristic_length_mm(geometry);
}

}  // namespace

void SingularityOptions::validate() const {
  if (!(characteristic_length_mm >= 0) || !std::isfinite(characteristic_length_mm))
    throw InputError("SingularityOptions.characteristic_length_mm must not be negative");
  if (!(near_mm >= 0)) throw InputError("SingularityOptions.near_mm must not be negative");
  if (!(near_deg >= 0)) throw InputError("SingularityOptions.near_deg must not be negative");
  if (!(near_gain >= 1)) throw InputError("SingularityOptions.near_gain must be at least 1");
}

Matrix6d scaled_jacobian(const PlatformGeometry& geometry, const Rigid3& B_from_P,
                         double characteristic_length_mm) {
  const Eigen::Vector3d centroid = platform_centroid_mm(geometry);
  Matrix6d j;
  for (std::size_t i = 0; i < 6; ++i) {
    const Eigen::Vector3d arm = B_from_P.rotation * (geometry.platform_joints_mm[i] - centroid);
    const Eigen::Vector3d u =
        (B_from_P * geometry.platform_joints_mm[i] - geometry.base_joints_mm[i]).normalized();
    j.row(static_cast<Eigen::Index>(i)) << u.transpose(), arm.cross(u).transpose() / characteristic_length_mm;
  }
  return j;
}

HomeSingularity::HomeSingularity(const PlatformGeometry& geometry, double length_mm)
    : characteristic_length_mm(length_mm) {
  const Matrix6d j = scaled_jacobian(geometry, geometry.home_B_from_P(), length_mm);
  determinant = j.determinant();
  sigma_min = j.jacobiSvd().singularValues()[5];
}

SingularityMeasures singularity_measures(const PlatformGeometry& geometry, const Rigid3& B_from_P,
                                         const SingularityOptions& options) {
  options.validate();
  return singularity_measures(geometry, HomeSingularity(geometry, length_used_mm(geometry, options)),
                              B_from_P, options);
}

SingularityMeasures singularity_measures(const PlatformGeometry& geometry, const HomeSingularity& home,
                                         const Rigid3& B_from_P, const SingularityOptions& options) {
  SingularityMeasures m;
  m.characteristic_length_mm = length_used_mm(geometry, options);
  const double length_mm = m.characteristic_length_mm;
  const Matrix6d j = scaled_jacobian(geometry, B_from_P, length_mm);
  const SingularValues svd = singular_values(j);
  const Vector6d& sigma = svd.sigma;
  constexpr double kFar = std::numeric_limits<double>::infinity();
  m.determinant = j.determinant();
  m.sigma_min = sigma[5];
  m.condition = sigma[5] > 0 ? sigma[0] / sigma[5] : kFar;
  m.weakest_motion = svd.right;
  m.worst_gain_mm = sigma[5] > 0 ? m.weakest_motion.head<3>().norm() / sigma[5] : kFar;
  m.worst_gain_deg =
      sigma[5] > 0 ? m.weakest_motion.tail<3>().norm() / sigma[5] / length_mm * kDegPerRad : kFar;
  const Vector6d gradient = sigma_gradient(geometry, B_from_P, length_mm, svd.left, m.weakest_motion);
  const double by_mm = gradient.head<3>().norm();
  const double by_rad = gradient.tail<3>().norm() * length_mm;
  m.distance_mm = by_mm > 0 ? sigma[5] / by_mm : kFar;
  m.distance_deg = by_rad > 0 ? sigma[5] / by_rad * kDegPerRad : kFar;
  m.same_side_as_home = m.determinant * home.determinant > 0;
  m.near_singular = m.distance_mm < options.near_mm || m.distance_deg < options.near_deg ||
                    m.sigma_min * options.near_gain < home.sigma_min;
  return m;
}

SingularityBounds singularity_bounds(const PlatformGeometry& geometry, const Rigid3& B_from_P,
                                     double length_mm) {
  const Matrix6d j = scaled_jacobian(geometry, B_from_P, length_mm);
  LegElimination::Columns columns;
  for (std::size_t k = 0; k < 6; ++k) columns[k] = j.col(static_cast<Eigen::Index>(k)).array();
  LegElimination elimination;
  SingularityBounds bounds;
  if (!elimination.factor(columns)) {
    bounds.determinant = j.determinant();
    return bounds;
  }
  bounds.determinant = elimination.determinant();
  double inverse2 = 0;
  for (Eigen::Index i = 0; i < 6; ++i)
    inverse2 += elimination.solve(LegElimination::Lanes(Vector6d::Unit(i).array())).squaredNorm();
  if (!(inverse2 <= std::numeric_limits<double>::max())) return bounds;
  bounds.sigma_min = 1 / std::sqrt(inverse2);
  // The terms of sigma_gradient at their largest: |s|^2 <= 1 + (arm / length)^2, |w| <= 1 / length, and the
  // six legs' weights make a unit vector.
  const Eigen::Vector3d centroid = platform_centroid_mm(geometry);
  double by_mm2 = 0;
  double by_rad2 = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    const double arm2 = (geometry.platform_joints_mm[i] - centroid).squaredNorm();
    const Eigen::Vector3d d = B_from_P * geometry.platform_joints_mm[i] - geometry.base_joints_mm[i];
    const double by_joint2 = (1 + arm2 / (length_mm * length_mm)) / d.squaredNorm();
    by_mm2 += by_joint2;
    by_rad2 += arm2 * std::pow(std::sqrt(by_joint2) + 1 / length_mm, 2);
  }
  bounds.distance_mm = bounds.sigma_min / std::sqrt(by_mm2);
  bounds.distance_deg = bounds.sigma_min / std::sqrt(by_rad2) * kDegPerRad;
  return bounds;
}

}  // namespace hexcal
