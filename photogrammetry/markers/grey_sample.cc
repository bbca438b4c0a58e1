#include "photogrammetry/markers/grey_sample.h"

#include <cmath>

namespace hexcal {

std::optional<double> grey_sample(const cv::Mat& grey, const Eigen::Vector2d& px) {
  const double fx = std::floor(px.x());
  const double fy = std::floor(px.y());
  const int x = static_cast<int>(fx);
  const int y = static_cast<int>(fy);
  if (x < 0 || y < 0 || x + 1 >= grey.cols || y + 1 >= grey.rows) return std::nullopt;
  const auto at = [&grey](int row, int column) -> double {
    return grey.depth() == CV_16U ? grey.at<std::uint16_t>(row, column) : grey.at<std::uint8_t>(row, column);
  };
  const double sx = px.x() - fx;
  const double sy = px.y() - fy;
  return (at(y, x) * (1 - sx) + at(y, x + 1) * sx) * (1 - sy) +
         (at(y + 1, x) * (1 - sx) + at(y + 1, x + 1) * sx) * sy;
}

}  // namespace hexcal
