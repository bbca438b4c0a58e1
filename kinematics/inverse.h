#pragma once

#include <array>
#include <optional>
#include <string>

#include "kinematics/dh_chain.h"
#include "kinematics/platform.h"
#include "kinematics/singularity.h"

namespace hexcal {

enum class PoseVerdict {
  reachable,
  too_short,  ///< a leg would be shorter than its shortest length
  too_long,
  base_joint,  ///< a base joint would turn beyond its cone or an axis
  platform_joint,
  legs_collide,     ///< two legs are nearer than twice their radius
  grips_collide,    ///< the grips are nearer than their least gap
  beyond_singular,  ///< on the other side of a singularity than home
  near_singular,    ///< can be held only badly
  not_a_pose,       ///< not finite
};

[[nodiscard]] const char* name(PoseVerdict verdict);

/// What does not depend on the pose: the joints' rest directions and axes.
struct RestState {
  explicit RestState(const PlatformGeometry& geometry);

  Rigid3 home;                                   ///< B_from_P
  std::array<Eigen::Vector3d, 6> base_rest;      ///< unit leg directions at home, in B
  std::array<Eigen::Vector3d, 6> platform_rest;  ///< and in P
  std::array<LegChain, 6> chains;                ///< their A frames carry the base joints' axes
  HomeSingularity home_singularity;              ///< by the default characteristic length
};

struct InverseOptions {
  bool singularity = true;  ///< off: no singular value decomposition; only the determinant's sign is judged
  bool measure_all = true;  ///< off: poses that are clearly not near-singular get no measures, only a verdict
  SingularityOptions near{};
};

/// All that can be said of a pose. Margins are positive inside the limits.
struct InverseResult {
  PoseVerdict verdict = PoseVerdict::reachable;   ///< the first limit broken, in the order of the enum
  int leg = -1;                                   ///< 0..5, the leg that breaks it most
  int other_leg = -1;                             ///< the second leg of a collision
  LegVector lengths_mm = LegVector::Zero();       ///< joint centre to joint centre
  LegVector readings = LegVector::Zero();         ///< in actuator units, screws included
  double stroke_margin_mm = 0;                    ///< smallest over the legs, of the actuator's length
  LegVector base_angles_rad = LegVector::Zero();  ///< from the rest direction
  LegVector platform_angles_rad = LegVector::Zero();
  Eigen::Matrix<double, 6, 2> base_axis_angles_rad =
      Eigen::Matrix<double, 6, 2>::Zero();  ///< turns about the U joint's first and second axis
  double joint_margin_rad = 0;              ///< smallest over all joints; infinite without limits
  double clearance_mm = 0;  ///< between the surfaces of the nearest legs; infinite without a leg radius
  double gap_mm = 0;        ///< between the grips beyond their least gap; infinite where none is known
  std::optional<SingularityMeasures> singularity;

  [[nodiscard]] bool reachable() const { return verdict == PoseVerdict::reachable; }
};

[[nodiscard]] InverseResult inverse_kinematics(const PlatformGeometry& geometry, const RestState& rest,
                                               const Rigid3& B_from_P, const InverseOptions& options = {});
[[nodiscard]] InverseResult inverse_kinematics(const PlatformGeometry& geometry, const Rigid3& B_from_P,
                                               const InverseOptions& options = {});

/// One line for a person, with numbers: "leg 3 would be 12.4 mm too long". Empty when reachable.
[[nodiscard]] std::string reason(const InverseResult& result);

/// Actuator readings at a pose, screws included; no verdict.
[[nodiscard]] LegVector readings_at(const PlatformGeometry& geometry, const Rigid3& B_from_P);

}  // namespace hexcal
