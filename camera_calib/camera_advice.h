#pragma once

#include <vector>

#include "camera_calib/camera_report.h"

namespace hexcal {

/// The sentences of the verdict, the gravest first, from everything else in the report.
[[nodiscard]] std::vector<Advice> camera_advice(const std::vector<Sheet>& sheets,
                                                const CameraCalibration& calibration,
                                                const CameraReport& report);

}  // namespace hexcal
