#pragma once

#include "kinematics/leg_array.h"

namespace hexcal {

struct NewtonOptions {
  double tolerance_mm = 1e-13;       ///< of the next correction; rounding sets the floor
  int max_iterations = 50;           ///< Jacobians taken
  double largest_contraction = 1e3;  ///< gives up once a step is longer than this times the one before it
};

struct NewtonResult {
  bool converged = false;
  bool singular = false;         ///< met an exactly singular Jacobian
  int iterations = 0;            ///< Jacobians taken
  double first_contraction = 0;  ///< simplified correction over the first: how nonlinear the way was
  double determinant = 0;        ///< of the last Jacobian, rows in any positive unit: its sign is what counts
  Rigid3 B_from_P;
};

/// Newton's method for leg_lengths(pose) = lengths_mm with multiplicative updates and, for each Jacobian, one
/// or two simplified corrections (Deuflhard 2004, sec. 2.1; order three: Potra & Ptak 1984). Corrections are
/// measured in mm, with rotations weighed by the platform's size. Allocates nothing.
[[nodiscard]] NewtonResult newton(const LegArray& legs, const LegVector& lengths_mm, const Rigid3& start,
                                  const NewtonOptions& options = {});

/// The same for a machine with a screw lead, whose legs answer actuated_lengths.
[[nodiscard]] NewtonResult newton_with_screws(const PlatformGeometry& geometry, const LegVector& lengths_mm,
                                              const Rigid3& start, const NewtonOptions& options = {});

}  // namespace hexcal
