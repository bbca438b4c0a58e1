#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "pose_extract/extract_poses.h"

namespace hexcal {

/// What became of a marker that was seen: "used", or why it does not count. `sighting` is null where the
/// adjustment knows nothing of it.
[[nodiscard]] std::string sighting_words(const Sighting* sighting, const MarkerObservation& seen);

/// Sightings of an adjustment by photograph and marker id, as indices; of an id twice in a photograph the
/// first.
[[nodiscard]] std::map<std::pair<int, int>, std::size_t> sightings_by_id(const CampaignResult& result);

/// Every marker of every photograph: photo,id,status,x0_px,...,y3_px,dx0_px,...,dy3_px. The corners as
/// observed and their residuals, observed minus projected; empty where there is no geometry.
[[nodiscard]] std::string format_residuals(const std::string& head, const CampaignObservations& observations,
                                           const CampaignResult& result);

/// A marker in a photograph as such a file holds it.
struct MarkerResidual {
  int id = -1;
  std::string status;  ///< see sighting_words
  std::array<Eigen::Vector2d, 4> corners_px;
  bool placed = false;  ///< the residuals mean something
  std::array<Eigen::Vector2d, 4> residuals_px;
};

/// By photograph. Throws InputError as CsvTable does.
[[nodiscard]] std::map<std::string, std::vector<MarkerResidual>> read_residuals(
    const std::filesystem::path& path);

}  // namespace hexcal
