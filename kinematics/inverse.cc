#include "kinematics/inverse.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "kinematics/screw.h"

namespace hexcal {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr double kRightAngle = 90 * kRadPerDeg;

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// Distance between the segments p0 p1 and q0 q1 (Eberly, "Robust computation of distance between line
// segments", 2018, in its simplest form: the interior minimum if it is inside, else the nearest of the four
// ends).
double segment_distance(const Eigen::Vector3d& p0, const Eigen::Vector3d& p1, const Eigen::Vector3d& q0,
                        const Eigen::Vector3d& q1) {
  const auto from_point = [](const Eigen::Vector3d& x, const Eigen::Vector3d& e0, const Eigen::Vector3d& e1) {
    const Eigen::Vector3d e = e1 - e0;
    const double s = std::clamp(e.dot(x - e0) / e.squaredNorm(), 0.0, 1.0);
    return (e0 + s * e - x).norm();
  };
  double nearest = std::min(std::min(from_point(p0, q0, q1), from_point(p1, q0, q1)),
                            std::min(from_point(q0, p0, p1), from_point(q1, p0, p1)));
  const Eigen::Vector3d u = p1 - p0;
  const Eigen::Vector3d v = q1 - q0;
  const Eigen::Vector3d w = p0 - q0;
  const double uu = u.squaredNorm();
  const double vv = v.squaredNorm();
  const double uv = u.dot(v);
  const double det = uu * vv - uv * uv;
  if (det > 1e-12 * uu * vv) {
    const double s = (uv * v.dot(w) - vv * u.dot(w)) / det;
    const double t = (uu * v.dot(w) - uv * u.dot(w)) / det;
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1) nearest = std::min(nearest, (w + s * u - t * v).norm());
  }
  return nearest;
}

struct Worst {
  double margin = kFar;
  int leg = -1;
  void take(double value, int candidate) {
    if (value < margin) {
      margin = value;
      leg = candidate;
    }
  }
};

struct Clearance {
  double mm = kFar;
  int leg = -1;
  int other_leg = -1;
};

// Legs that share a joint, or whose joints stand closer than the legs are thick, touch there by construction:
// such pairs are not judged.
Clearance leg_clearance(const PlatformGeometry& geometry, const Rigid3& B_from_P) {
  const double thickness = 2 * *geometry.leg_radius_mm;
  Clearance nearest;
  std::array<Eigen::Vector3d, 6> ends;
  for (std::size_t i = 0; i < 6; ++i) ends[i] = B_from_P * geometry.platform_joints_mm[i];
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i + 1; j < 6; ++j) {
      const auto& a = geometry.base_joints_mm;
      if ((a[i] - a[j]).norm() <= thickness || (ends[i] - ends[j]).norm() <= thickness) continue;
      const double mm = segment_distance(a[i], ends[i], a[j], ends[j]) - thickness;
      if (mm < nearest.mm) nearest = {mm, static_cast<int>(i), static_cast<int>(j)};
    }
  }
  return nearest;
}

// Height of the upper grip's plate over O_LG beyond the least one.
double gap_beyond_least(const PlatformGeometry& geometry, const Rigid3& B_from_P) {
  if (!geometry.min_gap_mm && geometry.gd_mm <= 0) return kFar;
  const Eigen::Vector3d in_UG = inverse(geometry.B_from_UG) * (B_from_P * geometry.P_from_LG.translation);
  return -in_UG.z() - geometry.min_gap_mm.value_or(0);
}

}  // namespace

const char* name(PoseVerdict verdict) {
  switch (verdict) {
    case PoseVerdict::reachable:
      return "ok";
    case PoseVerdict::too_short:
      return "too_short";
    case PoseVerdict::too_long:
      return "too_long";
    case PoseVerdict::base_joint:
      return "base_joint";
    case PoseVerdict::platform_joint:
      return "platform_joint";
    case PoseVerdict::legs_collide:
      return "legs_collide";
    case PoseVerdict::grips_collide:
      return "grips_collide";
    case PoseVerdict::beyond_singular:
      return "beyond_singular";
    case PoseVerdict::near_singular:
      return "near_singular";
    case PoseVerdict::not_a_pose:
      return "not_a_pose";
  }
  return "ok";
}

RestState::RestState(const PlatformGeometry& geometry)
    : home(geometry.home_B_from_P()),
      chains(leg_chains(geometry)),
      home_singularity(geometry, characteristic_length_mm(geometry)) {
  for (std::size_t i = 0; i < 6; ++i) {
    base_rest[i] = (home * geometry.platform_joints_mm[i] - geometry.base_joints_mm[i]).normalized();
    platform_rest[i] = home.rotation.conjugate() * base_rest[i];
  }
}

