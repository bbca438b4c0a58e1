#pragma once

#include "pose_extract/extract_poses.h"

namespace hexcal {

/// Two sources of the scale that differ by more disagree.
inline constexpr double kScaleDisagreementSigmas = 3;

/// Says of a measured pose, or of a photograph that was used, what contradicts it. One that failed stays as
/// it is, with the words more.
void suspect(MeasuredPose& pose, const std::string& words);
void suspect(MeasuredPhotograph& photograph, const std::string& words);

/// Status and words of each photograph after the adjustment.
void judge_photographs(const CampaignObservations& observations, CampaignResult& result);

/// Status and words of each pose; takes away poses that must not be trusted.
void judge_poses(const Campaign& campaign, const CampaignObservations& observations,
                 const ExtractOptions& options, CampaignResult& result);

/// Warnings about the campaign: moved markers, bars that disagree, a camera that is not as calibrated.
void judge_campaign(const Campaign& campaign, CampaignResult& result);

/// Names, as suspect, the poses that lie where another was to be and it where they were, as after two
/// folders' names were swapped. `targets` are the commanded poses in the order of result.poses; none where
/// unknown.
void judge_swapped_folders(const std::vector<std::optional<Pose>>& targets, CampaignResult& result);

}  // namespace hexcal
