#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "photogrammetry/markers/marker.h"
#include "photogrammetry/photograph/photograph.h"

namespace hexcal {

/// A feature of a sheet measured in a photograph: the four corners of a marker (in the order of
/// MarkerObservation), a chessboard's inner corner or a dot.
struct FeatureObservation {
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 8, 1>;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 8, 8>;

  int sheet = 0;        ///< which of the sheets
  int first_point = 0;  ///< of sheet_points(): 4 points for a marker, else 1
  MarkerStatus status = MarkerStatus::ok;
  Vector px;                ///< (x0, y0, x1, y1, ...)
  Matrix covariance_px2;    ///< of px
  double blur_px = 0;       ///< standard deviation of the point spread, 0 unknown
  double chi2_per_dof = 0;  ///< of the photometric fit

  [[nodiscard]] int points() const { return static_cast<int>(px.size()) / 2; }
};

/// A marker as it was read: its id and where its four corners lie, whatever became of its measurement.
struct MarkerRead {
  std::string family;
  int id = -1;
  std::array<Eigen::Vector2d, 4> corners_px;
};

/// A photograph of sheets without its pixels.
struct SheetPhotograph {
  std::string name;
  std::string sha256;
  PhotographStatus status = PhotographStatus::unreadable;
  std::string reason;  ///< why status is not ok, or why no sheet was found
  PhotographInfo info;
  std::vector<FeatureObservation> features;
  std::vector<MarkerRead> markers;  ///< all that were read of the sheets' families
};

}  // namespace hexcal
