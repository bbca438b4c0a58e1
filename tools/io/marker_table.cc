#include "tools/io/marker_table.h"

#include <fmt/format.h>

#include "tools/io/csv_table.h"

namespace hexcal {

std::string format_marker_table(const std::string& head, const CampaignResult& result) {
  std::string out = head + "id,corner,frame,x_mm,y_mm,z_mm,sigma_x_mm,sigma_y_mm,sigma_z_mm\n";
  for (const MeasuredPoint& point : result.points) {
    const Eigen::Vector3d sigma = point.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    out += fmt::format("{},{},{},{:.6f},{:.6f},{:.6f},{:.4g},{:.4g},{:.4g}\n", point.point.id,
                       point.point.corner, point.body == kReferenceBody ? "UG" : "LG", point.xyz_mm.x(),
                       point.xyz_mm.y(), point.xyz_mm.z(), sigma.x(), sigma.y(), sigma.z());
  }
  return out;
}

std::vector<MarkerCornerRecord> read_marker_table(const std::filesystem::path& path) {
  const CsvTable table = CsvTable::read(path);
  table.require_columns({"id", "corner", "frame", "x_mm", "y_mm", "z_mm"});
  std::vector<MarkerCornerRecord> records;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    records.push_back({table.integer(row, "id"),
                       table.integer(row, "corner"),
                       table.text(row, "frame"),
                       {table.number(row, "x_mm"), table.number(row, "y_mm"), table.number(row, "z_mm")}});
  }
  return records;
}

std::string format_epoch_table(const std::string& head, const CampaignResult& result) {
  std::string out = head + "pose,id,corner,x_mm,y_mm,z_mm\n";
  for (const MeasuredPose& pose : result.poses) {
    if (!pose.pose) continue;
    const Rigid3 UG_from_LG = ug_from_lg(*pose.pose, result.gd_mm);
    for (const MeasuredPoint& point : result.points) {
      if (point.body != kMovingBody) continue;
      const Eigen::Vector3d at = UG_from_LG * point.xyz_mm;
      out += fmt::format("{},{},{},{:.6f},{:.6f},{:.6f}\n", csv_field(pose.id), point.point.id,
                         point.point.corner, at.x(), at.y(), at.z());
    }
  }
  return out;
}

}  // namespace hexcal
