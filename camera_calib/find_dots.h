#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "camera_calib/sheet.h"

namespace hexcal {

/// Approximate pixels of a PhotoModeler sheet's dots in the order of SheetGeometry::dots, none where a dot is
/// not seen. The four ringed dots must be in view: their arcs (1 to 4) name them. Empty if they are not
/// found.
[[nodiscard]] std::vector<std::optional<Eigen::Vector2d>> find_ringed_dots(const cv::Mat& grey,
                                                                           const Sheet& sheet);

}  // namespace hexcal
