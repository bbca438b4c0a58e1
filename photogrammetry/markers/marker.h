#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hexcal {

/// The printed pattern of one square marker as a grid of cells, row by row from the top left of the upright
/// marker. The marker's size is the edge of its square, which is centred on the grid and spans `square_cells`
/// cells; with AprilTag's 36h11 the square is black and 8 cells wide. Beyond the grid the paper is white.
struct MarkerPattern {
  int cells = 0;                    ///< cells per side of the grid
  double square_cells = 0;          ///< cells per side of the square whose corners are measured
  std::vector<std::uint8_t> white;  ///< cells x cells, 1 white, 0 black
};

/// A family of markers: AprilTag's names (`tag36h11`, ...), `tag36h11_border2` (Kalibr's AprilGrid: black
/// borders of two cells) and OpenCV's ArUco dictionaries (`DICT_4X4_50`, ...).
struct MarkerFamily {
  std::string name;
  std::vector<MarkerPattern> patterns;  ///< by id
  int distance = 0;  ///< cells by which any two differ at least in any rotation; 0: not known
};

/// All patterns of a family. Throws InputError naming the known families if the name is none of them.
[[nodiscard]] const MarkerFamily& marker_family(std::string_view name);
[[nodiscard]] const std::vector<std::string>& marker_family_names();

enum class MarkerStatus {
  ok,
  cut_by_frame,  ///< the frame's edge cuts the marker: its corners cannot be trusted
  mirrored,      ///< read only when mirrored: photographed through a mirror
  saturated,     ///< so much clips that no edge is left to measure
  too_small,     ///< fewer pixels per side than can be measured
  too_steep,     ///< seen at too flat an angle
  low_contrast,
  occluded,  ///< too few of the pattern's edges are where they should be
  misfit,  ///< its edges fit a flat square much worse than the others' of the photograph: bent, another thing
  inverted,     ///< read only as a negative: black and white are swapped
  duplicate,    ///< the same id was read twice in the photograph
  not_refined,  ///< the refinement did not converge
};

/// How a marker's corners were measured, best first.
enum class MarkerMethod {
  photometric,  ///< the whole pattern's model fitted to the pixels
  edges,        ///< the places of its edges alone: the photometric model does not hold in this picture
  quad,         ///< the outline that was found, its sides looked up once: too few edges for more
};

/// A marker seen in a photograph. Corners 0 top-left, 1 top-right, 2 bottom-right, 3 bottom-left of the
/// square as the marker is drawn upright, in sensor pixels (pixel (0, 0) is the centre of the top-left
/// pixel).
struct MarkerObservation {
  int id = -1;
  MarkerStatus status = MarkerStatus::not_refined;
  MarkerMethod method = MarkerMethod::quad;
  std::array<Eigen::Vector2d, 4> corners_px;
  /// Covariance in px^2 of (x0, y0, x1, y1, ..., y3), as large as the residuals of the method say.
  Eigen::Matrix<double, 8, 8> covariance_px2 = Eigen::Matrix<double, 8, 8>::Identity();
  double chi2_per_dof = 0;  ///< of the photometric fit
  double blur_px = 0;       ///< standard deviation of the fitted point spread
  double contrast = 0;      ///< white minus black over full scale, linear light
  double side_px = 0;       ///< mean length of the four sides
};

[[nodiscard]] const char* marker_status_name(MarkerStatus status);
[[nodiscard]] const char* marker_method_name(MarkerMethod method);

}  // namespace hexcal