InverseResult inverse_kinematics(const PlatformGeometry& geometry, const RestState& rest,
                                 const Rigid3& B_from_P, const InverseOptions& options) {
  InverseResult result;
  result.lengths_mm = leg_lengths(geometry, B_from_P);
  const LegVector actuated_mm = geometry.screw ? actuated_lengths(geometry, B_from_P) : result.lengths_mm;
  result.readings = readings_from_lengths(geometry, actuated_mm);

  if (!actuated_mm.allFinite()) {
    result.verdict = PoseVerdict::not_a_pose;
    return result;
  }
  Worst shortest;
  Worst longest;
  Worst base;
  Worst platform;
  const Eigen::Quaterniond P_from_B = B_from_P.rotation.conjugate();
  for (std::size_t i = 0; i < 6; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const int leg = static_cast<int>(i);
    const Eigen::Vector3d u =
        (B_from_P * geometry.platform_joints_mm[i] - geometry.base_joints_mm[i]).normalized();
    shortest.take(actuated_mm[k] - geometry.actuators[i].min_mm, leg);
    longest.take(geometry.actuators[i].max_mm - actuated_mm[k], leg);
    result.base_angles_rad[k] = angle_between(u, rest.base_rest[i]);
    result.platform_angles_rad[k] = angle_between(P_from_B * u, rest.platform_rest[i]);
    const Eigen::Vector3d in_a = rest.chains[i].B_from_A.rotation.conjugate() * u;
    result.base_axis_angles_rad(k, 0) = std::atan2(in_a.y(), in_a.x());
    result.base_axis_angles_rad(k, 1) = std::atan2(std::hypot(in_a.x(), in_a.y()), in_a.z()) - kRightAngle;
    if (!geometry.joint_limits) continue;
    const JointLimits& limits = *geometry.joint_limits;
    base.take(limits.base_rad - result.base_angles_rad[k], leg);
    platform.take(limits.platform_rad - result.platform_angles_rad[k], leg);
    if (limits.base_axes_rad) {
      base.take((*limits.base_axes_rad)[0] - std::abs(result.base_axis_angles_rad(k, 0)), leg);
      base.take((*limits.base_axes_rad)[1] - std::abs(result.base_axis_angles_rad(k, 1)), leg);
    }
  }
  result.stroke_margin_mm = std::min(shortest.margin, longest.margin);
  result.joint_margin_rad = std::min(base.margin, platform.margin);
  Clearance clearance;
  if (geometry.leg_radius_mm) clearance = leg_clearance(geometry, B_from_P);
  result.clearance_mm = clearance.mm;
  result.gap_mm = gap_beyond_least(geometry, B_from_P);
  bool same_side = true;
  SingularityBounds bounds;
  const bool own_length = options.near.characteristic_length_mm > 0;
  if (options.singularity && !options.measure_all && !own_length)
    bounds = singularity_bounds(geometry, B_from_P, rest.home_singularity.characteristic_length_mm);
  if (options.singularity && bounds.clear_of(options.near, rest.home_singularity)) {
    same_side = bounds.determinant * rest.home_singularity.determinant > 0;
  } else if (options.singularity) {
    result.singularity = own_length
                             ? singularity_measures(geometry, B_from_P, options.near)
                             : singularity_measures(geometry, rest.home_singularity, B_from_P, options.near);
    same_side = result.singularity->same_side_as_home;
  } else {
    same_side = leg_jacobian(geometry, B_from_P).determinant() * rest.home_singularity.determinant > 0;
  }

  const auto broken = [&result](PoseVerdict verdict, int leg) {
    result.verdict = verdict;
    result.leg = leg;
  };
  if (result.stroke_margin_mm < 0) {
    const bool is_short = shortest.margin < longest.margin;
    broken(is_short ? PoseVerdict::too_short : PoseVerdict::too_long, is_short ? shortest.leg : longest.leg);
  } else if (base.margin < 0) {
    broken(PoseVerdict::base_joint, base.leg);
  } else if (platform.margin < 0) {
    broken(PoseVerdict::platform_joint, platform.leg);
  } else if (clearance.mm < 0) {
    broken(PoseVerdict::legs_collide, clearance.leg);
    result.other_leg = clearance.other_leg;
  } else if (result.gap_mm < 0) {
    broken(PoseVerdict::grips_collide, -1);
  } else if (!same_side) {
    broken(PoseVerdict::beyond_singular, -1);
  } else if (result.singularity && result.singularity->near_singular) {
    broken(PoseVerdict::near_singular, -1);
  }
  return result;
}

InverseResult inverse_kinematics(const PlatformGeometry& geometry, const Rigid3& B_from_P,
                                 const InverseOptions& options) {
  return inverse_kinematics(geometry, RestState(geometry), B_from_P, options);
}

std::string reason(const InverseResult& result) {
  const auto k = static_cast<Eigen::Index>(result.leg);
  const int leg = result.leg + 1;
  switch (result.verdict) {
    case PoseVerdict::reachable:
      return "";
    case PoseVerdict::too_short:
      return fmt::format("leg {} would be {:.3f} mm too short", leg, -result.stroke_margin_mm);
    case PoseVerdict::too_long:
      return fmt::format("leg {} would be {:.3f} mm too long", leg, -result.stroke_margin_mm);
    case PoseVerdict::base_joint:
      return fmt::format("base joint {} would turn {:.2f} deg", leg, result.base_angles_rad[k] * kDegPerRad);
    case PoseVerdict::platform_joint:
      return fmt::format("platform joint {} would turn {:.2f} deg", leg,
                         result.platform_angles_rad[k] * kDegPerRad);
    case PoseVerdict::legs_collide:
      return fmt::format("legs {} and {} would overlap by {:.3f} mm", leg, result.other_leg + 1,
                         -result.clearance_mm);
    case PoseVerdict::grips_collide:
      return fmt::format("the grips would be {:.3f} mm nearer than they may", -result.gap_mm);
    case PoseVerdict::beyond_singular:
      return "the pose lies beyond a singularity";
    case PoseVerdict::near_singular:
      return fmt::format(
          "near a singularity ({:.2f} mm or {:.3f} deg away): a leg error of 1 mm moves the platform {:.1f} "
          "mm",
          result.singularity->distance_mm, result.singularity->distance_deg,
          result.singularity->worst_gain_mm);
    case PoseVerdict::not_a_pose:
      return "the pose is not finite";
  }
  return "";
}

LegVector readings_at(const PlatformGeometry& geometry, const Rigid3& B_from_P) {
  return readings_from_lengths(geometry, actuated_lengths(geometry, B_from_P));
}

}  // namespace hexcal
