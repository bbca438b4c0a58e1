#pragma once

#include <filesystem>
#include <stdexcept>
#include <vector>

#include "kinematics/geometry/input_error.h"
#include "tools/campaign/observe_campaign.h"
#include "tools/campaign/open_campaign.h"

// The one sequence by which a campaign is measured, whoever asks for it: measure, watch, run, Python.

namespace hexcal {

/// No photograph suits a camera of the campaign: a mistake in the files, not a bad pose. Nothing is written
/// then.
class UnsuitedCamera : public InputError {
 public:
  using InputError::InputError;
};

struct CampaignMeasurement {
  OpenCampaign open;
  CampaignObservations observations;
  CampaignResult result;
};

/// Observes the photographs (or reads the observations) of an opened campaign and measures it. Writes nothing
/// but results/cache, and that only where the request says so. Throws UnsuitedCamera, and InputError for what
/// is wrong in the user's files.
[[nodiscard]] CampaignMeasurement measure_campaign(const MeasureRequest& request, OpenCampaign open,
                                                   MeasurementObserver& observer);
[[nodiscard]] CampaignMeasurement measure_campaign(const MeasureRequest& request, OpenCampaign open);

/// The second half, for who observes by himself: poses from observations, judged also against the campaign's
/// other files (targets.csv, what the cameras state). Throws likewise.
[[nodiscard]] CampaignResult measure_observations(const MeasureRequest& request, const OpenCampaign& open,
                                                  const CampaignObservations& observations);

/// Writes poses.csv and everything beside it; returns the files written.
std::vector<std::filesystem::path> write_results(const MeasureRequest& request,
                                                 const CampaignMeasurement& measurement);

}  // namespace hexcal
