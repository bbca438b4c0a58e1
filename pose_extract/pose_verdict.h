#pragma once

#include "pose_extract/extract_poses.h"

namespace hexcal {

/// Status and words of each photograph after the adjustment.
void judge_photographs(const CampaignObservations& observations, CampaignResult& result);

/// Status and words of each pose; takes away poses that must not be trusted.
void judge_poses(const Campaign& campaign, const CampaignObservations& observations,
                 const ExtractOptions& options, CampaignResult& result);

/// Warnings about the campaign: moved markers, bars that disagree, a camera that is not as calibrated.
void judge_campaign(const Campaign& campaign, CampaignResult& result);

}  // namespace hexcal
