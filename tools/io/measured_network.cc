#include "tools/io/measured_network.h"

#include <fmt/format.h>

#include <set>
#include <utility>

#include "kinematics/geometry/input_error.h"
#include "tools/io/marker_table.h"
#include "tools/io/photo_table.h"

namespace hexcal {

MeasuredNetwork read_measured_network(const std::filesystem::path& results) {
  MeasuredNetwork network;
  for (const PhotoRecord& photo : read_photo_table(results / "photos.csv")) {
    if (photo.UG_from_camera) network.stations[photo.pose].push_back(*photo.UG_from_camera);
  }
  if (network.stations.empty())
    throw InputError(fmt::format("{}: no photograph has a place", (results / "photos.csv").string()));

  std::map<int, std::set<int>> corners;
  for (const MarkerCornerRecord& record : read_marker_table(results / "markers.csv")) {
    if (record.frame != "LG" || record.corner < 0 || record.corner > 3) continue;
    corners[record.id].insert(record.corner);
    network.moving_markers[record.id][static_cast<std::size_t>(record.corner)] = record.xyz_mm;
  }
  std::erase_if(network.moving_markers, [&](const auto& marker) { return corners[marker.first].size() < 4; });
  if (network.moving_markers.empty())
    throw InputError(
        fmt::format("{}: no marker of LG with four corners", (results / "markers.csv").string()));
  return network;
}

}  // namespace hexcal
