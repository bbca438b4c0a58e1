#pragma once

#include "kinematics/platform.h"

namespace hexcal {

/// The joints of the six legs as arrays, one lane per leg, so that all legs are computed side by side in
/// vector registers. The form in which millions of poses are solved; PlatformGeometry is the form in which
/// they are meant.
struct LegArray {
  using Lanes = Eigen::Array<double, 6, 1>;

  LegArray() = default;
  explicit LegArray(const PlatformGeometry& geometry);

  Lanes ax, ay, az;  ///< base joints in B, mm
  Lanes bx, by, bz;  ///< platform joints in P, mm
};

/// What Newton's method needs at a pose: lengths in mm and the rows of leg_jacobian, by columns.
struct LegLanes {
  LegArray::Lanes length;
  LegArray::Lanes ux, uy, uz;  ///< unit leg vector in B
  LegArray::Lanes mx, my, mz;  ///< moment (R b) x u
};

/// Inverse kinematics of all legs: joint distances in mm.
[[nodiscard]] inline LegVector leg_lengths(const LegArray& legs, const Eigen::Matrix3d& r,
                                           const Eigen::Vector3d& t) {
  const LegArray::Lanes dx = r(0, 0) * legs.bx + r(0, 1) * legs.by + r(0, 2) * legs.bz + (t.x() - legs.ax);
  const LegArray::Lanes dy = r(1, 0) * legs.bx + r(1, 1) * legs.by + r(1, 2) * legs.bz + (t.y() - legs.ay);
  const LegArray::Lanes dz = r(2, 0) * legs.bx + r(2, 1) * legs.by + r(2, 2) * legs.bz + (t.z() - legs.az);
  return (dx * dx + dy * dy + dz * dz).sqrt().matrix();
}

[[nodiscard]] inline LegVector leg_lengths(const LegArray& legs, const Rigid3& B_from_P) {
  return leg_lengths(legs, B_from_P.rotation_matrix(), B_from_P.translation);
}

[[nodiscard]] inline LegLanes leg_lanes(const LegArray& legs, const Eigen::Matrix3d& r,
                                        const Eigen::Vector3d& t) {
  LegLanes out;
  const LegArray::Lanes rx = r(0, 0) * legs.bx + r(0, 1) * legs.by + r(0, 2) * legs.bz;
  const LegArray::Lanes ry = r(1, 0) * legs.bx + r(1, 1) * legs.by + r(1, 2) * legs.bz;
  const LegArray::Lanes rz = r(2, 0) * legs.bx + r(2, 1) * legs.by + r(2, 2) * legs.bz;
  const LegArray::Lanes dx = rx + (t.x() - legs.ax);
  const LegArray::Lanes dy = ry + (t.y() - legs.ay);
  const LegArray::Lanes dz = rz + (t.z() - legs.az);
  out.length = (dx * dx + dy * dy + dz * dz).sqrt();
  const LegArray::Lanes over = out.length.inverse();
  out.ux = dx * over;
  out.uy = dy * over;
  out.uz = dz * over;
  out.mx = ry * out.uz - rz * out.uy;
  out.my = rz * out.ux - rx * out.uz;
  out.mz = rx * out.uy - ry * out.ux;
  return out;
}

}  // namespace hexcal
