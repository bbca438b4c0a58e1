#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "camera_calib/sheet_adjustment.h"

namespace hexcal {

/// Homography image_from_sheet of corresponding points, at least four (normalised DLT; Hartley & Zisserman
/// 2004, alg. 4.2); none if they are degenerate.
[[nodiscard]] std::optional<Eigen::Matrix3d> homography_from_points(
    const std::vector<Eigen::Vector2d>& sheet_mm, const std::vector<Eigen::Vector2d>& image_px);

/// Focal length in px that makes the homographies' columns orthogonal and of one length, with square pixels
/// and the principal point given (Zhang 2000, his eqs. 3 and 4, for f alone). None if the views are too
/// frontal.
[[nodiscard]] std::optional<double> focal_length_from_homographies(
    const std::vector<Eigen::Matrix3d>& image_from_sheet, const Eigen::Vector2d& principal_point_px);

/// Pose of a sheet from its homography and a camera without distortion.
[[nodiscard]] Rigid3 pose_from_homography(const Eigen::Matrix3d& image_from_sheet, const CameraModel& camera);

/// Camera (Brown's model without distortion) and poses to begin with; views with fewer than four points or
/// without a homography are left out. `f_hint_px`, from EXIF, is taken where the views hardly determine f. No
/// view: empty.
[[nodiscard]] CalibrationState initial_state(const std::vector<Sheet>& sheets,
                                             const std::vector<SheetPhotograph>& photographs, int width_px,
                                             int height_px, std::optional<double> f_hint_px);

/// Pose of every view from its homography, the lens of the state's camera taken out of the points first.
void set_poses(const std::vector<Sheet>& sheets, CalibrationState& state);

}  // namespace hexcal
