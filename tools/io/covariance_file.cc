#include "tools/io/covariance_file.h"

#include <fmt/format.h>

#include <cmath>

#include "kinematics/geometry/covariance.h"
#include "tools/io/csv_table.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace {

constexpr const char* kSixColumns = "x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg";
constexpr const char* kSixSigmas =
    "sigma_x_mm,sigma_y_mm,sigma_z_mm,sigma_roll_deg,sigma_pitch_deg,sigma_yaw_deg";

void append_block(std::string& out, const CampaignResult& result, std::size_t a, std::size_t b) {
  out += csv_field(result.poses[a].id) + ',' + csv_field(result.poses[b].id);
  const Matrix6d covariance = result.pose_covariance(a, b);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) out += fmt::format(",{:.9g}", covariance(i, j));
  }
  out += '\n';
}

}  // namespace

std::string format_pose_covariances(const std::string& head, const CampaignResult& result) {
  std::string out = head + "pose_a,pose_b";
  for (int i = 1; i <= 6; ++i) {
    for (int j = 1; j <= 6; ++j) out += fmt::format(",c{}{}", i, j);
  }
  out += '\n';
  const bool correlated = result.poses.size() <= kMaxCorrelatedPoses;
  for (std::size_t a = 0; a < result.poses.size(); ++a) {
    if (!result.poses[a].pose) continue;
    for (std::size_t b = a; b < (correlated ? result.poses.size() : a + 1); ++b) {
      if (result.poses[b].pose) append_block(out, result, a, b);
    }
  }
  return out;
}

std::string format_photo_poses(const std::string& head, const CampaignObservations& observations,
                               const CampaignResult& result) {
  std::string out =
      head + fmt::format("photo,pose,status,{},{},markers,rejected,rms_px\n", kSixColumns, kSixSigmas);
  for (std::size_t p = 0; p < result.photographs.size(); ++p) {
    const MeasuredPhotograph& photograph = result.photographs[p];
    const std::string status =
        photograph.status == PhotoStatus::ok
            ? std::string("ok")
            : fmt::format("{}: {}", photo_status_name(photograph.status), photograph.words);
    out += fmt::format("{},{},{}", csv_field(observations.photographs[p].seen.name),
                       csv_field(observations.photographs[p].pose), csv_field(status));
    if (photograph.UG_from_camera) {
      const Pose pose = pose_from_home_from_lg(*photograph.UG_from_camera);
      const Matrix6d j = pose_parameters_jacobian(pose);
      const Matrix6d covariance = j * photograph.covariance * j.transpose();
      for (int i = 0; i < 6; ++i)
        out += fmt::format(",{:.{}f}", pose.vector()[i] / pose_column_unit(i), i < 3 ? 6 : 7);
      for (int i = 0; i < 6; ++i)
        out += fmt::format(",{:.4g}", std::sqrt(covariance(i, i)) / pose_column_unit(i));
    } else {
      out += ",,,,,,,,,,,,";
    }
    out += fmt::format(",{},{},{:.4f}\n", photograph.residuals.markers, photograph.residuals.rejected,
                       photograph.residuals.rms_px);
  }
  return out;
}

std::string format_marker_points(const std::string& head, const CampaignResult& result) {
  std::string out = head + "id,corner,frame,x_mm,y_mm,z_mm,sigma_x_mm,sigma_y_mm,sigma_z_mm\n";
  for (const MeasuredPoint& point : result.points) {
    const Eigen::Vector3d sigma = point.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    out += fmt::format("{},{},{},{:.6f},{:.6f},{:.6f},{:.4g},{:.4g},{:.4g}\n", point.point.id,
                       point.point.corner, point.body == Body::fixed ? "UG" : "LG", point.xyz_mm.x(),
                       point.xyz_mm.y(), point.xyz_mm.z(), sigma.x(), sigma.y(), sigma.z());
  }
  return out;
}

std::string format_epoch_table(const std::string& head, const CampaignResult& result) {
  std::string out = head + "pose,id,corner,x_mm,y_mm,z_mm\n";
  for (const MeasuredPose& pose : result.poses) {
    if (!pose.pose) continue;
    const Rigid3 UG_from_LG = ug_from_lg(*pose.pose, result.gd_mm);
    for (const MeasuredPoint& point : result.points) {
      if (point.body != Body::moving) continue;
      const Eigen::Vector3d at = UG_from_LG * point.xyz_mm;
      out += fmt::format("{},{},{},{:.6f},{:.6f},{:.6f}\n", csv_field(pose.id), point.point.id,
                         point.point.corner, at.x(), at.y(), at.z());
    }
  }
  return out;
}

}  // namespace hexcal
