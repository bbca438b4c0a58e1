#include <Eigen/SVD>
#include <cmath>

#include "kinematics/platform.h"
#include "kinematics/singularity.h"

namespace hexcal {
namespace {

// Legs that are longer are no machine's; workspaces of such a size take for ever.
constexpr double kLongestLeg = 200;
// Sine of the angle between a screw's leg and the axes of its joints: along the leg they do not hold it.
constexpr double kAlongLeg = 0.01;
// Relative to the machine's size; joints of real machines stand millimetres apart.
constexpr double kCoincident = 1e-6;
// Joints written with three decimals leave this much of an exact singularity.
constexpr double kSingular = 1e-5;

std::string leg(std::size_t i) { return "leg " + std::to_string(i + 1); }

std::optional<std::string> number_fault(const PlatformGeometry& g) {
  for (std::size_t i = 0; i < 6; ++i) {
    if (!g.base_joints_mm[i].allFinite()) return leg(i) + ": base joint is not finite";
    if (!g.platform_joints_mm[i].allFinite()) return leg(i) + ": platform joint is not finite";
    const Actuator& a = g.actuators[i];
    if (!std::isfinite(a.offset_mm) || !std::isfinite(a.mm_per_unit))
      return leg(i) + ": offset_mm or mm_per_unit is not finite";
    if (a.mm_per_unit == 0) return leg(i) + ": mm_per_unit is zero";
    if (!(a.min_mm > 0)) return leg(i) + ": min_mm must be greater than zero";
    if (!(a.max_mm > a.min_mm) || !std::isfinite(a.max_mm))
      return leg(i) + ": max_mm must be greater than min_mm";
  }
  for (const Rigid3* motion : {&g.B_from_UG, &g.P_from_LG}) {
    if (!motion->translation.allFinite() || !motion->rotation.coeffs().allFinite())
      return "B_from_UG or P_from_LG is not finite";
  }
  if (!std::isfinite(g.gd_mm)) return "gd_mm is not finite";
  if (g.joint_limits) {
    const JointLimits& limits = *g.joint_limits;
    if (!(limits.base_rad > 0)) return "the base joints' limit must be greater than zero";
    if (!(limits.platform_rad > 0)) return "the platform joints' limit must be greater than zero";
    if (limits.base_axes_rad && !((*limits.base_axes_rad)[0] > 0 && (*limits.base_axes_rad)[1] > 0))
      return "the limits about the base joints' axes must be greater than zero";
  }
  if (g.min_gap_mm && !(std::isfinite(*g.min_gap_mm) && *g.min_gap_mm <= g.gd_mm))
    return "min_gap_mm must not be greater than gd_mm, the gap at home";
  if (g.leg_radius_mm && !(*g.leg_radius_mm > 0 && std::isfinite(*g.leg_radius_mm)))
    return "the legs' radius must be greater than zero";
  if (g.screw) {
    if (!std::isfinite(g.screw->lead_mm)) return "the screws' lead is not finite";
    for (std::size_t i = 0; i < 6; ++i) {
      if (!(std::abs(g.screw->base_axes[i].norm() - 1) < 1e-6))
        return leg(i) + ": the screw's base axis has no length 1";
      if (!(std::abs(g.screw->platform_axes[i].norm() - 1) < 1e-6))
        return leg(i) + ": the screw's platform axis has no length 1";
    }
  }
  return std::nullopt;
}

bool on_one_line(const std::array<Eigen::Vector3d, 6>& points) {
  Eigen::Matrix<double, 3, 6> m;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / 6;
  for (std::size_t i = 0; i < 6; ++i) m.col(static_cast<Eigen::Index>(i)) = points[i] - mean;
  const Eigen::Vector3d spread = m.jacobiSvd().singularValues();
  return spread[1] <= kCoincident * spread[0];
}

// Legs whose two ends both coincide are one leg; joints may be shared otherwise (3-3 and 6-3 platforms).
std::optional<std::string> joint_fault(const PlatformGeometry& g) {
  const double size = characteristic_length_mm(g);
  if (!(size > 0)) return "all platform joints coincide";
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i + 1; j < 6; ++j) {
      const bool base = (g.base_joints_mm[i] - g.base_joints_mm[j]).norm() <= kCoincident * size;
      const bool platform = (g.platform_joints_mm[i] - g.platform_joints_mm[j]).norm() <= kCoincident * size;
      if (base && platform)
        return "legs " + std::to_string(i + 1) + " and " + std::to_string(j + 1) + " have the same joints";
    }
  }
  if (on_one_line(g.base_joints_mm)) return "all base joints stand on one line, so all legs meet it";
  if (on_one_line(g.platform_joints_mm)) return "all platform joints stand on one line, so all legs meet it";
  return std::nullopt;
}

// Smallest over largest singular value.
double relative_sigma_min(const PlatformGeometry& g, const Rigid3& B_from_P) {
  const Eigen::JacobiSVD<Matrix6d> svd(scaled_jacobian(g, B_from_P, characteristic_length_mm(g)));
  return svd.singularValues()[5] / svd.singularValues()[0];
}

}  // namespace

std::optional<std::string> geometry_fault(const PlatformGeometry& geometry) {
  if (auto fault = number_fault(geometry)) return fault;
  if (auto fault = joint_fault(geometry)) return fault;
  const Rigid3 home = geometry.home_B_from_P();
  const LegVector lengths = leg_lengths(geometry, home);
  for (std::size_t i = 0; i < 6; ++i) {
    if (geometry.actuators[i].max_mm > kLongestLeg * characteristic_length_mm(geometry))
      return leg(i) + ": max_mm is more than 200 times the platform's size";
    if (!geometry.screw) continue;
    const Eigen::Vector3d along =
        (home * geometry.platform_joints_mm[i] - geometry.base_joints_mm[i]).normalized();
    if (along.cross(geometry.screw->base_axes[i]).norm() < kAlongLeg ||
        along.cross(home.rotation * geometry.screw->platform_axes[i]).norm() < kAlongLeg)
      return leg(i) + ": an axis of its screw's joints points along the leg at home";
  }
  for (std::size_t i = 0; i < 6; ++i) {
    if (lengths[static_cast<Eigen::Index>(i)] <= kCoincident * characteristic_length_mm(geometry))
      return leg(i) + ": has no length at home";
  }
  if (relative_sigma_min(geometry, home) > kSingular) return std::nullopt;
  // Singular at home only, or everywhere? Fixed poses in general position decide.
  const double size = characteristic_length_mm(geometry);
  const std::array<Vector6d, 3> probes{(Vector6d() << 0.11, -0.23, 0.07, 0.13, -0.05, 0.21).finished(),
                                       (Vector6d() << -0.31, 0.09, 0.18, -0.22, 0.17, -0.12).finished(),
                                       (Vector6d() << 0.05, 0.27, -0.14, 0.08, 0.29, 0.19).finished()};
  for (Vector6d probe : probes) {
    probe.head<3>() *= size;
    const Rigid3 moved{quaternion_from_rpy(probe.tail<3>()) * home.rotation,
                       home.translation + probe.head<3>()};
    if (relative_sigma_min(geometry, moved) > kSingular) return "home is a singular pose";
  }
  return "the geometry is singular in every pose (architecture singularity)";
}

}  // namespace hexcal
