#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "calibration/statistics.h"

namespace hexcal {

/// With that many digits after the point; what rounds to zero has no sign, what is not a number is "-".
[[nodiscard]] std::string decimal(double value, int digits);

/// x, y, z in mm; roll, pitch, yaw in degrees, of mm and rad.
[[nodiscard]] nlohmann::ordered_json json_mm_deg(const Vector6d& mm_rad);

/// As the definition `stats` of the schemas says.
[[nodiscard]] nlohmann::ordered_json error_json(const ErrorStatistics& errors);

/// One row of the paper's Tables 2 to 4: the ranges of the six errors and their magnitudes (eq. 7).
[[nodiscard]] std::vector<std::string> paper_columns(const std::string& title);
[[nodiscard]] std::vector<std::string> paper_row(const std::string& label, const ErrorStatistics& errors);

}  // namespace hexcal
