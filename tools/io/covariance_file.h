#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pose_extract/extract_poses.h"

namespace hexcal {

/// Up to this many poses the covariances between poses are written too.
inline constexpr int kMaxCorrelatedPoses = 300;

/// Covariance table of measured poses: pose_a,pose_b,c11,...,c66, the 6x6 blocks row by row in (x, y, z,
/// roll, pitch, yaw) with mm and rad. Blocks with pose_a = pose_b always; the others, once each in the order
/// of the poses, up to kMaxCorrelatedPoses poses. A pose without numbers has no rows.
[[nodiscard]] std::string format_pose_covariances(const std::string& head, const CampaignResult& result);

/// The block of two poses: covariance of (x, y, z, roll, pitch, yaw) of `a` with that of `b`, mm and rad.
struct PoseCovariance {
  std::string a, b;
  Matrix6d covariance;
};
/// Throws InputError as CsvTable does.
[[nodiscard]] std::vector<PoseCovariance> read_pose_covariances(const std::filesystem::path& path);

}  // namespace hexcal
