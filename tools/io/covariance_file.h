#pragma once

#include <string>

#include "pose_extract/extract_poses.h"

namespace hexcal {

/// Up to this many poses the covariances between poses are written too.
inline constexpr int kMaxCorrelatedPoses = 300;

/// Covariance table of measured poses: pose_a,pose_b,c11,...,c66, the 6x6 blocks row by row in (x, y, z,
/// roll, pitch, yaw) with mm and rad. Blocks with pose_a = pose_b always; the others, once each in the order
/// of the poses, up to kMaxCorrelatedPoses poses. A pose without numbers has no rows.
[[nodiscard]] std::string format_pose_covariances(const std::string& head, const CampaignResult& result);

/// Camera stations: photo,pose,status,x_mm,...,yaw_deg,sigma_x_mm,...,sigma_yaw_deg,markers,rejected,rms_px
/// of UG_from_camera.
[[nodiscard]] std::string format_photo_poses(const std::string& head,
                                             const CampaignObservations& observations,
                                             const CampaignResult& result);

/// Marker corners: id,corner,frame,x_mm,y_mm,z_mm,sigma_x_mm,...; frame UG or LG.
[[nodiscard]] std::string format_marker_points(const std::string& head, const CampaignResult& result);

/// Where each corner of the moving grip was in UG at each epoch: pose,id,corner,x_mm,y_mm,z_mm.
[[nodiscard]] std::string format_epoch_table(const std::string& head, const CampaignResult& result);

}  // namespace hexcal
