#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "pose_extract/extract_poses.h"
#include "pose_extract/image_folders.h"

namespace hexcal {

/// quality.json: everything about a measurement that is no table, and poses and photographs once more; the
/// output of `hexcal measure --json`. Its schema is tools/hexcal/schema/measure.json. `measurement` is its
/// name (measurement_id.h).
[[nodiscard]] std::string quality_text(const CampaignObservations& observations, const CampaignResult& result,
                                       const ImageListing& listing, const std::string& measurement);

/// What a report takes from it.
struct Quality {
  Severity verdict = Severity::good;
  double sigma0 = 0;
  double rms_px = 0;
  double redundancy = 0;
  std::vector<Finding> findings;  ///< about the campaign as a whole
  DatumFrame UG, LG;              ///< ok, reason, scale, notes and residuals only
  std::vector<MeasuredLength> bars, checks;
  std::map<std::string, std::string> photograph_words;  ///< by photograph
};
/// Throws InputError where the file cannot be read or is damaged.
[[nodiscard]] Quality read_quality(const std::filesystem::path& path);

}  // namespace hexcal
