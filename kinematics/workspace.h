#pragma once

#include <vector>

#include "kinematics/sampling.h"

namespace hexcal {

/// A plane through the workspace: two pose parameters vary, the others stay as in `centre`.
struct SliceOptions {
  Pose centre;
  int axis_u = 0;  ///< 0..5: x, y, z, roll, pitch, yaw
  int axis_v = 1;
  double u_low = 0, u_high = 0;  ///< mm or rad
  double v_low = 0, v_high = 0;
  int u_count = 81;
  int v_count = 81;
  int threads = 1;

  /// Throws InputError naming the field.
  void validate() const;
};

struct SliceCell {
  Pose pose;
  PoseVerdict verdict = PoseVerdict::reachable;
  double stroke_margin_mm = 0;
  double joint_margin_rad = 0;
  double clearance_mm = 0;
  double singular_mm = 0;
  double sigma_min = 0;
};

[[nodiscard]] SliceCell judge_pose(const PlatformGeometry& geometry, const RestState& rest, const Pose& pose);

/// Cells row by row: v slow, u fast.
[[nodiscard]] std::vector<SliceCell> workspace_slice(const PlatformGeometry& geometry,
                                                     const SliceOptions& options);

struct BoxOptions {
  Eigen::Vector3d rpy_rad = Eigen::Vector3d::Zero();  ///< the orientation that is kept
  PoseMargins margins;
  int grid = 3;  ///< points per edge at which clearance, joint axes and singularities are looked at

  /// Throws InputError naming the field.
  void validate() const;
};

struct ConstantOrientationBox {
  bool found = false;  ///< false when home's position at this orientation is not valid
  Eigen::Vector3d lower_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d upper_mm = Eigen::Vector3d::Zero();

  [[nodiscard]] double volume_mm3() const { return (upper_mm - lower_mm).prod(); }
};

/// The largest box of positions around home's at one orientation, every position of which is valid. Strokes
/// and joint cones are judged exactly (a leg's length has its extremes at a corner and at the box's nearest
/// point; a cone below 90 deg is convex), the other limits on a grid. The search grows the six faces in turn,
/// from several shapes, so that the box is the largest to a part in a thousand for convex workspaces.
[[nodiscard]] ConstantOrientationBox largest_box(const PlatformGeometry& geometry,
                                                 const BoxOptions& options = {});

}  // namespace hexcal
