#include "kinematics/dh_chain.h"

#include <cassert>
#include <cmath>

#include "kinematics/geometry/nearest_rotation.h"

namespace hexcal {
namespace {

Eigen::Vector3d centroid(const std::array<Eigen::Vector3d, 6>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return sum / 6;
}

// Unit vector across `along`, as near to `wanted` as can be.
Eigen::Vector3d across(const Eigen::Vector3d& wanted, const Eigen::Vector3d& along) {
  const Eigen::Vector3d unit = along.normalized();
  const Eigen::Vector3d rest = wanted - unit * unit.dot(wanted);
  return rest.norm() > 1e-9 * wanted.norm() ? Eigen::Vector3d(rest.normalized()) : unit.unitOrthogonal();
}

Eigen::Matrix3d frame(const Eigen::Vector3d& x, const Eigen::Vector3d& z) {
  Eigen::Matrix3d r;
  r << x, z.cross(x), z;
  return r;
}

// Horizontal tangent at `joint`, made orthogonal to the leg so that the angle between them is 90 deg at home.
Eigen::Vector3d tangent(const Eigen::Vector3d& joint, const Eigen::Vector3d& centre,
                        const Eigen::Vector3d& up, const Eigen::Vector3d& leg) {
  const Eigen::Vector3d around = up.cross(joint - centre);
  return across(around.norm() > 0 ? around : up.unitOrthogonal(), leg);
}

Eigen::Matrix3d rotation_z(double angle) {
  return Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).matrix();
}
Eigen::Matrix3d rotation_y(double angle) {
  return Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).matrix();
}

// Rz(theta1) Rx(-90) Rz(theta2) Rx(90) = Rz(theta1) Ry(theta2), and likewise for the wrist.
Eigen::Matrix3d a_from_3(double theta1, double theta2) { return rotation_z(theta1) * rotation_y(theta2); }

}  // namespace

std::array<LegChain, 6> leg_chains(const PlatformGeometry& geometry) {
  const Rigid3 home = geometry.home_B_from_P();
  const Eigen::Vector3d base_centre = centroid(geometry.base_joints_mm);
  const Eigen::Vector3d platform_centre = home * centroid(geometry.platform_joints_mm);
  const Eigen::Vector3d up = platform_centre - base_centre;
  std::array<LegChain, 6> chains;
  for (std::size_t i = 0; i < 6; ++i) {
    const Eigen::Vector3d& a = geometry.base_joints_mm[i];
    const Eigen::Vector3d b = home * geometry.platform_joints_mm[i];
    const Eigen::Vector3d leg = (b - a).normalized();
    const Eigen::Vector3d z_a = tangent(a, base_centre, up, leg);
    chains[i].B_from_A = Rigid3(frame(leg, z_a), a);
    // At home theta1 = 0 and theta2 = 90 deg, so that x3 = -z_a; z_c on x3's side keeps theta4 off 180 deg.
    Eigen::Vector3d z_c = tangent(b, platform_centre, up, leg);
    if (z_c.dot(z_a) > 0) z_c = -z_c;
    chains[i].P_from_C = Rigid3(home.rotation.conjugate().toRotationMatrix() * frame(-leg, z_c),
                                geometry.platform_joints_mm[i]);
  }
  return chains;
}

Vector6d dh_variables(const LegChain& chain, const Rigid3& B_from_P) {
  const Rigid3 A_from_C = inverse(chain.B_from_A) * B_from_P * chain.P_from_C;
  const Eigen::Vector3d& p = A_from_C.translation;
  const double across_z = std::hypot(p.x(), p.y());
  const double theta1 = across_z > 0 ? std::atan2(p.y(), p.x()) : 0;
  const double theta2 = std::atan2(across_z, p.z());
  const Eigen::Matrix3d r = a_from_3(theta1, theta2).transpose() * A_from_C.rotation_matrix();  // R36
  const double sine5 = std::hypot(r(0, 2), r(1, 2));
  const double theta5 = std::atan2(sine5, r(2, 2));
  double theta4 = std::atan2(r(1, 2), r(0, 2));
  double theta6 = std::atan2(r(2, 1), -r(2, 0));
  if (!(sine5 > 1e-12)) {  // only theta4 + theta6 (or their difference) is determined
    theta6 = 0;
    theta4 = std::atan2(r(1, 0) * r(2, 2), r(1, 1));
  }
  return (Vector6d() << theta1, theta2, p.norm(), theta4, theta5, theta6).finished();
}

Rigid3 a_from_c(const Vector6d& dh) {
  const Eigen::Matrix3d first = a_from_3(dh[0], dh[1]);
  const Eigen::Matrix3d wrist = rotation_z(dh[3]) * rotation_y(dh[4]) * rotation_z(dh[5]);
  return {Eigen::Matrix3d(first * wrist), first.col(2) * dh[2]};
}

Rigid3 pose_along_leg(const LegChain& chain, const Vector6d& dh) {
  return chain.B_from_A * a_from_c(dh) * inverse(chain.P_from_C);
}

Vector6d dh_error(const Vector6d& actual, const Vector6d& target) {
  Vector6d error = actual - target;
  for (const Eigen::Index angle : {0, 1, 3, 4, 5}) error[angle] = wrap_angle(error[angle]);
  return error;
}

Matrix6d dh_table(const std::array<LegChain, 6>& chains, const Rigid3& B_from_P) {
  Matrix6d table;
  for (std::size_t i = 0; i < 6; ++i)
    table.row(static_cast<Eigen::Index>(i)) = dh_variables(chains[i], B_from_P).transpose();
  return table;
}

Matrix6d dh_error_table(const std::array<LegChain, 6>& chains, const Rigid3& actual_B_from_P,
                        const Rigid3& target_B_from_P) {
  Matrix6d table;
  for (std::size_t i = 0; i < 6; ++i) {
    table.row(static_cast<Eigen::Index>(i)) =
        dh_error(dh_variables(chains[i], actual_B_from_P), dh_variables(chains[i], target_B_from_P))
            .transpose();
  }
  return table;
}

Eigen::Vector3d mean_translation(std::span<const Rigid3> motions) {
  assert(!motions.empty());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Rigid3& motion : motions) sum += motion.translation;
  return sum / static_cast<double>(motions.size());
}

Eigen::Quaterniond mean_rotation(std::span<const Rigid3> motions) {
  assert(!motions.empty());
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Rigid3& motion : motions) sum += motion.rotation_matrix();
  return Eigen::Quaterniond(nearest_rotation(sum)).normalized();
}

Rigid3 mean_motion(std::span<const Rigid3> motions) {
  return {mean_rotation(motions), mean_translation(motions)};
}

}  // namespace hexcal
