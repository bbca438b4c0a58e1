#pragma once

#include <cstddef>
#include <filesystem>

#include "tools/campaign/open_campaign.h"

namespace hexcal {

/// Told what a measurement does while it runs: a progress bar, a live page. Called from any thread, also from
/// several at a time.
class MeasurementObserver {
 public:
  virtual ~MeasurementObserver() = default;
  virtual void begin(std::size_t photographs) { (void)photographs; }
  virtual void observed(const CampaignPhotograph& photograph) { (void)photograph; }
};

/// One photograph of the listing: opened and hashed once, its camera chosen, its markers measured or taken
/// from the cache (results/cache, by content and camera).
[[nodiscard]] CampaignPhotograph observe_image(const OpenCampaign& open, const CampaignImage& image,
                                               bool use_cache);

/// All photographs of the listing, one per thread at a time; or, where the request names a file of
/// observations
/// (`hexcal detect`), those in it: name and EXIF say of which pose and camera they are, as they do for
/// photographs. The listing of `open` is completed from such a file. Throws InputError for a file that is not
/// of this campaign.
[[nodiscard]] CampaignObservations observe_campaign(const MeasureRequest& request, OpenCampaign& open,
                                                    MeasurementObserver& observer);

/// The observations of a measurement as a file that gives the same poses and cameras back.
[[nodiscard]] std::string observations_of_campaign(const std::string& head, const OpenCampaign& open,
                                                   const CampaignObservations& observations);

}  // namespace hexcal
