#pragma once

#include <string>
#include <vector>

#include "kinematics/workspace.h"

namespace hexcal {

/// SVG of a slice: a cell per grid point, coloured by its verdict, with axes in mm or deg and a legend.
[[nodiscard]] std::string slice_picture(const std::vector<SliceCell>& cells, const SliceOptions& options);

}  // namespace hexcal
