#pragma once

#include <filesystem>

namespace hexcal {

/// Holds results/.lock while it lives, so that two runs on one campaign do not mix. Throws InputError if
/// another process holds it; inside the process that does, a second one changes nothing. The lock vanishes
/// with the process, however it ends.
class CampaignLock {
 public:
  explicit CampaignLock(const std::filesystem::path& results);
  CampaignLock(const CampaignLock&) = delete;
  CampaignLock& operator=(const CampaignLock&) = delete;
  ~CampaignLock();

 private:
  int file_ = -1;
  std::filesystem::path folder_;
};

}  // namespace hexcal
