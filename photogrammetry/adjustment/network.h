#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "kinematics/geometry/rigid3.h"
#include "photogrammetry/camera/camera_model.h"
#include "photogrammetry/markers/marker.h"

// What an adjustment is given: cameras, bodies with features, photographs of them from stations at epochs.

namespace hexcal {

/// Bodies are numbered. World coordinates are those of the reference body, which never moves; every other has
/// a pose in each epoch.
inline constexpr int kReferenceBody = 0;
inline constexpr int kMovingBody = 1;  ///< of campaigns with one

/// Points of one feature; larger things are several features of one body.
inline constexpr int kMaxFeaturePoints = 4;
using DrawnPoints = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxFeaturePoints>;

/// A camera with the covariance of its parameters as its calibration left them (0 x 0: exactly known).
struct NetworkCamera {
  CameraModel model;
  Eigen::MatrixXd covariance;
};

/// What the prior of a shape parameter stands for: a sigma of its own, or one that is common to all of a kind
/// and fitted to the photographs (AdjustmentOptions).
enum class ShapeKind { stated, size, squareness, flatness };

/// A number by which features differ from their drawing. Features may share one, as those of a bent sheet do.
struct ShapeParameter {
  ShapeKind kind = ShapeKind::stated;
  double sigma = 0;  ///< of the parameter, or factor on the sigma of its kind
};

/// How a parameter moves the points of a feature.
struct ShapeMode {
  int parameter = 0;            ///< index into Network::shapes
  DrawnPoints displacement_mm;  ///< on the drawing, per unit of the parameter
};

/// Points that were printed together, drawn in a frame of their own. A point is
///   body_from_feature * (1 + print scale) * (drawn + sum of parameter * displacement):
/// what leaves the drawing is relative to the print, because a camera sees shape and not size: a prior in mm
/// of the world could be paid less by shrinking the world.
struct NetworkFeature {
  int id = -1;
  int body = kReferenceBody;
  DrawnPoints drawn_mm;                     ///< one column, or three and more that are not on a line
  std::vector<ShapeMode> modes;             ///< parameters ascending
  bool print_scaled = true;                 ///< false: the print scale is not its
  std::optional<Rigid3> body_from_feature;  ///< given: known; otherwise estimated

  [[nodiscard]] int points() const { return static_cast<int>(drawn_mm.cols()); }
};

/// A feature measured in a photograph, by whatever detector.
struct Observation {
  int id = -1;
  bool measured = true;  ///< false: seen, but its numbers are not to be used
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 2 * kMaxFeaturePoints, 1> px;  ///< x0, y0, x1, y1, ...
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 2 * kMaxFeaturePoints, 2 * kMaxFeaturePoints>
      covariance_px2;
};

/// Where several photographs were taken from, as by a camera on a fixed mount.
struct NetworkStation {
  std::optional<Rigid3> camera_from_reference;  ///< given: known; otherwise estimated
};

/// What one photograph shows. An epoch is a time at which all bodies stood still: a pose.
struct NetworkPhoto {
  int camera = 0;    ///< index into Network::cameras
  int epoch = 0;     ///< 0 to Network::num_epochs - 1
  int station = -1;  ///< index into Network::stations; -1: a station of its own
  std::vector<Observation> observations;
};

/// A known distance between two points of features of one body, by index (point -1: mean of the feature's).
struct NetworkLength {
  int feature_a = 0, point_a = -1;
  int feature_b = 0, point_b = -1;
  double length_mm = 0;
  double sigma_mm = 0;
};

struct Network {
  std::vector<NetworkCamera> cameras;
  std::vector<NetworkFeature> features;
  std::vector<ShapeParameter> shapes;
  std::vector<NetworkStation> stations;
  std::vector<NetworkPhoto> photos;
  int num_epochs = 0;
  int num_bodies = 2;
  std::vector<NetworkLength> lengths;  ///< used only where the print scale is estimated

  /// Adds a square of this edge with the six modes below and returns its index.
  int add_square(int id, int body, double edge_mm);
  /// Adds a single point and returns its index.
  int add_point(int id, int body);
};

/// The six ways in which a printed square may differ from its drawing: displacements of the corner at (u, v)
/// in {-1, 1}^2 (x to the right, y up, z towards the viewer), in halves of the edge:
///   size (u, v, 0), aspect (u, -v, 0), shear (v, u, 0), trapezoids (uv, 0, 0) and (0, uv, 0), twist (0, 0,
///   uv).
/// With a rigid motion they span all twelve coordinates, so that freeing them frees the corners.
enum SquareMode : int {
  kSquareSize,
  kSquareAspect,
  kSquareShear,
  kSquareTrapezoidX,
  kSquareTrapezoidY,
  kSquareTwist,
  kSquareModes
};

/// Edge of a feature of four points that is a square; 0 for other features.
[[nodiscard]] double square_edge_mm(const NetworkFeature& feature);

[[nodiscard]] Observation observation_of(const MarkerObservation& marker);

/// Estimated geometry; index by index that of the Network. Only entries with `has_` set mean anything.
struct NetworkGeometry {
  std::vector<CameraModel> cameras;
  std::vector<Rigid3> camera_from_reference;             ///< per photo; the same for those of one station
  std::vector<std::vector<Rigid3>> reference_from_body;  ///< per body and epoch; of the reference body empty
  std::vector<Rigid3> body_from_feature;
  Eigen::VectorXd shape;   ///< per shape parameter
  double print_scale = 0;  ///< printed lengths are (1 + print_scale) times their stated ones
  std::vector<char> has_photo, has_feature;
  std::vector<std::vector<char>> has_pose;  ///< per body and epoch; of the reference body empty

  /// The body stood somewhere known in the epoch; always true of the reference body.
  [[nodiscard]] bool has_body(int body, int epoch) const {
    return body == kReferenceBody ||
           has_pose[static_cast<std::size_t>(body)][static_cast<std::size_t>(epoch)];
  }
};

/// Points of a feature in its own frame and in its body's, mm.
[[nodiscard]] DrawnPoints printed_points(const NetworkFeature& feature, const NetworkGeometry& geometry);
[[nodiscard]] DrawnPoints feature_points_in_body(const Network& network, const NetworkGeometry& geometry,
                                                 int feature);

}  // namespace hexcal
