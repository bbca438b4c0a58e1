#pragma once

#include <optional>

#include "camera_calib/sheet_adjustment.h"

namespace hexcal {

/// By how much the markers of a sheet are larger for their spacing than drawn, from the residuals of a fit;
/// what a wrong size or gap in sheet.yaml looks like. None without markers.
struct MarkerSizeError {
  double relative = 0;
  double sigma = 0;
};

[[nodiscard]] std::optional<MarkerSizeError> marker_size_error(const Sheet& sheet, int index,
                                                               const SheetAdjustmentResult& fit);

}  // namespace hexcal
