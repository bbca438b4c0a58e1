#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "camera_calib/sheet.h"

namespace hexcal {

/// Approximate pixels (about 1 px) of a chessboard's inner corners in the order of SheetGeometry::saddles;
/// empty if the whole board is not found. The order is that of the print: the top-left square is black. A
/// board that looks the same after half a turn is taken with its x axis to the right (or downwards if it
/// stands on end).
[[nodiscard]] std::vector<Eigen::Vector2d> find_chessboard(const cv::Mat& grey, const Sheet& sheet);

/// Squares of the whole chessboard in a photograph, the larger number first, whatever its size; nothing where
/// there is none.
[[nodiscard]] std::optional<std::pair<int, int>> chessboard_size(const cv::Mat& grey);

}  // namespace hexcal
