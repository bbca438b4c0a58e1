#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/median.h"
#include "photogrammetry/markers/edge_scan.h"
#include "photogrammetry/markers/photometric_fit.h"
#include "photogrammetry/markers/refine.h"

namespace hexcal {
namespace {

constexpr double kMaxNoiseFactor = 6;  // JPEG's errors at edges over the noise of flat areas; more is misfit
constexpr double kSharedSidePx = 40;   // smaller markers tell little of the tone curve and the lens
constexpr double kLensSigma = 0.01;    // of a real lens about the stand-in all markers agree on
constexpr int kPixelsOfFirstLook = 2000;  // when the photograph's own parameters are still to be told

// Strong JPEG and in-camera sharpening leave residuals far above the noise, yet small beside the contrast:
// such a marker is measured, with its covariance widened. What is no marker's image leaves more.
constexpr double kProcessedMisfit = 0.06;
using Shared = Eigen::Matrix<double, kNumShared, 1>;

double min_side(const std::array<Eigen::Vector2d, 4>& corners) {
  double least = (corners[0] - corners[3]).norm();
  for (std::size_t i = 0; i < 3; ++i) least = std::min(least, (corners[i + 1] - corners[i]).norm());
  return least;
}

double mean_side(const std::array<Eigen::Vector2d, 4>& corners) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) sum += (corners[(i + 1) % 4] - corners[i]).norm();
  return sum / 4;
}

bool inside_frame(const std::array<Eigen::Vector2d, 4>& corners, const cv::Mat& grey) {
  constexpr double kMargin = 0.5;
  return std::all_of(corners.begin(), corners.end(), [&grey](const Eigen::Vector2d& corner) {
    return corner.x() > kMargin && corner.y() > kMargin && corner.x() < grey.cols - 1 - kMargin &&
           corner.y() < grey.rows - 1 - kMargin;
  });
}

// Angle between a square's normal and the line of sight, from its corners; by weak perspective without a
// camera.
double tilt_of_square(const std::array<Eigen::Vector2d, 4>& corners_px, const CameraModel* camera) {
  // Local affine map of the square at its centre. Seen by a camera, it is taken to the plane across the line
  // of sight first, so that a marker at the frame's edge is judged by its own angle.
  std::array<Eigen::Vector2d, 4> points = corners_px;
  Eigen::Matrix2d across = Eigen::Matrix2d::Identity();
  if (camera != nullptr) {
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (auto& point : points) {
      const auto normalised = camera->normalised_from_image(point);
      if (!normalised) return 0;
      point = *normalised;
      middle += 0.25 * point;
    }
    const double length2 = 1 + middle.squaredNorm();
    const double r = middle.norm();
    if (r > 1e-9) {
      const Eigen::Vector2d radial = middle / r;
      const Eigen::Vector2d tangent(-radial.y(), radial.x());
      across = radial * radial.transpose() / length2 + tangent * tangent.transpose() / std::sqrt(length2);
    }
  }
  Eigen::Matrix2d affine;
  affine.col(0) = 0.25 * (points[1] + points[2] - points[0] - points[3]);
  affine.col(1) = 0.25 * (points[2] + points[3] - points[0] - points[1]);
  const Eigen::JacobiSVD<Eigen::Matrix2d> svd(across * affine);
  const auto singular = svd.singularValues();
  return singular[0] > 0 ? std::acos(std::clamp(singular[1] / singular[0], 0.0, 1.0)) : 0;
}

MarkerStatus verdict(const PhotometricFit& fit, const MarkerObservation& marker, const cv::Mat& grey,
                     double tilt, const RefineOptions& options) {
  if (!fit.converged) return MarkerStatus::not_refined;
  if (!inside_frame(fit.corners_px, grey)) return MarkerStatus::cut_by_frame;
  if (min_side(fit.corners_px) < options.min_side_px * std::cos(tilt)) return MarkerStatus::too_small;
  if (marker.side_px < options.min_side_px) return MarkerStatus::too_small;
  if (tilt * 180 / std::numbers::pi > options.max_tilt_deg) return MarkerStatus::too_steep;
  if (fit.saturated > options.max_saturated) return MarkerStatus::saturated;
  if (marker.contrast < options.min_contrast) return MarkerStatus::low_contrast;
  if (fit.visible < options.min_visible) return MarkerStatus::occluded;
  if (marker.chi2_per_dof > options.max_chi2_per_dof && fit.misfit > kProcessedMisfit) {
    return MarkerStatus::misfit;
  }
  return MarkerStatus::ok;
}

