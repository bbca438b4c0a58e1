#pragma once

#include <atomic>
#include <filesystem>
#include <string>

#include "tools/campaign/measure_campaign.h"

namespace hexcal {

struct WatchRequest {
  MeasureRequest measure;
  int expect = 3;           ///< photographs of a complete pose
  double stop_after_s = 0;  ///< of quiet; 0: never
};

/// Told what a watch sees: a terminal, a live page.
class WatchObserver {
 public:
  virtual ~WatchObserver() = default;
  virtual void watching(const std::filesystem::path& images) { (void)images; }
  /// Why poses are not measured now; each time that changes.
  virtual void said(const std::string& words) { (void)words; }
  /// After results were written.
  virtual void measured(const CampaignMeasurement& measurement) { (void)measurement; }
  /// At the end, of each pose that lacks photographs.
  virtual void incomplete(const std::string& pose, int photographs) { (void)pose, (void)photographs; }
};

/// Measures the poses of a campaign as their photographs arrive and writes its results after each complete
/// pose, until `stop` is set or nothing arrives for long. A file counts when its size rests and it decodes;
/// what was measured before stays. Throws UnsuitedCamera; other faults of the files are said and tried again;
/// false if one stood in the way to the end.
[[nodiscard]] bool watch_campaign(const WatchRequest& request, const std::atomic<bool>& stop,
                                  WatchObserver& observer);

}  // namespace hexcal
