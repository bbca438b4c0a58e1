#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/median.h"
#include "photogrammetry/markers/edge_fit.h"
#include "photogrammetry/markers/edge_scan.h"
#include "photogrammetry/markers/image_model.h"
#include "photogrammetry/markers/photometric_fit.h"
#include "photogrammetry/markers/refine.h"

namespace hexcal {
namespace {

constexpr double kMaxNoiseFactor = 6;  // JPEG's errors at edges over the noise of flat areas; more is misfit
constexpr double kProcessedNoise =
    3;  // the same of a picture whose edges are asked too; plain JPEG leaves less
constexpr double kSharedSidePx = 40;  // smaller markers tell little of the tone curve and the lens
constexpr double kClippedShare =
    0.02;                            // of a marker's pixels; from here on its levels are no evidence of tone
constexpr double kLensSigma = 0.01;  // of a real lens about the stand-in all markers agree on
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

// What its place, size and angle say, whatever measured it.
MarkerStatus verdict_on_geometry(const MarkerObservation& marker, const cv::Mat& grey,
                                 const CameraModel* camera, const RefineOptions& options) {
  const double tilt = tilt_of_square(marker.corners_px, camera);
  if (!inside_frame(marker.corners_px, grey)) return MarkerStatus::cut_by_frame;
  if (min_side(marker.corners_px) < options.min_side_px * std::cos(tilt)) return MarkerStatus::too_small;
  if (marker.side_px < options.min_side_px) return MarkerStatus::too_small;
  if (tilt * 180 / std::numbers::pi > options.max_tilt_deg) return MarkerStatus::too_steep;
  return MarkerStatus::ok;
}

// Whether the photometric model explains a marker's pixels. `not_refined`: it does not, its edges are to say.
MarkerStatus verdict_on_photometry(const PhotometricFit& fit, const MarkerObservation& marker,
                                   const RefineOptions& options) {
  if (!fit.converged) return MarkerStatus::not_refined;
  if (fit.visible < options.min_visible) return MarkerStatus::not_refined;
  if (marker.chi2_per_dof > options.max_chi2_per_dof && fit.misfit > kProcessedMisfit) {
    return MarkerStatus::not_refined;
  }
  return marker.contrast < options.min_contrast ? MarkerStatus::low_contrast : MarkerStatus::ok;
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
  return {before.pattern, fit.corners_px, fit.blur_px, fit.saturated > kClippedShare};
}

// All markers' evidence about the tone curve and the lens stand-in together (their fits' Schur complements).
Shared pool(const std::vector<PhotometricFit>& fits) {
  Eigen::Matrix<double, kNumShared, kNumShared> information;
  information.setZero();
  information.diagonal() << 4, 4, 10, 10, 1, 0.1;  // weak: 0.5, 0.3 and whatever a camera may sharpen
  Shared rhs = Shared::Zero();
  std::vector<double> quality;
  for (const auto& fit : fits) {
    if (fit.converged) quality.push_back(fit.chi2_per_dof);
  }
  if (quality.empty()) return rhs;
  const double limit = 3 * median(quality);
  for (const auto& fit : fits) {
    if (!fit.converged || fit.chi2_per_dof > limit || fit.saturated > kClippedShare || fit.visible < 0.8)
      continue;
    const auto weighted = fit.shared_information / std::max(fit.chi2_per_dof, 0.1);
    information += weighted;
    rhs += weighted * fit.shared;
  }
  return information.ldlt().solve(rhs);
}

// Whether the photograph was sharpened, and how. A few of its largest markers are fitted with an unsharp mask
// of their own: taken up if that explains a good part of their residuals, far more than two numbers more do
// by chance in thousands of pixels.
void find_sharpening(const cv::Mat& grey, const std::vector<MarkerGuess>& guesses,
                     const std::vector<PhotometricFit>& fits, bool free_tone, PhotographModel& photograph) {
  constexpr std::size_t kMarkers = 6;
  constexpr double kUnexplained = 2;  // chi^2 per degree of freedom; below, there is nothing to explain
  constexpr double kExplains = 0.8;   // of it left
  constexpr double kLeastAmount = 0.05;
  std::vector<std::size_t> chosen;
  std::vector<double> quality;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    if (!fits[k].converged || mean_side(guesses[k].corners_px) < kSharedSidePx) continue;
    chosen.push_back(k);
    quality.push_back(fits[k].chi2_per_dof);
  }
  if (chosen.empty() || median(quality) < kUnexplained) return;
  std::stable_sort(chosen.begin(), chosen.end(), [&](std::size_t a, std::size_t b) {
    return mean_side(guesses[a].corners_px) > mean_side(guesses[b].corners_px);
  });
  chosen.resize(std::min(chosen.size(), kMarkers));
  std::vector<PhotometricFit> plain(chosen.size());
  std::vector<PhotometricFit> masked(chosen.size());
  tbb::parallel_for(std::size_t{0}, chosen.size(), [&](std::size_t i) {
    const MarkerGuess& guess = guesses[chosen[i]];
    FitRequest request{BlurredPattern(*guess.pattern), guess.pattern->square_cells, guess.corners_px};
    request.free_tone = free_tone;
    request.max_pixels = kPixelsOfFirstLook;
    request.blur_px = guess.blur_px;
    plain[i] = fit_pattern(grey, photograph, request);
    request.free_sharpening = true;
    masked[i] = fit_pattern(grey, photograph, request);
  });
  std::vector<double> ratio;
  std::array<std::vector<double>, kNumShared> shared;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (!plain[i].converged || !masked[i].converged) continue;
    ratio.push_back(masked[i].misfit / std::max(plain[i].misfit, 1e-9));
    for (std::size_t j = 0; j < shared.size(); ++j)
      shared[j].push_back(masked[i].shared[static_cast<Eigen::Index>(j)]);
  }
  const auto typical = [&shared](int parameter) {
    return median(shared[static_cast<std::size_t>(parameter - kShared)]);
  };
  const Sharpening found{typical(kSharpening), typical(kSharpening + 1)};
  if (ratio.empty() || found.amount < kLeastAmount || std::pow(median(ratio), 2) > kExplains) return;
  photograph.sharpening = found;
  // The curve as it was told without the mask had to stand in for it.
  if (free_tone) {
    photograph.tone = ToneResponse(photograph.tone.nominal(), typical(kTone), typical(kTone + 1));
  }
}

