#include "kinematics/forward.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

#include "kinematics/geometry/covariance.h"
#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

// Rotations are weighed against translations by the characteristic length.
double step_size_mm(const Vector6d& delta, double length_mm) {
  return std::sqrt(delta.head<3>().squaredNorm() + delta.tail<3>().squaredNorm() * length_mm * length_mm);
}

struct NewtonResult {
  bool converged = false;
  bool singular = false;
  Rigid3 B_from_P;
  int iterations = 0;
  double first_contraction = 0;  // second step over first step
};

// Newton's method; gives up once a step is longer than `largest_contraction` times the one before it.
NewtonResult newton(const PlatformGeometry& geometry, const LegVector& lengths_mm, const Rigid3& start,
                    const ForwardOptions& options, double largest_contraction) {
  NewtonResult result;
  result.B_from_P = start;
  const double unit_mm = characteristic_length_mm(geometry);
  const double rounding_mm = 1e-15 * (lengths_mm.cwiseAbs().maxCoeff() + start.translation.norm());
  double last_mm = 0;
  for (int i = 0; i < options.max_iterations; ++i) {
    const Matrix6d j = leg_jacobian(geometry, result.B_from_P);
    const Eigen::PartialPivLU<Matrix6d> lu(j);
    const Vector6d delta = lu.solve(lengths_mm - leg_lengths(geometry, result.B_from_P));
    if (!delta.allFinite()) {
      result.singular = true;
      return result;
    }
    const double step_mm = step_size_mm(delta, unit_mm);
    const double contraction = i == 0 ? 0 : step_mm / last_mm;
    if (i == 1) result.first_contraction = contraction;
    result.iterations = i + 1;
    // A step at the level of rounding need not be shorter than the one before it.
    const bool at_rounding = i > 0 && step_mm <= 1e4 * rounding_mm;
    if (i > 0 && contraction > largest_contraction && !at_rounding) return result;
    result.B_from_P = perturbed(result.B_from_P, delta);
    last_mm = step_mm;
    // Quadratic convergence: the next step is about contraction * step.
    if (step_mm <= std::max(options.tolerance_mm, rounding_mm) ||
        (i > 0 && contraction * contraction * step_mm <= options.tolerance_mm) || at_rounding) {
      result.converged = true;
      return result;
    }
  }
  return result;
}

bool input_fault(const LegVector& lengths_mm, ForwardResult& result) {
  for (Eigen::Index i = 0; i < 6; ++i) {
    if (!std::isfinite(lengths_mm[i]) || lengths_mm[i] <= 0) {
      result.reason = "length of leg " + std::to_string(i + 1) + " is not a positive number";
      return true;
    }
  }
  return false;
}

void conclude(const PlatformGeometry& geometry, const LegVector& lengths_mm, const Rigid3& B_from_P,
              const ForwardOptions& options, ForwardResult& result) {
  result.residual_mm = (leg_lengths(geometry, B_from_P) - lengths_mm).cwiseAbs().maxCoeff();
  result.B_from_P = B_from_P;
  result.status = ForwardStatus::converged;
  if (!options.enforce_limits) return;
  for (std::size_t i = 0; i < 6; ++i) {
    const double length = lengths_mm[static_cast<Eigen::Index>(i)];
    if (length < geometry.actuators[i].min_mm || length > geometry.actuators[i].max_mm) {
      result.status = ForwardStatus::left_workspace;
      result.reason = "leg " + std::to_string(i + 1) + " is outside its stroke";
      return;
    }
  }
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
  if (!(singular_mm >= 0)) throw InputError("ForwardOptions.singular_mm must not be negative");
}

ForwardResult forward_kinematics(const PlatformGeometry& geometry, const LegVector& lengths_mm,
                                 const Rigid3& B_from_P_start, const ForwardOptions& options) {
  options.validate();
  ForwardResult result;
  if (input_fault(lengths_mm, result)) return result;
  const NewtonResult solve = newton(geometry, lengths_mm, B_from_P_start, options, 1e3);
  result.iterations = solve.iterations;
  if (!solve.converged) {
    result.status = solve.singular ? ForwardStatus::singular : ForwardStatus::failed;
    result.reason =
        solve.singular ? "the start is singular" : "Newton's method does not converge from this start";
    return result;
  }
  conclude(geometry, lengths_mm, solve.B_from_P, options, result);
  return result;
}

ForwardResult forward_kinematics(const PlatformGeometry& geometry, const LegVector& lengths_mm,
                                 const ForwardOptions& options) {
  options.validate();
  ForwardResult result;
  if (input_fault(lengths_mm, result)) return result;
  Rigid3 at = geometry.home_B_from_P();
  const LegVector home_mm = leg_lengths(geometry, at);
  const double home_sign = std::copysign(1.0, leg_jacobian(geometry, at).determinant());
  double done = 0;
  double step = 1;
  while (done < 1) {
    const double next = std::min(1.0, done + step);
    const LegVector goal_mm = home_mm + next * (lengths_mm - home_mm);
    const NewtonResult solve = newton(geometry, goal_mm, at, options, 0.25);
    result.iterations += solve.iterations;
    if (solve.converged && leg_jacobian(geometry, solve.B_from_P).determinant() * home_sign > 0) {
      at = solve.B_from_P;
      done = next;
      ++result.continuation_steps;
      if (solve.first_contraction < 0.1) step *= 2;
      continue;
    }
    step /= 2;
    if (step < options.smallest_step) {
      result.status = ForwardStatus::singular;
      result.reason = "the way from home meets a singularity";
      return result;
    }
  }
  conclude(geometry, lengths_mm, at, options, result);
  return result;
}

}  // namespace hexcal
