#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/campaign/open_campaign.h"
#include "tools/hexcal/acceptance_limits.h"

// The commands of the main job as functions, each with its flags; `hexcal run` is these three in a row.

namespace hexcal {

struct MeasureFlags {
  MeasureRequest request;
  std::string interior = "refine";
  bool json = false;
  bool dry_run = false;
  bool no_cache = false;
  AcceptanceLimits limits;
};
[[nodiscard]] int run_measure(const MeasureFlags& flags);

struct CompensateFlags {
  std::filesystem::path campaign;
  std::filesystem::path hexapod, targets, poses, legs, covariance, apply, out;
  std::string method = "auto";
  std::string frames = "known";
  std::string approach;
  int round = 1;
  double position_sigma_mm = 0;
  double orientation_sigma_deg = 0;
  double tolerance_mm = 0;
  std::vector<std::string> fixed;
  bool with_suspect = false;
  bool json = false;
};
[[nodiscard]] int run_compensate(CompensateFlags flags);

struct ReportFlags {
  std::filesystem::path campaign, out, figures, before;
  std::string method = "auto";
  bool require_good = false;
  bool json = false;
};
[[nodiscard]] int run_report(const ReportFlags& flags);

}  // namespace hexcal
