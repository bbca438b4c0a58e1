#include "tools/io/measured_poses.h"

#include <fmt/format.h>

namespace hexcal {

Vector6d pose_sigmas(const MeasuredPose& pose) {
  return pose.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
}

std::string status_text(const MeasuredPose& pose) {
  if (pose.status == PoseStatus::ok) return "ok";
  return pose.words.empty() ? std::string(pose_status_name(pose.status))
                            : fmt::format("{}: {}", pose_status_name(pose.status), pose.words);
}

std::vector<PoseRecord> pose_records(const CampaignResult& result) {
  std::vector<PoseRecord> records;
  for (const MeasuredPose& pose : result.poses) {
    PoseRecord record;
    record.id = pose.id;
    record.status = status_text(pose);
    record.pose = pose.pose;
    if (pose.pose) record.sigma = pose_sigmas(pose);
    record.images = pose.images;
    record.markers = pose.markers;
    if (pose.pose) record.rms_px = pose.rms_px;
    if (pose.status == PoseStatus::ok) record.remarks = pose.words;
    records.push_back(std::move(record));
  }
  return records;
}

}  // namespace hexcal
