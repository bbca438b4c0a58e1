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
constexpr double kNoiseMarginPx = 40;

// Four quadrants, the top-left one white or black: whether the pixels there are brighter than beside it.
bool top_left_is_white(const cv::Mat& grey, const Eigen::Vector2d& at, const Eigen::Vector2d& x,
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
  return difference > 0;
}

}  // namespace

PointObservation refine_saddle(const cv::Mat& grey, ToneCurve tone, const Eigen::Vector2d& approximate_px,
                               const Eigen::Vector2d& to_x_px, const Eigen::Vector2d& to_y_px,
                               const RefineOptions& options) {
  options.validate();
  PointObservation point;
  point.px = approximate_px;
  const double shorter = std::min(to_x_px.norm(), to_y_px.norm());
  const double window_px = std::min(kWindowShare * shorter, kMaxWindowPx);
  if (!(window_px >= kMinWindowPx)) {
    point.status = MarkerStatus::too_small;
    return point;
  }
  if (approximate_px.minCoeff() < window_px || approximate_px.x() > grey.cols - 1 - window_px ||
      approximate_px.y() > grey.rows - 1 - window_px) {
    point.status = MarkerStatus::cut_by_frame;
    return point;
  }
  // The fit's cells are as long as the window reaches, so that it is one cell around the middle. A frame with
  // the square's orientation: x to y clockwise in the image.
  Eigen::Vector2d x = to_x_px.normalized() * window_px;
  Eigen::Vector2d y = to_y_px.normalized() * window_px;
  if (x.x() * y.y() - x.y() * y.x() < 0) y = -y;
  // The pattern's top-left quadrant is white: turn it by a quarter if the image's is not.
  if (!top_left_is_white(grey, approximate_px, 0.7 * x, 0.7 * y)) {
    const Eigen::Vector2d old = x;
    x = y;
    y = -old;
  }
  const PhotographModel photograph{
      PixelMap(grey.cols, grey.rows, {}), ToneResponse(tone),
      estimate_noise(grey, {static_cast<int>(approximate_px.x() - kNoiseMarginPx),
                            static_cast<int>(approximate_px.y() - kNoiseMarginPx),
                            static_cast<int>(2 * kNoiseMarginPx), static_cast<int>(2 * kNoiseMarginPx)})};
  FitRequest request{BlurredPattern::saddle(), 2, {}};
  request.corners_px = {Eigen::Vector2d(approximate_px - x - y), Eigen::Vector2d(approximate_px + x - y),
                        Eigen::Vector2d(approximate_px + x + y), Eigen::Vector2d(approximate_px - x + y)};
  request.affine = true;
  request.window_cells = 1;
  const PhotometricFit fit = fit_pattern(grey, photograph, request);
  if (!fit.converged) return point;
  point.px = fit.centre_px;
  point.chi2_per_dof = fit.chi2_per_dof;
  // The windows that tell the noise hold edges too, so that the residuals know better.
  point.covariance_px2 = fit.centre_covariance_px2 * fit.chi2_per_dof;
  point.blur_px = fit.blur_px;
  point.contrast = fit.white - fit.black;
  if ((point.px - approximate_px).norm() > kMaxMovePx) {
    point.status = MarkerStatus::not_refined;
  } else if (fit.saturated > options.max_saturated) {
    point.status = MarkerStatus::saturated;
  } else if (point.contrast < options.min_contrast) {
    point.status = MarkerStatus::low_contrast;
  } else if (point.chi2_per_dof > 4 * options.max_chi2_per_dof) {
    point.status = MarkerStatus::misfit;
  } else {
    point.status = MarkerStatus::ok;
  }
  return point;
}

}  // namespace hexcal
