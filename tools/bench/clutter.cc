#include "tools/bench/clutter.h"

#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <vector>

namespace hexcal {
namespace {

using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
}
int whole(Random& random, int low, int high) {
  return low + static_cast<int>(random() % static_cast<std::uint64_t>(high - low + 1));
}

// Pastes a small picture through a random perspective.
void paste(cv::Mat& photograph, const cv::Mat& picture, Random& random) {
  const double size = uniform(random, 40, 450);
  const double x = uniform(random, -50, photograph.cols - 50);
  const double y = uniform(random, -50, photograph.rows - 50);
  const double turn = uniform(random, 0, 2 * CV_PI);
  const double squeeze = uniform(random, 0.4, 1);
  std::vector<cv::Point2f> to;
  for (const auto& [u, v] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
    const double a = 0.5 * size * u * uniform(random, 0.93, 1.07);
    const double b = 0.5 * size * v * squeeze * uniform(random, 0.93, 1.07);
    to.emplace_back(static_cast<float>(x + a * std::cos(turn) - b * std::sin(turn)),
                    static_cast<float>(y + a * std::sin(turn) + b * std::cos(turn)));
  }
  const auto w = static_cast<float>(picture.cols);
  const auto h = static_cast<float>(picture.rows);
  const std::vector<cv::Point2f> from{{0, 0}, {w, 0}, {w, h}, {0, h}};
  const cv::Mat homography = cv::getPerspectiveTransform(from, to);
  // Only the surroundings are touched.
  const cv::Rect box = cv::boundingRect(to) & cv::Rect(0, 0, photograph.cols, photograph.rows);
  if (box.empty()) return;
  const cv::Mat shift = (cv::Mat_<double>(3, 3) << 1, 0, -box.x, 0, 1, -box.y, 0, 0, 1);
  cv::Mat part = photograph(box);
  cv::warpPerspective(picture, part, shift * homography, box.size(), cv::INTER_AREA, cv::BORDER_TRANSPARENT);
}

// A white margin, a black border, random cells: a marker of no family.
cv::Mat random_cells(Random& random) {
  const int inner = whole(random, 3, 8);
  const int cells = inner + 4;
  const auto black = static_cast<std::uint8_t>(whole(random, 10, 60));
  const auto white = static_cast<std::uint8_t>(whole(random, 130, 235));
  cv::Mat grid(cells, cells, CV_8UC1, cv::Scalar(white));
  for (int y = 1; y < cells - 1; ++y) {
    for (int x = 1; x < cells - 1; ++x) {
      const bool border = x == 1 || y == 1 || x == cells - 2 || y == cells - 2;
      grid.at<std::uint8_t>(y, x) = border || random() % 2 == 0 ? black : white;
    }
  }
  cv::Mat picture;
  cv::resize(grid, picture, {}, 40, 40, cv::INTER_NEAREST);
  return picture;
}

cv::Mat nested_squares(Random& random) {
  cv::Mat picture(400, 400, CV_8UC1, cv::Scalar(whole(random, 120, 230)));
  int inset = 30;
  bool dark = true;
  while (inset < 180) {
    cv::rectangle(picture, {inset, inset, 400 - 2 * inset, 400 - 2 * inset},
                  cv::Scalar(dark ? whole(random, 10, 70) : whole(random, 120, 230)), cv::FILLED);
    inset += whole(random, 20, 120);
    dark = !dark;
  }
  return picture;
}

cv::Mat chessboard(Random& random) {
  const int cells = whole(random, 4, 14);
  cv::Mat grid(cells, cells, CV_8UC1);
  for (int y = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) grid.at<std::uint8_t>(y, x) = (x + y) % 2 == 0 ? 30 : 200;
  }
  cv::Mat picture;
  cv::resize(grid, picture, {400, 400}, 0, 0, cv::INTER_NEAREST);
  return picture;
}

cv::Mat writing(Random& random) {
  cv::Mat picture(400, 400, CV_8UC1, cv::Scalar(whole(random, 150, 235)));
  for (int line = 1; line < 9; ++line) {
    std::string text;
    for (int i = 0; i < 14; ++i) text += static_cast<char>(whole(random, 33, 126));
    cv::putText(picture, text, {5, 45 * line}, cv::FONT_HERSHEY_SIMPLEX, uniform(random, 0.6, 1.3),
                cv::Scalar(whole(random, 10, 80)), whole(random, 1, 4), cv::LINE_AA);
  }
  return picture;
}

}  // namespace

cv::Mat clutter_photograph(std::uint64_t seed) {
  Random random(0x9E3779B97F4A7C15U + seed);
  cv::Mat photograph(kClutterHeightPx, kClutterWidthPx, CV_8UC1);
  // Texture of several sizes.
  cv::Mat sum(photograph.size(), CV_16SC1, cv::Scalar(whole(random, 60, 160)));
  for (const int step : {400, 60, 8}) {
    cv::Mat coarse(photograph.rows / step + 2, photograph.cols / step + 2, CV_16SC1);
    for (int y = 0; y < coarse.rows; ++y) {
      for (int x = 0; x < coarse.cols; ++x) {
        coarse.at<std::int16_t>(y, x) = static_cast<std::int16_t>(whole(random, -25, 25));
      }
    }
    cv::Mat fine;
    cv::resize(coarse, fine, photograph.size(), 0, 0, cv::INTER_LINEAR);
    sum += fine;
  }
  sum.convertTo(photograph, CV_8UC1);
  for (int i = 0; i < 250; ++i) {
    const int kind = whole(random, 0, 7);
    if (kind < 4) {
      paste(photograph, random_cells(random), random);
    } else if (kind == 4) {
      paste(photograph, nested_squares(random), random);
    } else if (kind == 5) {
      paste(photograph, chessboard(random), random);
    } else if (kind == 6) {
      paste(photograph, writing(random), random);
    } else {
      const cv::Point at(whole(random, 0, photograph.cols), whole(random, 0, photograph.rows));
      const int radius = whole(random, 10, 120);
      cv::circle(photograph, at, radius, cv::Scalar(whole(random, 10, 240)), cv::FILLED, cv::LINE_AA);
      cv::circle(photograph, at, radius / 2, cv::Scalar(whole(random, 10, 240)), cv::FILLED, cv::LINE_AA);
    }
  }
  cv::GaussianBlur(photograph, photograph, {}, uniform(random, 0.6, 1.5));
  std::vector<std::uint8_t> noise(65536);
  for (auto& value : noise) value = static_cast<std::uint8_t>(whole(random, 0, 6));
  for (int y = 0; y < photograph.rows; ++y) {
    const std::size_t offset = random() % noise.size();
    std::uint8_t* row = photograph.ptr(y);
    for (int x = 0; x < photograph.cols; ++x) {
      const int value = row[x] + noise[(offset + static_cast<std::size_t>(x)) % noise.size()] - 3;
      row[x] = cv::saturate_cast<std::uint8_t>(value);
    }
  }
  return photograph;
}

}  // namespace hexcal