// How a photograph's residuals compare with its noise model.
struct ResidualLevel {
  double noise = 1;        // variance at edges over that of the noise model, which JPEG makes too small
  double correlation = 1;  // by which neighbouring residuals' correlation enlarges covariances
  bool processed = false;  // residuals at edges far beyond what plain JPEG leaves
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
          std::max(1.0, median(correlation)), median(noise) > kProcessedNoise};
}

MarkerObservation observation_from(const PhotometricFit& fit, const std::array<Eigen::Vector2d, 4>& guess,
                                   const cv::Mat& grey, const CameraModel* camera, const ResidualLevel& level,
                                   const RefineOptions& options) {
  MarkerObservation marker;
  marker.corners_px = guess;
  marker.side_px = mean_side(guess);
  if (!fit.converged) return marker;
  marker.method = MarkerMethod::photometric;
  marker.corners_px = fit.corners_px;
  marker.chi2_per_dof = fit.chi2_per_dof / level.noise;
  marker.covariance_px2 = fit.covariance_px2 * (fit.chi2_per_dof * level.correlation);
  marker.blur_px = fit.blur_px;
  marker.contrast = fit.white - fit.black;
  marker.side_px = mean_side(fit.corners_px);
  marker.status = verdict_on_photometry(fit, marker, options);
  const MarkerStatus geometry = verdict_on_geometry(marker, grey, camera, options);
  if (geometry != MarkerStatus::ok) marker.status = geometry;
  return marker;
}