// From approximate corners to a fit: edges first, then the photometric fit.
PhotometricFit fit_marker(const cv::Mat& grey, const PhotographModel& photograph, const MarkerGuess& guess,
                          bool free_tone, bool free_lens, int max_pixels) {
  FitRequest request{BlurredPattern(*guess.pattern), guess.pattern->square_cells, guess.corners_px};
  request.free_tone = free_tone;
  request.free_lens = free_lens;
  request.max_pixels = free_tone || free_lens ? std::min(kPixelsOfFirstLook, max_pixels) : max_pixels;
  if (const auto scanned =
          scan_edges(grey, photograph.tone, request.pattern, guess.pattern->square_cells, guess.corners_px)) {
    request.corners_px = *scanned;
  }
  return fit_pattern(grey, photograph, request);
}

// The same marker again, from its fit with an earlier model of the photograph. With `free_lens` the marker's
// own curvature may differ a little from that of the photograph's lens stand-in.
PhotometricFit fit_marker_again(const cv::Mat& grey, const PhotographModel& photograph,
                                const MarkerGuess& guess, bool free_tone, bool free_lens, int max_pixels) {
  FitRequest request{BlurredPattern(*guess.pattern), guess.pattern->square_cells, guess.corners_px};
  request.free_tone = free_tone;
  request.free_lens = free_lens;
  request.lens_sigma = kLensSigma;
  request.max_pixels = max_pixels;
  request.blur_px = guess.blur_px;
  return fit_pattern(grey, photograph, request);
}

MarkerGuess guess_from(const MarkerGuess& before, const PhotometricFit& fit) {
  return {before.pattern, fit.corners_px, fit.blur_px};
}

// All markers' evidence about the tone curve and the lens stand-in together (their fits' Schur complements).
Shared pool(const std::vector<PhotometricFit>& fits) {
  Eigen::Matrix<double, kNumShared, kNumShared> information;
  information.setZero();
  information.diagonal() << 4, 4, 10, 10;  // weak: 0.5 and 0.3
  Shared rhs = Shared::Zero();
  std::vector<double> quality;
  for (const auto& fit : fits) {
    if (fit.converged) quality.push_back(fit.chi2_per_dof);
  }
  if (quality.empty()) return rhs;
  const double limit = 3 * median(quality);
  for (const auto& fit : fits) {
    if (!fit.converged || fit.chi2_per_dof > limit || fit.saturated > 0.02 || fit.visible < 0.8) continue;
    const auto weighted = fit.shared_information / std::max(fit.chi2_per_dof, 0.1);
    information += weighted;
    rhs += weighted * fit.shared;
  }
  return information.ldlt().solve(rhs);
}

// How a photograph's residuals compare with its noise model.
struct ResidualLevel {
  double noise = 1;        // variance at edges over that of the noise model, which JPEG makes too small
  double correlation = 1;  // by which neighbouring residuals' correlation enlarges covariances
};

ResidualLevel residual_level(const std::vector<PhotometricFit>& fits) {
  std::vector<double> noise;
  std::vector<double> correlation;
  for (const auto& fit : fits) {
    if (!fit.converged) continue;
    noise.push_back(fit.chi2_per_dof);
    correlation.push_back(fit.covariance_factor / fit.chi2_per_dof);
  }
  if (noise.empty()) return {};
  // A few markers cannot tell noise from their own misfit.
  return {noise.size() < 4 ? 1 : std::clamp(median(noise), 1.0, kMaxNoiseFactor),
          std::max(1.0, median(correlation))};
}

