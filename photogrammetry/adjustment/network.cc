#include "photogrammetry/adjustment/network.h"

#include <array>

namespace hexcal {
namespace {

constexpr std::array<double, 4> kU{-1, 1, 1, -1};
constexpr std::array<double, 4> kV{1, 1, -1, -1};

Eigen::Vector3d square_displacement(int mode, double u, double v) {
  switch (mode) {
    case kSquareSize:
      return {u, v, 0};
    case kSquareAspect:
      return {u, -v, 0};
    case kSquareShear:
      return {v, u, 0};
    case kSquareTrapezoidX:
      return {u * v, 0, 0};
    case kSquareTrapezoidY:
      return {0, u * v, 0};
    default:
      return {0, 0, u * v};
  }
}

}  // namespace

int Network::add_square(int id, int body, double edge_mm) {
  const double half_mm = 0.5 * edge_mm;
  NetworkFeature feature;
  feature.id = id;
  feature.body = body;
  feature.drawn_mm.resize(3, 4);
  for (int c = 0; c < 4; ++c) {
    const auto i = static_cast<std::size_t>(c);
    feature.drawn_mm.col(c) << half_mm * kU[i], half_mm * kV[i], 0;
  }
  for (int mode = 0; mode < kSquareModes; ++mode) {
    ShapeMode shape{static_cast<int>(shapes.size()), DrawnPoints(3, 4)};
    for (int c = 0; c < 4; ++c) {
      const auto i = static_cast<std::size_t>(c);
      shape.displacement_mm.col(c) = half_mm * square_displacement(mode, kU[i], kV[i]);
    }
    feature.modes.push_back(std::move(shape));
    // The kinds' sigmas are of an edge's position in mm, but for the size, which is relative already.
    if (mode == kSquareSize) {
      shapes.push_back({ShapeKind::size, 1});
    } else {
      shapes.push_back({mode == kSquareTwist ? ShapeKind::flatness : ShapeKind::squareness, 1 / half_mm});
    }
  }
  features.push_back(std::move(feature));
  return static_cast<int>(features.size()) - 1;
}

int Network::add_point(int id, int body) {
  NetworkFeature feature;
  feature.id = id;
  feature.body = body;
  feature.drawn_mm = DrawnPoints::Zero(3, 1);
  features.push_back(std::move(feature));
  return static_cast<int>(features.size()) - 1;
}

double square_edge_mm(const NetworkFeature& feature) {
  return feature.points() == 4 ? (feature.drawn_mm.col(1) - feature.drawn_mm.col(0)).norm() : 0.0;
}

Observation observation_of(const MarkerObservation& marker) {
  Observation observation;
  observation.id = marker.id;
  observation.measured = marker.status == MarkerStatus::ok;
  observation.px.resize(8);
  for (int c = 0; c < 4; ++c)
    observation.px.segment<2>(2 * c) = marker.corners_px[static_cast<std::size_t>(c)];
  observation.covariance_px2 = marker.covariance_px2;
  return observation;
}

DrawnPoints printed_points(const NetworkFeature& feature, const NetworkGeometry& geometry) {
  DrawnPoints points = feature.drawn_mm;
  for (const ShapeMode& mode : feature.modes) {
    const double value = geometry.shape[mode.parameter];
    if (value != 0) points += value * mode.displacement_mm;
  }
  if (feature.print_scaled) points *= 1 + geometry.print_scale;
  return points;
}

DrawnPoints feature_points_in_body(const Network& network, const NetworkGeometry& geometry, int feature) {
  const auto f = static_cast<std::size_t>(feature);
  const Rigid3& body_from_feature = geometry.body_from_feature[f];
  DrawnPoints points = body_from_feature.rotation_matrix() * printed_points(network.features[f], geometry);
  points.colwise() += body_from_feature.translation;
  return points;
}

}  // namespace hexcal
