#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "kinematics/inverse.h"

namespace hexcal {

/// A box of pose parameters (x, y, z mm, roll, pitch, yaw rad; LG relative to home).
struct PoseBox {
  Vector6d lower = Vector6d::Zero();
  Vector6d upper = Vector6d::Zero();
};

/// What a pose must keep to count as valid: the verdict `reachable` and these distances from the limits.
struct PoseMargins {
  double stroke_mm = 0;
  double joint_rad = 0;
  double clearance_mm = 0;
  double singular_mm = 0;  ///< first-order distance to a singular pose
  double singular_rad = 0;

  /// Throws InputError naming the field.
  void validate() const;
};

[[nodiscard]] bool is_valid(const PlatformGeometry& geometry, const RestState& rest, const Pose& pose,
                            const PoseMargins& margins = {});

/// How far a straight way from `from` along `direction` (pose parameters per unit) stays valid, in units, at
/// most `limit`; 0 when `from` itself is not valid. Scanned in `steps` steps, then halved.
[[nodiscard]] double reach_along(const PlatformGeometry& geometry, const RestState& rest, const Pose& from,
                                 const Vector6d& direction, double limit, const PoseMargins& margins = {},
                                 int steps = 64);

/// A box that holds nearly all valid poses: the reach along the axes from the pose with the largest stroke
/// margin, grown over pilot samples (fixed seed) and widened by a tenth.
[[nodiscard]] PoseBox workspace_box(const PlatformGeometry& geometry, const PoseMargins& margins = {});

/// What the machine does to a specimen between the grips. LG hangs below UG, so tension moves it down.
enum class LoadPath { tension, compression, torsion, bending_x, bending_y };

[[nodiscard]] const char* name(LoadPath path);

/// Unit motion of a load path: 1 mm along z or 1 rad about z, x, y.
[[nodiscard]] Vector6d load_direction(LoadPath path);

enum class SampleKind {
  uniform,  ///< independent, uniform over the valid part of the box
  halton,   ///< Halton's sequence (bases 2, 3, 5, 7, 11, 13), shifted by the seed (Cranley & Patterson 1976)
  load_paths,  ///< along each load path and each pair of them, from home to the limit of validity
};

struct SampleOptions {
  std::size_t count = 34;
  SampleKind kind = SampleKind::halton;
  std::uint64_t seed = 1;
  PoseMargins margins;
  std::optional<PoseBox> box;        ///< default: workspace_box
  std::vector<LoadPath> load_paths;  ///< default: all five
  bool combine = true;               ///< load paths also in pairs
  double load_fraction = 1;          ///< of the way to the limit that load paths use
  std::size_t largest_tries = 0;     ///< candidates looked at; 0: 10000 + 2000 count

  /// Throws InputError naming the field.
  void validate() const;
};

struct SampleResult {
  std::vector<Pose> poses;  ///< fewer than asked for when the tries ran out
  std::size_t tries = 0;
};

/// Valid poses, the same for the same seed.
[[nodiscard]] SampleResult sample_poses(const PlatformGeometry& geometry, const SampleOptions& options = {});

}  // namespace hexcal