MarkerObservation observation_from(const PhotometricFit& fit, const std::array<Eigen::Vector2d, 4>& guess,
                                   const cv::Mat& grey, const CameraModel* camera, const ResidualLevel& level,
                                   const RefineOptions& options) {
  MarkerObservation marker;
  marker.corners_px = guess;
  marker.side_px = mean_side(guess);
  if (!fit.converged) return marker;
  marker.corners_px = fit.corners_px;
  marker.chi2_per_dof = fit.chi2_per_dof / level.noise;
  marker.covariance_px2 = fit.covariance_px2 * (fit.chi2_per_dof * level.correlation);
  marker.blur_px = fit.blur_px;
  marker.contrast = fit.white - fit.black;
  marker.side_px = mean_side(fit.corners_px);
  marker.status = verdict(fit, marker, grey, tilt_of_square(fit.corners_px, camera), options);
  return marker;
}

}  // namespace

void RefineOptions::validate() const {
  const auto check = [](const char* field, double value, double low, double high) {
    if (!(value >= low && value <= high)) {
      throw InputError(fmt::format("{} is {}, wanted {} to {}", field, value, low, high));
    }
  };
  check("min_side_px", min_side_px, 4, 1e5);
  check("max_tilt_deg", max_tilt_deg, 0, 89);
  check("min_contrast", min_contrast, 0, 1);
  check("max_saturated", max_saturated, 0, 1);
  check("min_visible", min_visible, 0, 1);
  check("max_chi2_per_dof", max_chi2_per_dof, 1, 1e9);
  check("max_pixels", max_pixels, 500, 1e9);
}

RefinedMarkers refine_markers(const cv::Mat& grey, const ToneResponse& tone,
                              const std::vector<MarkerGuess>& guesses, const RefineOptions& options,
                              const CameraModel* camera) {
  options.validate();
  RefinedMarkers out{{}, tone, guesses};
  if (guesses.empty()) return out;
  PhotographModel photograph{camera != nullptr ? PixelMap(*camera) : PixelMap(grey.cols, grey.rows, {}), tone,
                             estimate_noise(grey, {0, 0, grey.cols, grey.rows})};
  std::vector<PhotometricFit> fits(guesses.size());
  const bool free_tone = tone.nominal() == ToneCurve::srgb;
  const bool free_lens = camera == nullptr;
  const auto tells_shared = [&guesses](std::size_t k) {
    return mean_side(guesses[k].corners_px) >= kSharedSidePx;
  };
  // Tone and lens first from each marker by itself, then as all of them say.
  const bool rough = options.max_pixels <= kPixelsOfFirstLook;
  const auto first_look = [&](std::size_t k) { return rough || !guesses[k].blur_px; };
  tbb::parallel_for(std::size_t{0}, guesses.size(), [&](std::size_t k) {
    const bool with_tone = free_tone && tells_shared(k);
    const bool with_lens = free_lens && tells_shared(k);
    if (!first_look(k)) return;
    fits[k] = guesses[k].blur_px
                  ? fit_marker_again(grey, photograph, guesses[k], with_tone, with_lens, options.max_pixels)
                  : fit_marker(grey, photograph, guesses[k], with_tone, with_lens, options.max_pixels);
    if (fits[k].converged) out.guesses[k] = guess_from(guesses[k], fits[k]);
  });
  const bool any_new = std::any_of(fits.begin(), fits.end(), [](const auto& fit) { return fit.converged; });
  if (any_new && (free_tone || free_lens)) {
    const Shared found = pool(fits);
    if (free_tone) photograph.tone = ToneResponse(tone.nominal(), found[0], found[1]);
    if (free_lens) photograph.map = PixelMap(grey.cols, grey.rows, LensStandIn{found[2], found[3]});
  }
  const bool second_look = free_lens || (free_tone && !rough);
  tbb::parallel_for(std::size_t{0}, guesses.size(), [&](std::size_t k) {
    MarkerGuess& guess = out.guesses[k];
    if (!guess.blur_px || (first_look(k) && !second_look)) return;
    fits[k] =
        fit_marker_again(grey, photograph, guess, false, free_lens && tells_shared(k), options.max_pixels);
    guess =
        fits[k].converged ? guess_from(guess, fits[k]) : MarkerGuess{guess.pattern, guesses[k].corners_px};
  });
  out.tone = photograph.tone;
  const ResidualLevel level = residual_level(fits);
  for (std::size_t k = 0; k < guesses.size(); ++k) {
    out.markers.push_back(observation_from(fits[k], guesses[k].corners_px, grey, camera, level, options));
  }
  return out;
}

}  // namespace hexcal
