#include "tools/hexcal/error_tables.h"

#include <fmt/format.h>

#include <cmath>

#include "tools/io/pose_table.h"

namespace hexcal {

std::string decimal(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  std::string text = fmt::format("{:.{}f}", value, digits);
  const bool negative_zero = text[0] == '-' && text.find_first_of("123456789") == std::string::npos;
  return negative_zero ? text.substr(1) : text;
}

nlohmann::ordered_json json_mm_deg(const Vector6d& mm_and_rad) {
  auto list = nlohmann::ordered_json::array();
  for (const double value : mm_deg(mm_and_rad)) list.push_back(value);
  return list;
}

nlohmann::ordered_json error_json(const ErrorStatistics& errors) {
  return {{"poses", errors.poses},
          {"range_mm_deg", json_mm_deg(errors.range)},
          {"position_magnitude_mm", errors.position_magnitude_mm},
          {"orientation_magnitude_deg", errors.orientation_magnitude_rad * kDegPerRad},
          {"mean_mm_deg", json_mm_deg(errors.mean)},
          {"rms_mm_deg", json_mm_deg(errors.rms)},
          {"max_mm_deg", json_mm_deg(errors.max_abs)},
          {"position_rms_mm", errors.position_rms_mm},
          {"position_max_mm", errors.position_max_mm},
          {"orientation_rms_deg", errors.orientation_rms_rad * kDegPerRad},
          {"orientation_max_deg", errors.orientation_max_rad * kDegPerRad}};
}

std::vector<std::string> paper_columns(const std::string& title) {
  return {title,       "poses",     "x-tran_mm", "y-tran_mm",   "z-tran_mm",
          "x-rot_deg", "y-rot_deg", "z-rot_deg", "position_mm", "orientation_deg"};
}

std::vector<std::string> paper_row(const std::string& label, const ErrorStatistics& errors) {
  std::vector<std::string> cells{label, std::to_string(errors.poses)};
  for (Eigen::Index i = 0; i < 6; ++i) cells.push_back(decimal(mm_deg(errors.range)[i], i < 3 ? 3 : 4));
  cells.push_back(decimal(errors.position_magnitude_mm, 3));
  cells.push_back(decimal(errors.orientation_magnitude_rad * kDegPerRad, 4));
  return cells;
}

}  // namespace hexcal
