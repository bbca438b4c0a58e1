#pragma once

#include <optional>
#include <string>

#include "kinematics/platform.h"

namespace hexcal {

enum class ForwardStatus {
  failed,          ///< bad input, or no convergence; `reason` says which
  converged,       ///< B_from_P has the leg lengths
  left_workspace,  ///< B_from_P has the leg lengths, but a stroke or joint limit is broken
  singular,        ///< the way from the start meets a singularity
};

[[nodiscard]] const char* name(ForwardStatus status);

struct ForwardOptions {
  double tolerance_mm = 1e-13;  ///< stop when the next correction would be smaller; never below rounding
  int max_iterations = 50;      ///< Jacobians taken in one solve
  double smallest_step = 1e-4;  ///< of the way from home, below which the continuation gives up
  bool enforce_limits = false;  ///< report left_workspace where strokes or joint limits are broken

  /// Throws InputError naming the field.
  void validate() const;
};

struct ForwardResult {
  ForwardStatus status = ForwardStatus::failed;
  std::optional<Rigid3> B_from_P;
  std::string reason;  ///< empty when converged
  int iterations = 0;  ///< Jacobians taken in all
  int continuation_steps = 0;
  double residual_mm = 0;  ///< largest leg residual at B_from_P
};

/// The lengths are those that the actuators make (offset + mm_per_unit q), screws included.
///
/// The pose with these leg lengths that Newton's method reaches from B_from_P_start, on SE(3) with the
/// multiplicative update of covariance.h.
[[nodiscard]] ForwardResult forward_kinematics(const PlatformGeometry& geometry, const LegVector& lengths_mm,
                                               const Rigid3& B_from_P_start, const ForwardOptions& = {});

/// The feasible pose: connected to home by the straight path of the leg lengths, without a singularity on the
/// way. Follows that path with the step length controlled by Newton's contraction (Deuflhard 2004, sec. 5.1).
[[nodiscard]] ForwardResult forward_kinematics(const PlatformGeometry& geometry, const LegVector& lengths_mm,
                                               const ForwardOptions& = {});

}  // namespace hexcal
