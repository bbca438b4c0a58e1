#include "tools/io/measured_network.h"

#include <fmt/format.h>

#include <set>
#include <utility>

#include "kinematics/geometry/input_error.h"
#include "tools/io/csv_table.h"
#include "tools/io/pose_table.h"

namespace hexcal {
MeasuredNetwork read_measured_network(const std::filesystem::path& results) {
  MeasuredNetwork network;
  const CsvTable photos = CsvTable::read(results / "photos.csv");
  std::vector<std::string> columns(kPoseColumns.begin(), kPoseColumns.end());
  columns.emplace_back("pose");
  photos.require_columns(columns);
  for (std::size_t row = 0; row < photos.rows(); ++row) {
    if (!photos.optional_number(row, "x_mm")) continue;
    Vector6d v;
    for (std::size_t i = 0; i < 6; ++i)
      v[static_cast<Eigen::Index>(i)] = photos.number(row, kPoseColumns[i]) * pose_column_unit(i);
    network.stations[photos.text(row, "pose")].push_back(home_from_lg(Pose::from_vector(v)));
  }
  if (network.stations.empty())
    throw InputError(fmt::format("{}: no photograph has a place", photos.path().string()));

  const CsvTable points = CsvTable::read(results / "markers.csv");
  points.require_columns({"id", "corner", "frame", "x_mm", "y_mm", "z_mm"});
  std::map<int, std::set<int>> corners;
  for (std::size_t row = 0; row < points.rows(); ++row) {
    const int corner = points.integer(row, "corner");
    if (points.text(row, "frame") != "LG" || corner < 0 || corner > 3) continue;
    const int id = points.integer(row, "id");
    corners[id].insert(corner);
    network.moving_markers[id][static_cast<std::size_t>(corner)] = {
        points.number(row, "x_mm"), points.number(row, "y_mm"), points.number(row, "z_mm")};
  }
  std::erase_if(network.moving_markers, [&](const auto& marker) { return corners[marker.first].size() < 4; });
  if (network.moving_markers.empty())
    throw InputError(fmt::format("{}: no marker of LG with four corners", points.path().string()));
  return network;
}

}  // namespace hexcal