// What the edges of a photograph's markers scatter by about flat squares, for the test of one of them.
double usual_scatter(const std::vector<EdgeFit>& fits, std::size_t without) {
  constexpr std::size_t kLeastMarkers = 3;
  constexpr double kWithoutOthersPx = 0.2;
  std::vector<double> scatter;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    if (i != without && fits[i].converged && fits[i].visible > 0.8) scatter.push_back(fits[i].scatter_px);
  }
  return scatter.size() < kLeastMarkers ? kWithoutOthersPx : median(scatter);
}

// A marker's observation by its edges, `usual_px` being what those of the others scatter by.
MarkerObservation observation_from(const EdgeFit& edges, double usual_px, MarkerObservation marker,
                                   const cv::Mat& grey, const CameraModel* camera,
                                   const RefineOptions& options) {
  constexpr double kUnusual = 4;       // times what the others scatter by
  constexpr double kUnusualPx = 0.25;  // and so much at least: less bends no corner
  marker.method = MarkerMethod::edges;
  marker.corners_px = edges.corners_px;
  marker.covariance_px2 = edges.covariance_px2;
  marker.contrast = edges.contrast;
  marker.side_px = mean_side(edges.corners_px);
  marker.status = verdict_on_geometry(marker, grey, camera, options);
  if (marker.status != MarkerStatus::ok) return marker;
  if (edges.visible < options.min_visible) {
    marker.status = MarkerStatus::occluded;
  } else if (edges.scatter_px > std::max(kUnusual * usual_px, kUnusualPx)) {
    marker.status = MarkerStatus::misfit;
  }
  return marker;
}

// The outline as it was found, where its sides, looked up once, agree with it.
MarkerObservation observation_from_outline(const MarkerGuess& guess, const ToneResponse& tone,
                                           MarkerObservation marker, const cv::Mat& grey,
                                           const CameraModel* camera, const RefineOptions& options) {
  constexpr double kLeastSigmaPx = 0.3;
  constexpr double kMostPx = 1.5;  // between the outline and its sides
  marker.method = MarkerMethod::quad;
  marker.corners_px = guess.corners_px;
  marker.side_px = mean_side(guess.corners_px);
  marker.status = MarkerStatus::not_refined;
  const auto scanned =
      scan_edges(grey, tone, BlurredPattern(*guess.pattern), guess.pattern->square_cells, guess.corners_px);
  if (!scanned) return marker;
  double farthest = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    farthest = std::max(farthest, ((*scanned)[i] - guess.corners_px[i]).norm());
  }
  if (farthest > kMostPx) return marker;
  marker.corners_px = *scanned;
  marker.side_px = mean_side(*scanned);
  const double sigma = std::max(farthest, kLeastSigmaPx);
  marker.covariance_px2 = sigma * sigma * Eigen::Matrix<double, 8, 8>::Identity();
  marker.status = verdict_on_geometry(marker, grey, camera, options);
  return marker;
}

// Edges of all markers of a photograph, from the outline or from the photometric fit, wherever more of them
// are found: a fit that went wrong may have gone astray.
std::vector<EdgeFit> fit_all_edges(const cv::Mat& grey, const PhotographModel& photograph,
                                   const std::vector<MarkerGuess>& found,
                                   const std::vector<MarkerGuess>& fitted) {
  std::vector<EdgeFit> fits(found.size());
  tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t k) {
    const double square_cells = found[k].pattern->square_cells;
    const BlurredPattern pattern(*found[k].pattern);
    std::array<Eigen::Vector2d, 4> corners = found[k].corners_px;
    if (const auto scanned = scan_edges(grey, photograph.tone, pattern, square_cells, corners)) {
      corners = *scanned;
    }
    fits[k] = fit_edges(grey, photograph.map, pattern, square_cells, corners);
    if (!fitted[k].blur_px || (fits[k].converged && fits[k].visible > 0.9)) return;
    const EdgeFit other = fit_edges(grey, photograph.map, pattern, square_cells, fitted[k].corners_px);
    if (other.converged && other.visible > fits[k].visible) fits[k] = other;
  });
  return fits;
}

