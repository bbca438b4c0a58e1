#pragma once

#include "kinematics/leg_array.h"

namespace hexcal {

struct NewtonOptions {
  double tolerance_mm = 1e-12;  ///< of the next correction; rounding sets the floor
  int max_iterations = 50;
  double largest_contraction = 1e3;  ///< gives up once a step is longer than this times the one before it
};

struct NewtonResult {
  bool converged = false;
  bool singular = false;  ///< met an exactly singular Jacobian
  int iterations = 0;
  double first_contraction = 0;  ///< second step over first step: Deuflhard's estimate of the nonlinearity
  double determinant = 0;        ///< of leg_jacobian one step before the end
  double residual_mm = 0;        ///< largest leg residual one step before the end
  Rigid3 B_from_P;
};

/// Newton's method for leg_lengths(pose) = lengths_mm with multiplicative updates. Steps are measured in mm,
/// with rotations weighed by the platform's size. Allocates nothing.
[[nodiscard]] NewtonResult newton(const LegArray& legs, const LegVector& lengths_mm, const Rigid3& start,
                                  const NewtonOptions& options = {});

/// The same for a machine with a screw lead, whose legs answer actuated_lengths.
[[nodiscard]] NewtonResult newton_with_screws(const PlatformGeometry& geometry, const LegVector& lengths_mm,
                                              const Rigid3& start, const NewtonOptions& options = {});

}  // namespace hexcal
