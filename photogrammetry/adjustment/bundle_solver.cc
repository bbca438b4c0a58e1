#include "photogrammetry/adjustment/bundle_solver.h"

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
    squares[s] = whitened_residual(network, geometry, sightings[s], r, nullptr)
                     ? r.squaredNorm() / settings.data_variance
                     : kBehindCamera;
    sum += robust_cost(squares[s], limit2);
  }
  return sum + prior_cost(network, geometry, layout, settings);
}

}  // namespace

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
    const BundleStep step = solve_bundle(network, system, layout, settings);
    const NetworkGeometry next = stepped(network, solution.geometry, layout, step);
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