// Variance, px^2, by which the photometric fits and the edges alone disagree in a photograph beyond what both
// state. The two stand on different assumptions of the picture, so that it shows what theirs are wrong by.
double disagreement_px2(const std::vector<MarkerObservation>& markers, const std::vector<EdgeFit>& edges) {
  std::vector<double> difference;
  std::vector<double> stated;
  for (std::size_t k = 0; k < markers.size(); ++k) {
    if (markers[k].status != MarkerStatus::ok || !edges[k].converged) continue;
    double sum = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      sum += (markers[k].corners_px[i] - edges[k].corners_px[i]).squaredNorm();
    }
    difference.push_back(sum / 8);
    stated.push_back((markers[k].covariance_px2 + edges[k].covariance_px2).trace() / 8);
  }
  return std::max(median(difference) - median(stated), 0.0);
}

// Where a picture was processed beyond what the photometric model explains: markers that it does not explain
// are measured by their edges, those of all markers saying what is usual; the others' sigmas take in what the
// edges disagree with them by.
void consult_edges(const cv::Mat& grey, const PhotographModel& photograph, const ResidualLevel& level,
                   const std::vector<MarkerGuess>& found, const std::vector<MarkerGuess>& fitted,
                   const RefineOptions& options, const CameraModel* camera,
                   std::vector<MarkerObservation>& markers) {
  const bool processed = photograph.sharpening.amount > 0 || level.processed;
  const auto unexplained = [](const MarkerObservation& marker) {
    return marker.status == MarkerStatus::not_refined;
  };
  if (!processed && std::none_of(markers.begin(), markers.end(), unexplained)) return;
  const std::vector<EdgeFit> edges = fit_all_edges(grey, photograph, found, fitted);
  const double extra = processed ? disagreement_px2(markers, edges) : 0;
  for (std::size_t k = 0; k < markers.size(); ++k) {
    if (unexplained(markers[k])) {
      markers[k] =
          edges[k].converged
              ? observation_from(edges[k], usual_scatter(edges, k), markers[k], grey, camera, options)
              : observation_from_outline(found[k], photograph.tone, markers[k], grey, camera, options);
    } else {
      markers[k].covariance_px2.diagonal().array() += extra;
    }
  }
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
  check("min_visible", min_visible, 0, 1);
  check("max_chi2_per_dof", max_chi2_per_dof, 1, 1e9);
  check("max_pixels", max_pixels, 500, 1e9);
}

RefinedMarkers refine_markers(const cv::Mat& grey, const Processing& processing,
                              const std::vector<MarkerGuess>& guesses, const RefineOptions& options,
                              const CameraModel* camera) {
  options.validate();
  const ToneResponse& tone = processing.tone;
  RefinedMarkers out{{}, processing, guesses};
  if (guesses.empty()) return out;
  PhotographModel photograph{camera != nullptr ? PixelMap(*camera) : PixelMap(grey.cols, grey.rows, {}), tone,
                             estimate_noise(grey, {0, 0, grey.cols, grey.rows}), processing.sharpening};
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
  if (any_new) find_sharpening(grey, out.guesses, fits, free_tone, photograph);
  const bool second_look = free_lens || (free_tone && !rough) || photograph.sharpening.amount > 0;
  tbb::parallel_for(std::size_t{0}, guesses.size(), [&](std::size_t k) {
    MarkerGuess& guess = out.guesses[k];
    if (!guess.blur_px || (first_look(k) && !second_look)) return;
    // Clipped edges tell their place only together with the tone curve.
    const bool with_tone = free_tone && guess.clipped;
    fits[k] = fit_marker_again(grey, photograph, guess, with_tone, free_lens && tells_shared(k),
                               options.max_pixels);
    guess =
        fits[k].converged ? guess_from(guess, fits[k]) : MarkerGuess{guess.pattern, guesses[k].corners_px};
  });
  out.processing = {photograph.tone, photograph.sharpening};
  const ResidualLevel level = residual_level(fits);
  for (std::size_t k = 0; k < guesses.size(); ++k) {
    out.markers.push_back(observation_from(fits[k], guesses[k].corners_px, grey, camera, level, options));
  }
  consult_edges(grey, photograph, level, guesses, out.guesses, options, camera, out.markers);
  return out;
}

}  // namespace hexcal
