#include "tools/campaign/measure_campaign.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "pose_extract/pose_verdict.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace fs = std::filesystem;
namespace {

ExtractOptions extract_options(const MeasureRequest& request) {
  ExtractOptions options;
  options.map_poses = request.map_poses;
  if (request.interior_fixed) options.adjustment.interior = AdjustmentOptions::Interior::fixed;
  return options;
}

void refuse_foreign_camera(const OpenCampaign& open, const CampaignObservations& observations,
                           const CampaignResult& result) {
  const std::vector<MeasuredPhotograph>& photographs = result.photographs;
  if (photographs.empty() || !std::ranges::all_of(photographs, [](const MeasuredPhotograph& photograph) {
        return photograph.status == PhotoStatus::wrong_camera;
      })) {
    return;
  }
  throw UnsuitedCamera(fmt::format("{}: none of the {} photographs suits a camera file; {}: {}",
                                   open.campaign.file.string(), photographs.size(),
                                   observations.photographs.front().seen.name, photographs.front().words));
}

void judge_against_files(const MeasureRequest& request, const OpenCampaign& open, CampaignResult& result) {
  for (std::size_t c = 0; c < open.cameras.size(); ++c) {
    if (open.cameras[c].covariance.size() > 0) continue;
    result.findings.emplace_back(
        fmt::format("{} states no covariance: the sigmas of the poses leave the camera's own error out",
                    open.campaign.cameras[c].file.filename().string()),
        "calibrate the camera with hexcal camera");
  }
  if (request.home) {
    // Targets are relative to the machine's home, which this pose is not.
    result.findings.emplace_back(
        fmt::format(
            "the poses are relative to {}, not to the machine's home: they are not compared with the targets",
            *request.home),
        "photograph the home before the machine is compensated by these poses", Severity::bad);
    return;
  }
  if (!open.campaign.targets) return;
  std::map<std::string, Pose> commanded;
  try {
    for (const PoseRecord& record : read_pose_table(*open.campaign.targets)) {
      if (record.pose) commanded[record.id] = *record.pose;
    }
  } catch (const InputError& error) {
    // The measurement needs no targets.
    result.findings.emplace_back(fmt::format("not compared with the targets: {}", error.what()),
                                 "mend the file of targets");
    return;
  }
  judge_against_targets(commanded, result);
}

}  // namespace

CampaignResult measure_observations(const MeasureRequest& request, const OpenCampaign& open,
                                    const CampaignObservations& observations) {
  CampaignResult result = extract_poses(open.campaign, observations, extract_options(request));
  refuse_foreign_camera(open, observations, result);
  judge_against_files(request, open, result);
  return result;
}

CampaignMeasurement measure_campaign(const MeasureRequest& request, OpenCampaign open,
                                     MeasurementObserver& observer) {
  CampaignMeasurement measurement;
  measurement.open = std::move(open);
  measurement.observations = observe_campaign(request, measurement.open, observer);
  measurement.result = measure_observations(request, measurement.open, measurement.observations);
  return measurement;
}

CampaignMeasurement measure_campaign(const MeasureRequest& request, OpenCampaign open) {
  MeasurementObserver nobody;
  return measure_campaign(request, std::move(open), nobody);
}

}  // namespace hexcal
