#include <algorithm>
#include <cmath>

#include "photogrammetry/markers/photometric_fit.h"
#include "photogrammetry/markers/refine.h"

namespace hexcal {
namespace {

constexpr double kWindowShare = 0.45;  // of the way to the neighbouring corners
constexpr double kMaxWindowPx = 12;
constexpr double kMinWindowPx = 2.5;
constexpr double kMaxMovePx = 3;
constexpr double kMaxMoveInGaps =
    0.7;                         // farther, the fit may have taken a marker's border for a square's edge
constexpr double kMinGapPx = 1;  // a narrower gap is no edge of its own
constexpr double kBeyondEdgePx = 1.5;  // what the point spread brings in from beyond a marker's border
constexpr double kNoiseMarginPx = 40;

// Sharpening, JPEG and a curve that is not sRGB's leave residuals alike on both sides of both edges: they do
// not move the middle. What is no corner of a chessboard leaves more than this (rms over the contrast).
constexpr double kMaxMisfit = 0.2;

// Brightness of the quadrants at -x -y and +x +y less that of the other two, over full scale.
double diagonal_contrast(const cv::Mat& grey, const Eigen::Vector2d& at, const Eigen::Vector2d& x,
                         const Eigen::Vector2d& y) {
  const auto value = [&grey](const Eigen::Vector2d& p) -> double {
    const int column = std::clamp(static_cast<int>(std::lround(p.x())), 0, grey.cols - 1);
    const int row = std::clamp(static_cast<int>(std::lround(p.y())), 0, grey.rows - 1);
    return grey.depth() == CV_16U ? grey.at<std::uint16_t>(row, column) : grey.at<std::uint8_t>(row, column);
  };
  double difference = 0;
  for (const double reach : {0.5, 0.75, 1.0}) {
    difference += value(at - reach * (x + y)) + value(at + reach * (x + y)) - value(at + reach * (x - y)) -
                  value(at + reach * (y - x));
  }
  return difference / (6 * full_scale(grey));
}

}  // namespace

PointObservation refine_saddle(const cv::Mat& grey, ToneCurve tone, const SaddleGuess& guess,
                               const RefineOptions& options) {
  options.validate();
  PointObservation point;
  point.px = guess.px;
  const double shorter = std::min(guess.to_x_px.norm(), guess.to_y_px.norm());
  const double gap_px = guess.gap * shorter;
  const bool markers = gap_px >= kMinGapPx;
  double window_px = std::min(kWindowShare * shorter, kMaxWindowPx);
  if (markers) window_px = std::min(window_px, gap_px + guess.border * shorter - kBeyondEdgePx);
  if (!(window_px >= kMinWindowPx)) {
    point.status = MarkerStatus::too_small;
    return point;
  }
  if (guess.px.minCoeff() < window_px || guess.px.x() > grey.cols - 1 - window_px ||
      guess.px.y() > grey.rows - 1 - window_px) {
    point.status = MarkerStatus::cut_by_frame;
    return point;
  }
  // The fit's square reaches one of the pattern's cells from the middle: as far as the window, or as a
  // marker's gap. A frame with the square's orientation: x to y clockwise in the image.
  const double cell = markers ? guess.gap : window_px / shorter;
  Eigen::Vector2d x = guess.to_x_px * cell;
  Eigen::Vector2d y = guess.to_y_px * cell;
  if (!markers) {
    x = x.normalized() * window_px;
    y = y.normalized() * window_px;
  }
  if (x.x() * y.y() - x.y() * y.x() < 0) y = -y;
  // The pattern's top-left quadrant is white: turn it by a quarter if the image's is not.
  const double contrast = diagonal_contrast(grey, guess.px, 0.7 * x, 0.7 * y);
  if (guess.top_left_white && (contrast > 0) != *guess.top_left_white) {
    point.status = MarkerStatus::misfit;
    return point;
  }
  if (contrast <= 0) {
    const Eigen::Vector2d old = x;
    x = y;
    y = -old;
  }
  const PhotographModel photograph{
      PixelMap(grey.cols, grey.rows, {}), ToneResponse(tone),
      estimate_noise(grey, {static_cast<int>(guess.px.x() - kNoiseMarginPx),
                            static_cast<int>(guess.px.y() - kNoiseMarginPx),
                            static_cast<int>(2 * kNoiseMarginPx), static_cast<int>(2 * kNoiseMarginPx)})};
  FitRequest request{markers ? BlurredPattern::saddle_between_markers() : BlurredPattern::saddle(), 2, {}};
  request.corners_px = {Eigen::Vector2d(guess.px - x - y), Eigen::Vector2d(guess.px + x - y),
                        Eigen::Vector2d(guess.px + x + y), Eigen::Vector2d(guess.px - x + y)};
  request.affine = true;
  request.window_cells = markers ? window_px / gap_px : 1;
  const PhotometricFit fit = fit_pattern(grey, photograph, request);
  if (!fit.converged) return point;
  point.px = fit.centre_px;
  point.chi2_per_dof = fit.chi2_per_dof;
  // The windows that tell the noise hold edges too, so that the residuals know better.
  point.covariance_px2 = fit.centre_covariance_px2 * fit.chi2_per_dof;
  point.blur_px = fit.blur_px;
  point.contrast = fit.white - fit.black;
  const double max_move = markers ? std::min(kMaxMovePx, kMaxMoveInGaps * gap_px) : kMaxMovePx;
  if ((point.px - guess.px).norm() > max_move) {
    point.status = MarkerStatus::not_refined;
  } else if (point.contrast < options.min_contrast) {
    point.status = MarkerStatus::low_contrast;
  } else if (point.chi2_per_dof > options.max_chi2_per_dof && fit.misfit > kMaxMisfit) {
    point.status = MarkerStatus::misfit;
  } else {
    point.status = MarkerStatus::ok;
  }
  return point;
}

}  // namespace hexcal
