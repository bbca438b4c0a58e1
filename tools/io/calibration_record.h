#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "calibration/calibrate.h"
#include "tools/io/observation_table.h"

namespace hexcal {

/// What a calibration was made from and how: version, settings and the content of every file. Two records of
/// one key hold the same.
[[nodiscard]] std::string calibration_key(std::string_view version, const std::filesystem::path& hexapod,
                                          const ObservationFiles& files, std::string_view settings);

/// The calibration as far as a report shows it (JSON), so that identifying the machine, which takes minutes
/// for many poses, need not be done again for the page. Left out are the fitted model, which is in
/// model.yaml, and the errors that the tables of poses give anew.
[[nodiscard]] std::string calibration_record_text(const std::string& key, const CalibrationReport& report);

/// Reads such a record; nothing where the file is missing, of another key, or differs in a byte from what was
/// written (kept_text.h).
[[nodiscard]] std::optional<CalibrationReport> read_calibration_record(const std::filesystem::path& path,
                                                                       const std::string& key);

}  // namespace hexcal
