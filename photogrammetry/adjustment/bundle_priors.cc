#include "photogrammetry/adjustment/bundle_priors.h"

#include <algorithm>
#include <cmath>

namespace hexcal {
namespace {

// Distance between two points and its derivatives.
double length_between(const Network& network, const NetworkGeometry& geometry, const BundleLayout& layout,
                      const NetworkLength& length, Eigen::RowVectorXd* by_common) {
  Eigen::Matrix3Xd ja;
  Eigen::Matrix3Xd jb;
  const bool derive = by_common != nullptr;
  const Eigen::Vector3d d =
      feature_point(network, geometry, layout, length.feature_b, length.point_b, derive ? &jb : nullptr) -
      feature_point(network, geometry, layout, length.feature_a, length.point_a, derive ? &ja : nullptr);
  const double distance = d.norm();
  if (derive) {
    const Eigen::RowVector3d along = (d / distance).transpose();
    by_common->setZero(layout.size);
    const auto scatter = [&](int feature, const Eigen::RowVectorXd& row) {
      const std::vector<int> columns = feature_columns(network, layout, feature);
      for (std::size_t i = 0; i < columns.size(); ++i)
        (*by_common)[columns[i]] += row[static_cast<Eigen::Index>(i)];
    };
    scatter(length.feature_b, along * jb);
    scatter(length.feature_a, -along * ja);
  }
  return distance;
}

bool length_is_used(const NetworkGeometry& geometry, const NetworkLength& length) {
  return geometry.has_feature[static_cast<std::size_t>(length.feature_a)] &&
         geometry.has_feature[static_cast<std::size_t>(length.feature_b)];
}

}  // namespace

double BundleSettings::shape_sigma(const ShapeParameter& shape) const {
  switch (shape.kind) {
    case ShapeKind::size:
      return size_sigma * shape.sigma;
    case ShapeKind::squareness:
      return squareness_sigma_mm * shape.sigma;
    case ShapeKind::flatness:
      return flatness_sigma_mm * shape.sigma;
    case ShapeKind::stated:
      break;
  }
  return shape.sigma;
}

void add_priors(const Network& network, const NetworkGeometry& geometry, const BundleLayout& layout,
                const BundleSettings& settings, Eigen::MatrixXd& normal, Eigen::VectorXd& right) {
  const auto add = [&](int i, double value, double sigma) {
    normal(i, i) += 1 / (sigma * sigma);
    right[i] -= value / (sigma * sigma);
  };
  const Eigen::VectorXd z = interior_coordinates(geometry, layout);
  for (std::size_t c = 0; c < layout.interior.size(); ++c) {
    for (int i = layout.interior[c]; i < layout.interior[c] + layout.interior_basis[c].cols(); ++i)
      add(i, z[i], settings.interior_inflation[c]);
  }
  if (layout.print_scale >= 0 && settings.print_scale_sigma > 0)
    add(layout.print_scale, geometry.print_scale, settings.print_scale_sigma);
  for (std::size_t k = 0; k < layout.shape.size(); ++k) {
    if (layout.shape[k] < 0) continue;
    add(layout.shape[k], geometry.shape[static_cast<Eigen::Index>(k)],
        settings.shape_sigma(network.shapes[k]));
  }
  if (layout.print_scale < 0) return;
  for (const NetworkLength& length : network.lengths) {
    if (!length_is_used(geometry, length)) continue;
    Eigen::RowVectorXd row;
    const double distance = length_between(network, geometry, layout, length, &row);
    const double sigma_mm = length.sigma_mm * settings.length_inflation;
    normal.noalias() += row.transpose() * row / (sigma_mm * sigma_mm);
    right += row.transpose() * (length.length_mm - distance) / (sigma_mm * sigma_mm);
  }
}

double prior_cost(const Network& network, const NetworkGeometry& geometry, const BundleLayout& layout,
                  const BundleSettings& settings) {
  double cost = 0;
  const Eigen::VectorXd z = interior_coordinates(geometry, layout);
  for (std::size_t c = 0; c < layout.interior.size() && settings.interior_moves; ++c) {
    const auto rank = layout.interior_basis[c].cols();
    if (rank > 0)
      cost += (z.segment(layout.interior[c], rank) / settings.interior_inflation[c]).squaredNorm();
  }
  if (layout.print_scale >= 0 && settings.print_scale_sigma > 0)
    cost += std::pow(geometry.print_scale / settings.print_scale_sigma, 2);
  for (std::size_t k = 0; k < layout.shape.size(); ++k) {
    if (layout.shape[k] < 0) continue;
    cost +=
        std::pow(geometry.shape[static_cast<Eigen::Index>(k)] / settings.shape_sigma(network.shapes[k]), 2);
  }
  for (const NetworkLength& length : network.lengths) {
    if (layout.print_scale < 0 || !length_is_used(geometry, length)) continue;
    const double distance = length_between(network, geometry, layout, length, nullptr);
    cost += std::pow((length.length_mm - distance) / (length.sigma_mm * settings.length_inflation), 2);
  }
  return cost;
}

bool has_known_length(const Network& network, const NetworkGeometry& geometry) {
  return std::any_of(network.lengths.begin(), network.lengths.end(),
                     [&](const NetworkLength& length) { return length_is_used(geometry, length); });
}

LengthCheck check_lengths(const Network& network, const NetworkGeometry& geometry, const BundleLayout& layout,
                          const BundleSettings& settings, const Eigen::MatrixXd& covariance) {
  LengthCheck check;
  if (layout.print_scale < 0) return check;
  for (const NetworkLength& length : network.lengths) {
    if (!length_is_used(geometry, length)) continue;
    Eigen::RowVectorXd row;
    const double distance = length_between(network, geometry, layout, length, &row);
    check.squares += std::pow((length.length_mm - distance) / length.sigma_mm, 2);
    const double sigma_mm = length.sigma_mm * settings.length_inflation;
    check.redundancy += 1 - (row * covariance * row.transpose())(0) / (sigma_mm * sigma_mm);
  }
  return check;
}

}  // namespace hexcal
