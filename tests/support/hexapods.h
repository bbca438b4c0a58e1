#pragma once

#include <cmath>

#include "kinematics/platform.h"

namespace hexcal {

inline Eigen::Vector3d on_circle(double radius_mm, double angle_deg) {
  return {radius_mm * std::cos(angle_deg * kRadPerDeg), radius_mm * std::sin(angle_deg * kRadPerDeg), 0};
}

/// A plausible stand-in for the paper's machine, whose geometry is not published.
inline PlatformGeometry surrogate_hexapod() {
  PlatformGeometry g;
  const std::array<double, 6> base_deg{12, 108, 132, 228, 252, 348};
  const std::array<double, 6> platform_deg{48, 72, 168, 192, 288, 312};
  for (std::size_t i = 0; i < 6; ++i) {
    g.base_joints_mm[i] = on_circle(260, base_deg[i]);
    g.platform_joints_mm[i] = on_circle(150, platform_deg[i]);
    g.actuators[i] = {0, 1, 380, 580};
  }
  g.B_from_UG = Rigid3::from_translation({0, 0, 550});
  g.P_from_LG = Rigid3::from_translation({0, 0, 70});
  g.gd_mm = 50;
  g.joint_limits = JointLimits{45 * kRadPerDeg, 45 * kRadPerDeg};
  return g;
}

/// Nategh & Agheli's nominal hexapod (github tabathaviso/hexapod-parallel-manipulator); home at z 800 mm.
inline PlatformGeometry nategh_agheli_hexapod() {
  PlatformGeometry g;
  const std::array<double, 6> ux{305.4001, -56.4357, -248.9644, -248.9644, -56.4357, 305.4001};
  const std::array<double, 6> uy{111.1565, 320.0625, 208.9060, -208.9060, -320.0625, -111.1565};
  const std::array<double, 6> sx{92.1597, 27.055, -119.2146, -119.2146, 27.055, 92.1597};
  const std::array<double, 6> sy{84.4488, 122.037, 37.58822, -37.5882, -122.037, -84.4488};
  for (std::size_t i = 0; i < 6; ++i) {
    g.base_joints_mm[i] = {ux[i], uy[i], 0};
    g.platform_joints_mm[i] = {sx[i], sy[i], 0};
    g.actuators[i] = {604.8652, 1, 604.8652, 1100};
  }
  g.B_from_UG = Rigid3::from_translation({0, 0, 800});
  g.joint_limits = JointLimits{45 * kRadPerDeg, 45 * kRadPerDeg};  // not published
  return g;
}

/// The Jugglebot's nominal geometry (Project-DeepBlue-Juggling/Jugglebot); home is its initial height.
inline PlatformGeometry jugglebot_hexapod() {
  PlatformGeometry g;
  g.B_from_UG = Rigid3::from_translation({0, 0, 565});
  for (std::size_t i = 0; i < 6; ++i) {
    const auto f = static_cast<double>(i / 2);
    const auto s = static_cast<double>((i + 1) / 2);
    g.base_joints_mm[i] = on_circle(410, 200 + 100 * f + 20 * s);
    g.platform_joints_mm[i] = on_circle(219.075, 154.3012223 + 8.6024446 * f + 111.3975554 * s);
  }
  const LegVector home_mm = leg_lengths(g, g.home_B_from_P());
  for (std::size_t i = 0; i < 6; ++i) {
    const double length = home_mm[static_cast<Eigen::Index>(i)];
    g.actuators[i] = {length, 1, length - 1, length + 280};
  }
  g.joint_limits = JointLimits{45 * kRadPerDeg, 45 * kRadPerDeg};  // not published
  return g;
}

}  // namespace hexcal
