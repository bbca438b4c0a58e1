#include "tools/campaign/align_campaign.h"

#include <algorithm>

#include "tools/campaign/measure_campaign.h"
#include "tools/io/pose_table.h"

namespace hexcal {

std::optional<TargetAlignment> align_campaign(const Campaign& campaign) {
  const auto& ug = campaign.ug;
  if (!campaign.targets || !ug || ug->from != FrameRule::From::markers) return std::nullopt;
  MeasureRequest request;
  request.campaign = campaign.file;
  OpenCampaign open = open_campaign(request, campaign);
  const std::vector<PoseRecord> targets = read_pose_table(*campaign.targets);
  const Rigid3 before = ug->markers_from_frame;
  const double gd_mm = campaign.lg->gd_mm;
  const CampaignMeasurement measured = measure_campaign(request, std::move(open));
  const CampaignResult& result = measured.result;
  Pose home_target;
  std::vector<std::pair<Pose, Pose>> poses;
  for (std::size_t e = 0; e < result.poses.size(); ++e) {
    const MeasuredPose& pose = result.poses[e];
    const auto target = std::ranges::find(targets, pose.id, &PoseRecord::id);
    if (target == targets.end() || !target->pose) continue;
    if (static_cast<int>(e) == result.home_epoch) {
      home_target = *target->pose;
    } else if (pose.pose) {
      poses.emplace_back(*target->pose, *pose.pose);
    }
  }
  auto aligned = align_with_targets(poses, home_target, gd_mm);
  if (aligned) aligned->measured_from_targets = before * aligned->measured_from_targets;
  return aligned;
}

}  // namespace hexcal
