#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace hexcal {

/// A rigid motion of space. Named destination first: `base_from_platform` takes coordinates in frame platform
/// to coordinates in frame base, so that adjacent names match in a product:
///   base_from_tool = base_from_platform * platform_from_tool.
/// Translation in mm wherever hexcal uses it; the rotation is a unit quaternion.
struct Rigid3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Rigid3() = default;
  Rigid3(const Eigen::Quaterniond& q, const Eigen::Vector3d& t) : rotation(q.normalized()), translation(t) {}
  Rigid3(const Eigen::Matrix3d& r, const Eigen::Vector3d& t)
      : rotation(Eigen::Quaterniond(r).normalized()), translation(t) {}

  [[nodiscard]] static Rigid3 from_translation(const Eigen::Vector3d& t) {
    return {Eigen::Quaterniond::Identity(), t};
  }
  [[nodiscard]] static Rigid3 from_rotation(const Eigen::Quaterniond& q) {
    return {q, Eigen::Vector3d::Zero()};
  }

  [[nodiscard]] Eigen::Matrix3d rotation_matrix() const { return rotation.toRotationMatrix(); }
  [[nodiscard]] Eigen::Matrix4d matrix() const {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.topLeftCorner<3, 3>() = rotation_matrix();
    m.topRightCorner<3, 1>() = translation;
    return m;
  }
};

[[nodiscard]] inline Rigid3 inverse(const Rigid3& b_from_a) {
  const Eigen::Quaterniond a_from_b = b_from_a.rotation.conjugate();
  return {a_from_b, -(a_from_b * b_from_a.translation)};
}

/// c_from_a = c_from_b * b_from_a.
[[nodiscard]] inline Rigid3 operator*(const Rigid3& c_from_b, const Rigid3& b_from_a) {
  return {c_from_b.rotation * b_from_a.rotation,
          c_from_b.rotation * b_from_a.translation + c_from_b.translation};
}

/// point_in_b = b_from_a * point_in_a.
[[nodiscard]] inline Eigen::Vector3d operator*(const Rigid3& b_from_a, const Eigen::Vector3d& point_in_a) {
  return b_from_a.rotation * point_in_a + b_from_a.translation;
}

/// Matrix of the cross product: skew(a) * b = a x b.
[[nodiscard]] inline Eigen::Matrix3d skew(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// Rotation by the vector's length (rad) about its direction (exponential map of SO(3)).
[[nodiscard]] Eigen::Quaterniond quaternion_from_rotation_vector(const Eigen::Vector3d& rotation_rad);

/// Inverse of quaternion_from_rotation_vector; the length of the result is in [0, pi] rad.
[[nodiscard]] Eigen::Vector3d rotation_vector_from_quaternion(const Eigen::Quaterniond& q);

/// Angle in rad, in [0, pi], of the rotation that takes b to a.
[[nodiscard]] double rotation_distance(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b);

}  // namespace hexcal
