#include "photogrammetry/adjustment/bundle_solver.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace hexcal {
namespace {

constexpr double kFirstDamping = 1e-6;
constexpr double kLastDamping = 1e8;
constexpr double kBehindCamera = 1e6;  // cost of a sighting that does not project

double robust_cost(double q, double limit2) { return limit2 > 0 ? limit2 * q / (limit2 + q) : q; }
double robust_weight(double q, double limit2) {
  return limit2 > 0 ? std::pow(limit2 / (limit2 + q), 2) : 1.0;
}

// Cost of a geometry; also the squares per sighting.
double total_cost(const Network& network, const NetworkGeometry& geometry,
                  const std::vector<Sighting>& sightings, const BundleLayout& layout,
                  const BundleSettings& settings, double robust_limit, std::vector<double>& squares) {
  squares.assign(sightings.size(), -1);
  double sum = 0;
  const double limit2 = robust_limit * robust_limit;
  Vector8d r;
  for (std::size_t s = 0; s < sightings.size(); ++s) {
    if (sightings[s].status != SightingStatus::used) continue;
    squares[s] = sighting_residual(network, geometry, sightings[s], r, nullptr)
                     ? r.squaredNorm() / settings.data_variance
                     : kBehindCamera;
    sum += robust_cost(squares[s], limit2);
  }
  return sum + prior_cost(network, geometry, layout, settings, nullptr);
}

// Columns with basis * basis^T = covariance, from the scaled eigenvectors; drops what is not estimated.
void interior_layout(const NetworkCamera& camera, BundleLayout& layout) {
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
      if (eigen.eigenvalues()[i] > 1e-10) kept.push_back(i);
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

}  // namespace

BundleLayout make_bundle_layout(const Network& network, const NetworkGeometry& geometry,
                                const std::vector<Sighting>& sightings, bool free_shape, bool free_scale) {
  BundleLayout layout;
  for (const NetworkCamera& camera : network.cameras) interior_layout(camera, layout);
  layout.num_interior = layout.size;
  if (free_scale) layout.print_scale = layout.size++;
  std::vector<int> views(network.markers.size(), 0);
  for (const Sighting& sighting : sightings) {
    if (sighting.status == SightingStatus::used) ++views[static_cast<std::size_t>(sighting.marker)];
  }
  layout.marker_pose.assign(network.markers.size(), -1);
  layout.marker_shape.assign(network.markers.size(), -1);
  for (const Body body : {Body::fixed, Body::moving}) {
    int holder = -1;
    for (std::size_t m = 0; m < network.markers.size(); ++m) {
      if (network.markers[m].body != body || views[m] == 0) continue;
      if (holder < 0 || views[m] > views[static_cast<std::size_t>(holder)]) holder = static_cast<int>(m);
    }
    for (std::size_t m = 0; m < network.markers.size(); ++m) {
      if (network.markers[m].body != body || views[m] == 0 || !geometry.has_marker[m]) continue;
      if (static_cast<int>(m) != holder) {
        layout.marker_pose[m] = layout.size;
        layout.size += 6;
      }
      if (free_shape) {
        layout.marker_shape[m] = layout.size;
        layout.size += 6;
      }
    }
  }
  return layout;
}

BundleSolution solve_bundle_adjustment(const Network& network, const NetworkGeometry& start,
                                       const std::vector<Sighting>& sightings, const BundleLayout& layout,
                                       const BundleSettings& settings, double robust_limit,
                                       int max_iterations) {
  BundleSolution solution;
  solution.geometry = start;
  const double limit2 = robust_limit * robust_limit;
  double cost = total_cost(network, start, sightings, layout, settings, robust_limit, solution.squares);
  double damping = 0;
  std::vector<double> weights(sightings.size(), 0);
  while (solution.iterations < max_iterations && !solution.converged) {
    ++solution.iterations;
    for (std::size_t s = 0; s < sightings.size(); ++s) {
      weights[s] = solution.squares[s] < 0 ? 0.0 : robust_weight(solution.squares[s], limit2);
    }
    BundleSystem system =
        assemble_bundle(network, solution.geometry, sightings, weights, layout, settings, damping);
    const BundleStep step = solve_bundle(system, layout, settings, network.photos.size());
    const NetworkGeometry next = stepped(solution.geometry, layout, step);
    std::vector<double> squares;
    const double next_cost = total_cost(network, next, sightings, layout, settings, robust_limit, squares);
    if (!(next_cost <= cost * (1 + 1e-12) + settings.converged)) {
      damping = damping == 0 ? kFirstDamping : damping * 10;
      if (damping > kLastDamping) break;
      continue;
    }
    solution.converged = step.predicted_decrease < settings.converged + 1e-13 * cost;
    if (solution.converged && damping == 0 && robust_limit == 0) solution.system = std::move(system);
    damping = damping <= kFirstDamping ? 0 : damping / 10;
    solution.geometry = next;
    solution.squares = std::move(squares);
    cost = next_cost;
  }
  return solution;
}

}  // namespace hexcal
