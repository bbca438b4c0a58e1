#pragma once

#include <string>
#include <vector>

#include "pose_extract/extract_poses.h"
#include "tools/io/pose_table.h"

namespace hexcal {

/// What the status column says of a pose: `ok`, or the name of its status with the words.
[[nodiscard]] std::string status_text(const MeasuredPose& pose);

/// The rows of poses.csv.
[[nodiscard]] std::vector<PoseRecord> pose_records(const CampaignResult& result);

/// Standard deviations of (x, y, z, roll, pitch, yaw), mm and rad.
[[nodiscard]] Vector6d pose_sigmas(const MeasuredPose& pose);

}  // namespace hexcal
