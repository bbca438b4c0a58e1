#include "kinematics/forward.h"

#include <Eigen/LU>
#include <cmath>

#include "kinematics/geometry/input_error.h"
#include "kinematics/inverse.h"
#include "kinematics/newton.h"
#include "kinematics/screw.h"

namespace hexcal {
namespace {

// Deuflhard's monotonicity test: a Newton step that is at most a quarter of the one before it leaves no doubt
// about which branch is followed.
constexpr double kLargestContraction = 0.25;
constexpr double kAnyContraction = 1e3;

NewtonOptions newton_options(const ForwardOptions& options, double largest_contraction) {
  return {options.tolerance_mm, options.max_iterations, largest_contraction};
}

// Legs with screws answer another equation; everything else is the same.
struct Solver {
  explicit Solver(const PlatformGeometry& g) : geometry(g), legs(g) {}

  [[nodiscard]] NewtonResult operator()(const LegVector& lengths_mm, const Rigid3& start,
                                        const NewtonOptions& options) const {
    return geometry.screw ? newton_with_screws(geometry, lengths_mm, start, options)
                          : newton(legs, lengths_mm, start, options);
  }
  [[nodiscard]] LegVector lengths(const Rigid3& B_from_P) const {
    return geometry.screw ? actuated_lengths(geometry, B_from_P) : leg_lengths(legs, B_from_P);
  }

  const PlatformGeometry& geometry;
  LegArray legs;
};

bool input_fault(const LegVector& lengths_mm, ForwardResult& result) {
  for (Eigen::Index i = 0; i < 6; ++i) {
    if (!std::isfinite(lengths_mm[i]) || lengths_mm[i] <= 0) {
      result.reason = "length of leg " + std::to_string(i + 1) + " is not a positive number";
      return true;
    }
  }
  return false;
}

void conclude(const Solver& solver, const LegVector& lengths_mm, const Rigid3& B_from_P,
              const ForwardOptions& options, ForwardResult& result) {
  result.residual_mm = (solver.lengths(B_from_P) - lengths_mm).cwiseAbs().maxCoeff();
  result.B_from_P = B_from_P;
  result.status = ForwardStatus::converged;
  if (!options.enforce_limits) return;
  const InverseResult verdict =
      inverse_kinematics(solver.geometry, RestState(solver.geometry), B_from_P, {.singularity = false});
  if (verdict.reachable()) return;
  result.status = ForwardStatus::left_workspace;
  result.reason = reason(verdict);
}

}  // namespace

const char* name(ForwardStatus status) {
  switch (status) {
    case ForwardStatus::failed:
      return "failed";
    case ForwardStatus::converged:
      return "converged";
    case ForwardStatus::left_workspace:
      return "left_workspace";
    case ForwardStatus::singular:
      return "singular";
  }
  return "failed";
}

void ForwardOptions::validate() const {
  if (!(tolerance_mm >= 0)) throw InputError("ForwardOptions.tolerance_mm must not be negative");
  if (max_iterations < 1) throw InputError("ForwardOptions.max_iterations must be at least 1");
  if (!(smallest_step > 0 && smallest_step < 1))
    throw InputError("ForwardOptions.smallest_step must lie in (0, 1)");
}

ForwardResult forward_kinematics(const PlatformGeometry& geometry, const LegVector& lengths_mm,
                                 const Rigid3& B_from_P_start, const ForwardOptions& options) {
  options.validate();
  ForwardResult result;
  if (input_fault(lengths_mm, result)) return result;
  const Solver solver(geometry);
  const NewtonResult solve = solver(lengths_mm, B_from_P_start, newton_options(options, kAnyContraction));
  result.iterations = solve.iterations;
  if (!solve.converged) {
    result.status = solve.singular ? ForwardStatus::singular : ForwardStatus::failed;
    result.reason = solve.singular ? "Newton's method meets a singular pose"
                                   : "Newton's method does not converge from this start";
    return result;
  }
  conclude(solver, lengths_mm, solve.B_from_P, options, result);
  return result;
}

ForwardResult forward_kinematics(const PlatformGeometry& geometry, const LegVector& lengths_mm,
                                 const ForwardOptions& options) {
  options.validate();
  ForwardResult result;
  if (input_fault(lengths_mm, result)) return result;
  const Solver solver(geometry);
  const Rigid3 home = geometry.home_B_from_P();
  const LegVector home_mm = solver.lengths(home);
  const NewtonOptions step_options = newton_options(options, kLargestContraction);
  Rigid3 at = home;
  double home_determinant = 0;
  double done = 0;
  double step = 1;
  while (done < 1) {
    const double next = std::min(1.0, done + step);
    const NewtonResult solve = solver(home_mm + next * (lengths_mm - home_mm), at, step_options);
    result.iterations += solve.iterations;
    if (home_determinant == 0) home_determinant = leg_jacobian(geometry, home).determinant();
    if (solve.converged && solve.determinant * home_determinant > 0) {
      at = solve.B_from_P;
      done = next;
      ++result.continuation_steps;
      if (solve.first_contraction < kLargestContraction / 2) step *= 2;
      continue;
    }
    step /= 2;
    if (step < options.smallest_step) {
      result.status = ForwardStatus::singular;
      result.reason =
          "the way from home meets a singularity after " + std::to_string(std::lround(100 * done)) + " %";
      return result;
    }
  }
  conclude(solver, lengths_mm, at, options, result);
  return result;
}

}  // namespace hexcal
