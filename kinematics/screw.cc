#include "kinematics/screw.h"

#include <cassert>
#include <cmath>

#include "kinematics/dh_chain.h"

namespace hexcal {
namespace {

constexpr double kTwoPi = 6.283185307179586;

struct Leg {
  double length = 0;
  Eigen::Vector3d u;
  Eigen::Vector3d arm;
};

Leg leg_at(const PlatformGeometry& geometry, const Rigid3& B_from_P, std::size_t i) {
  Leg leg;
  leg.arm = B_from_P.rotation * geometry.platform_joints_mm[i];
  const Eigen::Vector3d d = leg.arm + B_from_P.translation - geometry.base_joints_mm[i];
  leg.length = d.norm();
  leg.u = d / leg.length;
  return leg;
}

}  // namespace

Twist leg_twist(const Eigen::Vector3d& u, const Eigen::Vector3d& base_axis,
                const Eigen::Vector3d& platform_axis_in_B) {
  const Eigen::Vector3d& nb = base_axis;
  const Eigen::Vector3d& np = platform_axis_in_B;
  const double sine = u.dot(nb.cross(np));
  const double cosine = nb.dot(np) - nb.dot(u) * np.dot(u);
  const double squared = sine * sine + cosine * cosine;
  Twist twist;
  twist.angle_rad = std::atan2(sine, cosine);
  const Eigen::Vector3d sine_by_u = nb.cross(np);
  const Eigen::Vector3d cosine_by_u = -(nb * np.dot(u) + np * nb.dot(u));
  twist.by_u = (cosine * sine_by_u - sine * cosine_by_u) / squared;
  twist.by_platform_axis = (cosine * u.cross(nb) - sine * (nb - u * nb.dot(u))) / squared;
  return twist;
}

LegVector leg_twists(const PlatformGeometry& geometry, const Rigid3& B_from_P) {
  assert(geometry.screw);
  LegVector twists;
  for (std::size_t i = 0; i < 6; ++i) {
    const Leg leg = leg_at(geometry, B_from_P, i);
    twists[static_cast<Eigen::Index>(i)] =
        leg_twist(leg.u, geometry.screw->base_axes[i], B_from_P.rotation * geometry.screw->platform_axes[i])
            .angle_rad;
  }
  return twists;
}

LegVector actuated_lengths(const PlatformGeometry& geometry, const Rigid3& B_from_P) {
  LegVector lengths = leg_lengths(geometry, B_from_P);
  if (geometry.screw) lengths += geometry.screw->lead_mm / kTwoPi * leg_twists(geometry, B_from_P);
  return lengths;
}

Matrix6d actuated_jacobian(const PlatformGeometry& geometry, const Rigid3& B_from_P) {
  Matrix6d j = leg_jacobian(geometry, B_from_P);
  if (!geometry.screw) return j;
  for (std::size_t i = 0; i < 6; ++i) {
    const Leg leg = leg_at(geometry, B_from_P, i);
    const Eigen::Vector3d axis = B_from_P.rotation * geometry.screw->platform_axes[i];
    const Twist twist = leg_twist(leg.u, geometry.screw->base_axes[i], axis);
    // u turns with the platform joint: du = (I - u u^T) (dt + dr x arm) / length; the axis with dr.
    const Eigen::Vector3d by_joint = (twist.by_u - leg.u * leg.u.dot(twist.by_u)) / leg.length;
    Vector6d row;
    row << by_joint, leg.arm.cross(by_joint) + axis.cross(twist.by_platform_axis);
    j.row(static_cast<Eigen::Index>(i)) += geometry.screw->lead_mm / kTwoPi * row.transpose();
  }
  return j;
}

ScrewLead screw_with_tangential_axes(const PlatformGeometry& geometry, double lead_mm) {
  const std::array<LegChain, 6> chains = leg_chains(geometry);
  const Eigen::Quaterniond P_from_B = geometry.home_B_from_P().rotation.conjugate();
  ScrewLead screw;
  screw.lead_mm = lead_mm;
  for (std::size_t i = 0; i < 6; ++i) {
    screw.base_axes[i] = chains[i].B_from_A.rotation * Eigen::Vector3d::UnitZ();
    screw.platform_axes[i] = P_from_B * screw.base_axes[i];
  }
  return screw;
}

}  // namespace hexcal
