#pragma once

#include "tools/report/campaign_report.h"

namespace hexcal {

// The sections of a campaign's page, one per source file or two that belong together. Each draws one part of
// a CampaignReport.

[[nodiscard]] Html poses_section(const CampaignReport& report);
[[nodiscard]] Html methods_section(const CampaignReport& report);
[[nodiscard]] Html machine_section(const CompensationPart& part);
[[nodiscard]] Html network_section(const NetworkPart& network);
[[nodiscard]] Html photographs_section(const NetworkPart& network);
[[nodiscard]] Html camera_section(const CameraPart& part);

[[nodiscard]] bool has_residuals(const NetworkPart& network);
/// Residual vectors of all photographs over the frame.
[[nodiscard]] Chart residual_chart(const NetworkPart& network);
/// Corrections of the machine leg by leg, with one-sigma bars.
[[nodiscard]] Chart correction_chart(const Identifiability& identifiability);
/// Radial distortion of a camera from the centre to the corner of the frame.
[[nodiscard]] Chart distortion_chart(const CalibratedCamera& camera);

}  // namespace hexcal
