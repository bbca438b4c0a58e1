#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "photogrammetry/camera/camera_model.h"
#include "photogrammetry/markers/marker.h"
#include "photogrammetry/markers/processing.h"

namespace hexcal {

/// When a marker is measured but not trusted.
struct RefineOptions {
  double min_side_px = 12;      ///< shortest side that is measured
  double max_tilt_deg = 80;     ///< angle between the marker's normal and the line of sight
  double min_contrast = 0.03;   ///< white minus black over full scale, linear light
  double min_visible = 0.6;     ///< share of the pattern's edges that are where the fit puts them
  double max_chi2_per_dof = 5;  ///< of the photometric fit; beyond, where residuals are more than a processed
                                ///< picture's too, the edges alone are measured
  int max_pixels = 6000;  ///< of a marker that its fit uses; more are thinned, and with 2000 or fewer the
                          ///< tone curve is each marker's own

  /// Throws InputError naming field and value.
  void validate() const;
};

/// Where a marker is thought to be.
struct MarkerGuess {
  const MarkerPattern* pattern;
  std::array<Eigen::Vector2d, 4> corners_px;  ///< in the order of MarkerObservation, within about 3 px
  std::optional<double> blur_px = {};         ///< of an earlier measurement, whose corners these are
  bool clipped = false;                       ///< as that found it
};

struct RefinedMarkers {
  std::vector<MarkerObservation> markers;  ///< in the order of the guesses, with id -1
  Processing processing;
  std::vector<MarkerGuess> guesses;  ///< for measuring them again through another lens, with this processing
};

/// Maximum-likelihood photometric fit of a photograph's markers: each pattern, mapped by a homography and the
/// lens, blurred, shaded by an illumination gradient between free black and white levels, passed through
/// the tone curve and sharpened, is fitted to the pixels around the pattern's transitions. The tone curve,
/// the sharpening, the noise and, without a camera, a common radial distortion are the photograph's and told
/// by all its markers together. Guesses that are an earlier measurement's are taken up where that ended,
/// which takes a third of the time. Clipped pixels count as bounds. Where the model does not explain a
/// marker's pixels its edges alone are measured (fit_edges()), and where those are too few its outline:
/// `method` says so and the covariance is as large as the edges disagree by. Refused is what has evidence
/// against it: too few of its edges in view, or edges that fit a flat square much worse than the other
/// markers' of the photograph. Runs in the caller's TBB arena; the result does not depend on the number of
/// threads.
[[nodiscard]] RefinedMarkers refine_markers(const cv::Mat& grey, const Processing& processing,
                                            const std::vector<MarkerGuess>& guesses,
                                            const RefineOptions& options = {},
                                            const CameraModel* camera = nullptr);

/// A point measured in a photograph.
struct PointObservation {
  MarkerStatus status = MarkerStatus::not_refined;
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();
  double chi2_per_dof = 0;
  double blur_px = 0;
  double contrast = 0;  ///< white minus black over full scale, linear light
};

/// Where four squares of a chessboard are thought to meet, and what the board's drawing says of them.
struct SaddleGuess {
  Eigen::Vector2d px;                ///< within about 2 px, and well within a marker's gap
  Eigen::Vector2d to_x_px, to_y_px;  ///< from it to the neighbouring corners, x right and y down in print
  /// Of a ChArUco board: white gap between a square's edge and its marker, and width of the marker's black
  /// border, both over the edge of a square. 0: the white squares are empty.
  double gap = 0, border = 0;
  /// Whether the square between -x and -y is white; none: as the photograph says. One that is seen the other
  /// way round is no such corner (a board turned by half a turn, a neighbour).
  std::optional<bool> top_left_white = {};
};

/// Measures it by a photometric fit. The window reaches 45 % of the way to the neighbouring corners, no
/// farther than a marker's black border, and at most 12 px; the border is part of the model.
[[nodiscard]] PointObservation refine_saddle(const cv::Mat& grey, ToneCurve tone, const SaddleGuess& guess,
                                             const RefineOptions& options = {});

/// The image of a printed dot's true centre. `image_from_plane` maps the board's plane to pixels near the dot
/// (a homography good to a few px; the lens may be linearised into it); centre and radius in the plane's
/// unit. The circle is projected as a conic, so that the eccentricity of its image (Luhmann 2014) is part of
/// the model; position and radius are free.
[[nodiscard]] PointObservation refine_dot(const cv::Mat& grey, ToneCurve tone,
                                          const Eigen::Matrix3d& image_from_plane,
                                          const Eigen::Vector2d& centre_in_plane, double radius,
                                          const RefineOptions& options = {});

}  // namespace hexcal
