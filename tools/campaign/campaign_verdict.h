#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/calibrate.h"
#include "tools/io/photo_table.h"
#include "tools/io/pose_table.h"
#include "tools/io/quality_file.h"

// What measuring and compensating together say of a campaign. What makes a photograph or a pose good is
// decided when it is measured (pose_extract/pose_verdict.h); here it is only counted.

namespace hexcal {

/// What the results of a campaign hold.
struct CampaignEvidence {
  std::vector<PoseRecord> poses;         ///< poses.csv
  std::vector<PhotoRecord> photographs;  ///< photos.csv; empty if there is none
  std::optional<Quality> quality;        ///< quality.json
  const CalibrationReport* calibration = nullptr;
  std::string no_compensation;      ///< what to do where there is no calibration
  std::vector<LegRecord> commands;  ///< actuators.csv
};

struct CampaignVerdict {
  Severity severity = Severity::good;
  std::string headline;
  std::vector<Finding> findings;        ///< each cause once, worst first
  std::vector<std::string> next_steps;  ///< the findings' instructions, then what comes after them
  /// The corrected commands are worth sending: the chosen method beats nothing on the same poses and no
  /// finding is bad.
  bool send = false;
};

[[nodiscard]] CampaignVerdict judge_results(const CampaignEvidence& evidence);

}  // namespace hexcal
