#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calibration/calibrate.h"
#include "tools/io/observation_table.h"

namespace hexcal {

/// What `hexcal compensate` prints: all methods side by side, what was chosen and why, the diagnosis, files.
[[nodiscard]] std::string compensation_text(const CalibrationReport& report, const ObservationTable& table,
                                            const std::vector<CorrectedCommand>& commands,
                                            const std::vector<std::filesystem::path>& written);

/// The same for machines.
[[nodiscard]] std::string compensation_json(const CalibrationReport& report, const ObservationTable& table,
                                            const std::vector<CorrectedCommand>& commands,
                                            const std::vector<std::filesystem::path>& written);

}  // namespace hexcal
