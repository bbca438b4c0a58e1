#include "tools/io/residual_file.h"

#include <fmt/format.h>

#include "tools/io/csv_table.h"

namespace hexcal {
namespace {

std::string column(const char* what, std::size_t corner) { return fmt::format("{}{}_px", what, corner); }

bool has_residual(const Sighting* sighting) {
  return sighting != nullptr &&
         (sighting->status == SightingStatus::used || sighting->status == SightingStatus::outlier);
}

}  // namespace

std::string sighting_words(const Sighting* sighting, const MarkerObservation& seen) {
  if (sighting == nullptr) return marker_status_name(seen.status);
  switch (sighting->status) {
    case SightingStatus::used:
      return "used";
    case SightingStatus::not_measured:
      return marker_status_name(seen.status);
    case SightingStatus::unknown_id:
      return "not of this campaign";
    case SightingStatus::repeated_id:
      return "id twice";
    case SightingStatus::seen_once:
      return "seen once";
    case SightingStatus::unoriented:
      return "not connected";
    case SightingStatus::outlier:
      return "contradicts the rest";
  }
  return "";
}

std::map<std::pair<int, int>, std::size_t> sightings_by_id(const CampaignResult& result) {
  std::map<std::pair<int, int>, std::size_t> out;
  const std::vector<Sighting>& sightings = result.adjusted.sightings;
  std::map<int, std::size_t> taken;  // by photograph: a sighting per marker, in their order
  for (std::size_t s = 0; s < sightings.size(); ++s) {
    const int photo = sightings[s].photo;
    const auto& seen = result.network.photos[static_cast<std::size_t>(photo)].observations;
    out.emplace(std::pair(photo, seen.at(taken[photo]++).id), s);
  }
  return out;
}

std::string format_residuals(const std::string& head, const CampaignObservations& observations,
                             const CampaignResult& result) {
  std::string out = head + "photo,id,status";
  for (const auto& [x, y] : {std::pair("x", "y"), std::pair("dx", "dy")}) {
    for (std::size_t c = 0; c < 4; ++c) out += ',' + column(x, c) + ',' + column(y, c);
  }
  out += '\n';
  const auto places = sightings_by_id(result);
  for (std::size_t p = 0; p < observations.photographs.size(); ++p) {
    const PhotographObservations& photograph = observations.photographs[p].seen;
    for (const MarkerObservation& seen : photograph.markers) {
      const auto place = places.find({static_cast<int>(p), seen.id});
      const Sighting* sighting = place == places.end() ? nullptr : &result.adjusted.sightings[place->second];
      out += fmt::format("{},{},{}", csv_field(photograph.name), seen.id,
                         csv_field(sighting_words(sighting, seen)));
      for (const Eigen::Vector2d& corner : seen.corners_px)
        out += fmt::format(",{:.3f},{:.3f}", corner.x(), corner.y());
      for (Eigen::Index i = 0; i < 8; ++i) {
        out += has_residual(sighting)
                   ? fmt::format(",{:.5f}", result.adjusted.residuals_px.at(place->second)[i])
                   : ",";
      }
      out += '\n';
    }
  }
  return out;
}

std::map<std::string, std::vector<MarkerResidual>> read_residuals(const std::filesystem::path& path) {
  const CsvTable table = CsvTable::read(path);
  std::map<std::string, std::vector<MarkerResidual>> out;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    MarkerResidual marker;
    marker.id = table.integer(row, "id");
    marker.status = table.text(row, "status");
    marker.placed = table.optional_number(row, column("dx", 0)).has_value();
    for (std::size_t c = 0; c < 4; ++c) {
      marker.corners_px[c] = {table.number(row, column("x", c)), table.number(row, column("y", c))};
      marker.residuals_px[c] = marker.placed ? Eigen::Vector2d(table.number(row, column("dx", c)),
                                                               table.number(row, column("dy", c)))
                                             : Eigen::Vector2d::Zero();
    }
    out[table.text(row, "photo")].push_back(marker);
  }
  return out;
}

}  // namespace hexcal
