#include "camera_calib/find_chessboard.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace hexcal {
namespace {

constexpr int kSearchSide = 1600;  // px; the board's squares stay well above the finder's smallest

cv::Mat eight_bit(const cv::Mat& grey) {
  cv::Mat out;
  if (grey.depth() == CV_8U) return grey;
  double low = 0;
  double high = 1;
  cv::minMaxLoc(grey, &low, &high);
  grey.convertTo(out, CV_8U, 255.0 / std::max(high - low, 1.0), -255.0 * low / std::max(high - low, 1.0));
  return out;
}

std::vector<cv::Point2f> search(const cv::Mat& image, cv::Size corners) {
  std::vector<cv::Point2f> found;
  const int classic = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK;
  if (cv::findChessboardCorners(image, corners, found, classic)) return found;
  const int sector = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY;
  if (cv::findChessboardCornersSB(image, corners, found, sector)) return found;
  if (cv::findChessboardCorners(image, corners, found, cv::CALIB_CB_ADAPTIVE_THRESH)) return found;
  return {};
}

// Mean grey of the squares between inner corners whose column + row is even, minus that of the others. With
// the print's order those between corners (c, r) and (c + 1, r + 1) belong to square (c + 1, r + 1): even is
// black.
double even_minus_odd(const cv::Mat& image, const std::vector<cv::Point2f>& corners, int columns, int rows) {
  double sums[2] = {0, 0};
  int counts[2] = {0, 0};
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + 1 < columns; ++c) {
      cv::Point2f centre(0, 0);
      for (const int i : {0, 1}) {
        for (const int j : {0, 1})
          centre += 0.25F * corners[static_cast<std::size_t>((r + i) * columns + c + j)];
      }
      const cv::Point at(cvRound(centre.x), cvRound(centre.y));
      if (at.x < 0 || at.y < 0 || at.x >= image.cols || at.y >= image.rows) continue;
      sums[(c + r) % 2] += image.at<std::uint8_t>(at);
      ++counts[(c + r) % 2];
    }
  }
  return sums[0] / std::max(counts[0], 1) - sums[1] / std::max(counts[1], 1);
}

bool points_left(const std::vector<cv::Point2f>& corners, int columns) {
  const cv::Point2f along = corners[static_cast<std::size_t>(columns - 1)] - corners.front();
  return std::abs(along.x) >= std::abs(along.y) ? along.x < 0 : along.y < 0;
}

double search_scale(const cv::Mat& grey) {
  return std::min(1.0, static_cast<double>(kSearchSide) / std::max(grey.cols, grey.rows));
}

cv::Mat search_image(const cv::Mat& grey) {
  cv::Mat image = eight_bit(grey);
  const double scale = search_scale(grey);
  if (scale < 1) cv::resize(image, image, {}, scale, scale, cv::INTER_AREA);
  return image;
}

}  // namespace

std::optional<std::pair<int, int>> chessboard_size(const cv::Mat& grey) {
  constexpr int kFewestCorners = 3;
  std::vector<cv::Point2f> found;
  cv::Mat board;  // a cell per corner
  if (!cv::findChessboardCornersSB(search_image(grey), {kFewestCorners, kFewestCorners}, found,
                                   cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_LARGER, board))
    return std::nullopt;
  return std::pair(std::max(board.cols, board.rows) + 1, std::min(board.cols, board.rows) + 1);
}

std::vector<Eigen::Vector2d> find_chessboard(const cv::Mat& grey, const Sheet& sheet) {
  const int columns = sheet.columns - 1;
  const int rows = sheet.rows - 1;
  const cv::Mat image = search_image(grey);
  const double scale = search_scale(grey);
  std::vector<cv::Point2f> corners = search(image, {columns, rows});
  if (corners.empty()) return {};
  // The finder may follow the rows from the right: undo a mirrored order first.
  const cv::Point2f u = corners[static_cast<std::size_t>(columns - 1)] - corners.front();
  const cv::Point2f v = corners[static_cast<std::size_t>(columns * (rows - 1))] - corners.front();
  if (u.x * v.y - u.y * v.x < 0) {
    for (int r = 0; r < rows; ++r)
      std::reverse(corners.begin() + r * columns, corners.begin() + (r + 1) * columns);
  }
  // Half a turn swaps black and white unless the board is symmetric.
  const bool symmetric = (sheet.columns + sheet.rows) % 2 == 0;
  const bool turn =
      symmetric ? points_left(corners, columns) : even_minus_odd(image, corners, columns, rows) > 0;
  if (turn) std::reverse(corners.begin(), corners.end());
  std::vector<Eigen::Vector2d> out;
  for (const cv::Point2f& corner : corners) {
    // Pixel centres: small (i) covers big (i / scale) .. ((i + 1) / scale) - 1.
    out.emplace_back((corner.x + 0.5) / scale - 0.5, (corner.y + 0.5) / scale - 0.5);
  }
  return out;
}

}  // namespace hexcal
