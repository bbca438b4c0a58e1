#pragma once

#include <string>
#include <vector>

#include "kinematics/inverse.h"

namespace hexcal {

struct AssemblyMode {
  Rigid3 B_from_P;
  double residual_mm = 0;  ///< largest leg residual
  double sigma_min =
      0;  ///< smallest singular value of the scaled Jacobian; near-singular modes are known less well
  PoseVerdict verdict = PoseVerdict::reachable;
};

struct AssemblyModes {
  std::vector<AssemblyMode> modes;  ///< real ones, the feasible ones first, then by distance from home
  int paths_to_complex = 0;         ///< of the 40 paths: ended at a pose that is not real
  int paths_to_infinity = 0;        ///< ended at none, as some do on machines of special shape
  int paths_lost = 0;               ///< could not be followed; modes may be missing
  std::string reason;               ///< when there is nothing

  /// Every one of the 40 paths is accounted for.
  [[nodiscard]] bool complete() const { return reason.empty() && paths_lost == 0; }
};

/// Every real pose with these leg lengths. The 40 complex poses of a Stewart platform (Raghavan 1993; Ronga &
/// Vust 1995) are followed from a random complex platform, whose 40 poses are found once by monodromy, to
/// this one (parameter homotopy: Morgan & Sommese 1989; Sommese & Wampler 2005, ch. 7). Unknowns: translation
/// and quaternion. Deterministic. A machine with a screw lead is not handled.
[[nodiscard]] AssemblyModes assembly_modes(const PlatformGeometry& geometry, const LegVector& lengths_mm);

}  // namespace hexcal
