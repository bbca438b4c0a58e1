#include "kinematics/geometry/rigid3.h"

#include <cmath>

namespace hexcal {

Eigen::Quaterniond quaternion_from_rotation_vector(const Eigen::Vector3d& rotation_rad) {
  const double angle = rotation_rad.norm();
  // sin(angle / 2) / angle, by its series where the quotient loses digits.
  const double factor = angle < 1e-4 ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle;
  const Eigen::Vector3d v = factor * rotation_rad;
  return Eigen::Quaterniond(std::cos(0.5 * angle), v.x(), v.y(), v.z()).normalized();
}

Eigen::Vector3d rotation_vector_from_quaternion(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * q.vec();
  const double sine = v.norm();
  const double half_angle = std::atan2(sine, sign * q.w());
  return sine < 1e-12 ? Eigen::Vector3d(2.0 * v) : Eigen::Vector3d(2.0 * half_angle / sine * v);
}

double rotation_distance(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return rotation_vector_from_quaternion(a * b.conjugate()).norm();
}

}  // namespace hexcal
