#pragma once

#include "camera_calib/sheet.h"

namespace hexcal {

/// Edge (mm) of all that is printed of a sheet's marker: more than `marker_mm` where data lie outside the
/// square. 0 without markers.
[[nodiscard]] double printed_marker_mm(const Sheet& sheet);

}  // namespace hexcal
