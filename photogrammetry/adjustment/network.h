#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "kinematics/geometry/rigid3.h"
#include "photogrammetry/camera/camera_model.h"
#include "photogrammetry/markers/marker.h"

namespace hexcal {

/// The two rigid bodies of a campaign. World coordinates are the fixed body's.
enum class Body { fixed, moving };

/// A camera with the covariance of its parameters as its calibration left them (0 x 0: exactly known).
struct NetworkCamera {
  CameraModel model;
  Eigen::MatrixXd covariance;
};

struct NetworkMarker {
  int id = -1;
  Body body = Body::fixed;
  double size_mm = 0;  ///< edge of the square
};

/// What one photograph shows. An epoch is a time at which the moving body stood still: a pose.
struct NetworkPhoto {
  int camera = 0;  ///< index into Network::cameras
  int epoch = 0;   ///< 0 to Network::num_epochs - 1
  std::vector<MarkerObservation> markers;
};

/// A known distance between two corners (corner -1: centre) of markers of one body, by index.
struct NetworkLength {
  int marker_a = 0, corner_a = -1;
  int marker_b = 0, corner_b = -1;
  double length_mm = 0;
  double sigma_mm = 0;
};

/// Everything the adjustment is given.
struct Network {
  std::vector<NetworkCamera> cameras;
  std::vector<NetworkMarker> markers;
  std::vector<NetworkPhoto> photos;
  int num_epochs = 0;
  std::vector<NetworkLength> lengths;  ///< scale bars; used only when the print scale is unknown
};

/// The six ways in which a printed square of edge s may differ from a flat square, as displacement in mm of
/// the corner at (u, v) in {-1, 1}^2 (x = u s/2, y = v s/2, z towards the viewer):
///   stretch (u, 0, 0) and (0, v, 0), shear (v, u, 0), trapezoids (uv, 0, 0) and (0, uv, 0), twist (0, 0,
///   uv).
/// With a rigid motion they span all twelve coordinates, so that freeing them frees the corners.
using SquareShape = Eigen::Matrix<double, 6, 1>;

/// Estimated geometry; index by index that of the Network. Only entries with `has_` set mean anything.
struct NetworkGeometry {
  std::vector<CameraModel> cameras;
  std::vector<Rigid3> camera_from_fixed;  ///< per photo
  std::vector<Rigid3> fixed_from_moving;  ///< per epoch
  std::vector<Rigid3> body_from_marker;   ///< per marker
  std::vector<SquareShape> shape_mm;      ///< per marker
  double print_scale = 0;                 ///< printed edges are (1 + print_scale) times their stated size
  std::vector<char> has_photo, has_epoch, has_marker;
};

/// Corners 0..3 of a marker in its body's frame, mm.
[[nodiscard]] Eigen::Matrix<double, 3, 4> marker_corners_in_body(const Network& network,
                                                                 const NetworkGeometry& geometry, int marker);

}  // namespace hexcal
