#include "photogrammetry/adjustment/bundle_layout.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace hexcal {
namespace {

constexpr double kLeastEigenvalue = 1e-10;  // of a correlation matrix: below, not estimated

// Columns with basis * basis^T = covariance, from the eigenvectors of the correlations; drops what is not
// estimated.
void add_interior(const NetworkCamera& camera, BundleLayout& layout) {
  const auto n = camera.model.parameters.size();
  Eigen::MatrixXd basis(n, 0);
  Eigen::MatrixXd inverse(0, n);
  if (camera.covariance.rows() == n) {
    const Eigen::VectorXd sigma = camera.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    const Eigen::VectorXd per_sigma =
        sigma.unaryExpr([](double value) { return value > 0 ? 1 / value : 0.0; });
    const Eigen::MatrixXd correlation = per_sigma.asDiagonal() * camera.covariance * per_sigma.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(correlation);
    std::vector<Eigen::Index> kept;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (eigen.eigenvalues()[i] > kLeastEigenvalue) kept.push_back(i);
    }
    basis.resize(n, static_cast<Eigen::Index>(kept.size()));
    inverse.resize(static_cast<Eigen::Index>(kept.size()), n);
    for (std::size_t k = 0; k < kept.size(); ++k) {
      const double root = std::sqrt(eigen.eigenvalues()[kept[k]]);
      const Eigen::VectorXd axis = eigen.eigenvectors().col(kept[k]);
      basis.col(static_cast<Eigen::Index>(k)) = sigma.asDiagonal() * axis * root;
      inverse.row(static_cast<Eigen::Index>(k)) = (per_sigma.asDiagonal() * axis / root).transpose();
    }
  }
  layout.interior.push_back(layout.size);
  layout.size += static_cast<int>(basis.cols());
  layout.interior_start.emplace_back(camera.model.parameters);
  layout.interior_basis.push_back(std::move(basis));
  layout.interior_inverse.push_back(std::move(inverse));
}

// The feature that holds the frame of a body: the best seen of those whose pose has six columns; -1 where the
// drawing holds it.
int frame_holder(const Network& network, int body, const std::vector<int>& views) {
  int holder = -1;
  for (std::size_t f = 0; f < network.features.size(); ++f) {
    const NetworkFeature& feature = network.features[f];
    if (feature.body != body) continue;
    if (feature.body_from_feature) return -1;
    if (views[f] == 0 || feature.points() < 3) continue;
    if (holder < 0 || views[f] > views[static_cast<std::size_t>(holder)]) holder = static_cast<int>(f);
  }
  return holder;
}

int feature_columns_count(const NetworkFeature& feature, const BundleLayout& layout, std::size_t f) {
  int count = (feature.print_scaled && layout.print_scale >= 0 ? 1 : 0) +
              (layout.feature_pose[f] >= 0 ? pose_columns(feature) : 0);
  for (std::size_t k = 0; layout.free_shape && k < feature.modes.size(); ++k)
    count += layout.shape[static_cast<std::size_t>(feature.modes[k].parameter)] >= 0 ? 1 : 0;
  return count;
}

}  // namespace

BundleLayout make_bundle_layout(const Network& network, const NetworkGeometry& geometry,
                                const std::vector<Sighting>& sightings, bool free_shape, bool free_scale) {
  BundleLayout layout;
  for (const NetworkCamera& camera : network.cameras) add_interior(camera, layout);
  layout.num_interior = layout.size;
  if (free_scale) layout.print_scale = layout.size++;
  std::vector<int> views(network.features.size(), 0);
  std::vector<char> station_used(network.stations.size(), 0);
  bool world_is_held = false;  // by a known station that sees the reference body
  for (const Sighting& sighting : sightings) {
    if (sighting.status != SightingStatus::used) continue;
    ++views[static_cast<std::size_t>(sighting.feature)];
    const int station = network.photos[static_cast<std::size_t>(sighting.photo)].station;
    if (station < 0) continue;
    station_used[static_cast<std::size_t>(station)] = 1;
    world_is_held |= network.stations[static_cast<std::size_t>(station)].camera_from_reference &&
                     network.features[static_cast<std::size_t>(sighting.feature)].body == kReferenceBody;
  }
  const auto add = [&](int columns) {
    layout.size += columns;
    return layout.size - columns;
  };
  layout.station.assign(network.stations.size(), -1);
  for (std::size_t s = 0; s < network.stations.size(); ++s) {
    if (station_used[s] && !network.stations[s].camera_from_reference) layout.station[s] = add(6);
  }
  std::vector<int> holder;
  for (int body = 0; body < network.num_bodies; ++body)
    holder.push_back(body == kReferenceBody && world_is_held ? -1 : frame_holder(network, body, views));
  layout.feature_pose.assign(network.features.size(), -1);
  layout.shape.assign(network.shapes.size(), -1);
  std::vector<char> shaped(network.shapes.size(), 0);
  for (std::size_t f = 0; f < network.features.size(); ++f) {
    const NetworkFeature& feature = network.features[f];
    if (views[f] == 0 || !geometry.has_feature[f]) continue;
    if (!feature.body_from_feature && static_cast<int>(f) != holder[static_cast<std::size_t>(feature.body)]) {
      layout.feature_pose[f] = add(pose_columns(feature));
    }
    for (const ShapeMode& mode : feature.modes) shaped[static_cast<std::size_t>(mode.parameter)] = 1;
  }
  for (std::size_t k = 0; free_shape && k < shaped.size(); ++k) {
    if (!shaped[k]) continue;
    layout.shape[k] = add(1);
    layout.free_shape = true;
  }
  return layout;
}

