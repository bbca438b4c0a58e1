#pragma once

#include "photogrammetry/markers/marker.h"

namespace hexcal {

/// Edge of all that is printed of a family's markers over the edge of the square: 1, or more where data lie
/// outside the square (tagStandard41h12: 9/5).
[[nodiscard]] double printed_share(const MarkerFamily& family);

/// True for a pattern that looks the same after a quarter or half turn (DICT_ARUCO_ORIGINAL has some): nobody
/// can tell which of its corners is the first.
[[nodiscard]] bool same_when_turned(const MarkerPattern& pattern);

}  // namespace hexcal