BundleLayout without_columns(const BundleLayout& full) {
  BundleLayout layout;
  for (const Eigen::MatrixXd& basis : full.interior_basis) {
    layout.interior.push_back(0);
    layout.interior_basis.emplace_back(basis.rows(), 0);
    layout.interior_inverse.emplace_back(0, basis.rows());
  }
  layout.interior_start = full.interior_start;
  layout.station.assign(full.station.size(), -1);
  layout.feature_pose.assign(full.feature_pose.size(), -1);
  layout.shape.assign(full.shape.size(), -1);
  return layout;
}

Eigen::VectorXd interior_coordinates(const NetworkGeometry& geometry, const BundleLayout& layout) {
  Eigen::VectorXd z(layout.num_interior);
  for (std::size_t c = 0; c < layout.interior.size(); ++c) {
    const Eigen::MatrixXd& basis = layout.interior_basis[c];
    if (basis.cols() == 0) continue;
    const Eigen::VectorXd moved = Eigen::VectorXd(geometry.cameras[c].parameters) - layout.interior_start[c];
    z.segment(layout.interior[c], basis.cols()) = layout.interior_inverse[c] * moved;
  }
  return z;
}

std::vector<int> feature_columns(const Network& network, const BundleLayout& layout, int feature) {
  const NetworkFeature& of = network.features[static_cast<std::size_t>(feature)];
  std::vector<int> columns;
  const auto add = [&](int first, int count) {
    for (int i = 0; first >= 0 && i < count; ++i) columns.push_back(first + i);
  };
  if (of.print_scaled) add(layout.print_scale, 1);
  add(layout.feature_pose[static_cast<std::size_t>(feature)], pose_columns(of));
  for (const ShapeMode& mode : of.modes) add(layout.shape[static_cast<std::size_t>(mode.parameter)], 1);
  return columns;
}

Eigen::Vector3d feature_point(const Network& network, const NetworkGeometry& geometry,
                              const BundleLayout& layout, int feature, int point,
                              Eigen::Matrix3Xd* by_columns) {
  const auto f = static_cast<std::size_t>(feature);
  const NetworkFeature& of = network.features[f];
  const DrawnPoints printed = printed_points(of, geometry);
  const int first = point < 0 ? 0 : point;
  const int count = point < 0 ? of.points() : 1;
  const Eigen::Matrix3d rotation = geometry.body_from_feature[f].rotation_matrix();
  const Eigen::Vector3d turned = rotation * printed.middleCols(first, count).rowwise().mean();
  if (by_columns != nullptr) {
    const double scale = of.print_scaled ? 1 + geometry.print_scale : 1.0;
    by_columns->setZero(3, feature_columns_count(of, layout, f));
    Eigen::Index at = 0;
    if (of.print_scaled && layout.print_scale >= 0) by_columns->col(at++) = turned / scale;
    if (layout.feature_pose[f] >= 0) {
      by_columns->middleCols<3>(at) = Eigen::Matrix3d::Identity();
      if (pose_columns(of) == 6) by_columns->middleCols<3>(at + 3) = -skew(turned);
      at += pose_columns(of);
    }
    for (const ShapeMode& mode : of.modes) {
      if (layout.shape[static_cast<std::size_t>(mode.parameter)] < 0) continue;
      by_columns->col(at++) =
          scale * rotation * mode.displacement_mm.middleCols(first, count).rowwise().mean();
    }
  }
  return turned + geometry.body_from_feature[f].translation;
}

void common_jacobian(const Network& network, const BundleLayout& layout, const Sighting& sighting,
                     const FeatureJacobian& jacobian, CommonJacobian& out) {
  const NetworkPhoto& photo = network.photos[static_cast<std::size_t>(sighting.photo)];
  const auto c = static_cast<std::size_t>(photo.camera);
  const auto f = static_cast<std::size_t>(sighting.feature);
  const NetworkFeature& feature = network.features[f];
  const bool with_station =
      photo.station >= 0 && layout.station[static_cast<std::size_t>(photo.station)] >= 0;
  Eigen::Index n = layout.interior_basis[c].cols() + (with_station ? 6 : 0);
  n += static_cast<Eigen::Index>(feature_columns_count(feature, layout, f));
  out.values.resize(8, n);
  n = 0;
  const auto add = [&](int first, const auto& columns) {
    out.values.middleCols(n, columns.cols()) = columns;
    for (int i = 0; i < columns.cols(); ++i) out.column[static_cast<std::size_t>(n++)] = first + i;
  };
  if (layout.interior_basis[c].cols() > 0) {
    add(layout.interior[c], (jacobian.interior * layout.interior_basis[c]).eval());
  }
  if (layout.print_scale >= 0 && feature.print_scaled) add(layout.print_scale, jacobian.print_scale);
  if (with_station) add(layout.station[static_cast<std::size_t>(photo.station)], jacobian.station);
  if (layout.feature_pose[f] >= 0) {
    add(layout.feature_pose[f], jacobian.feature.leftCols(pose_columns(feature)));
  }
  for (std::size_t k = 0; layout.free_shape && k < feature.modes.size(); ++k) {
    const int column = layout.shape[static_cast<std::size_t>(feature.modes[k].parameter)];
    if (column >= 0) add(column, jacobian.shape.col(static_cast<Eigen::Index>(k)));
  }
}

}  // namespace hexcal
