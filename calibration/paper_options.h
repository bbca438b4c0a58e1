#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calibration/observation.h"

namespace hexcal {

/// Error = intercept + slope * target value: a least-squares line of one parameter (mm or rad).
struct ErrorLine {
  double intercept = 0;
  double slope = 0;
};

/// The error model of one of the paper's options (Karmakar and Turner, sections 1.2.1 to 1.2.3).
struct PaperModel {
  int option = 3;                         ///< 1, 2 or 3
  std::array<ErrorLine, 6> pose_lines{};  ///< of x, y, z, roll, pitch, yaw; option 2 uses the last three
  /// [leg][DH variable] in the order of dh_chain.h; options 1 and 2.
  std::array<std::array<ErrorLine, 6>, 6> joint_lines{};
};

/// What the least-squares correction of a parameter is a function of; the paper says "a line or curve".
enum class ErrorCurve { constant, line };

/// Fits an option to the targets and measured poses of all observations that have a target and a complete
/// measurement and define no frame. `nominal` gives the leg paths of options 1 and 2.
[[nodiscard]] PaperModel fit_paper_option(const PlatformGeometry& nominal, int option,
                                          const std::vector<PoseObservation>& poses,
                                          ErrorCurve curve = ErrorCurve::line);

/// The pose to command so that `target` is reached: target minus predicted error. Options 1 and 2 correct the
/// DH variables of each leg path, average the six positions they lead to and drop their rotations; option 1
/// leaves the orientation as it is.
[[nodiscard]] Pose predicted_pose(const PlatformGeometry& nominal, const PaperModel& model,
                                  const Pose& target);

/// The target for which predicted_pose gives `command`; nothing where the iteration does not converge.
[[nodiscard]] std::optional<Pose> target_of_command(const PlatformGeometry& nominal, const PaperModel& model,
                                                    const Pose& command);

/// The paper's rule for its pose 24: a pose goes out when an error of it lies far outside the others' and it
/// stands near a singular point. Reading chosen here: an error parameter more than `outlier_sigmas` robust
/// standard deviations (1.4826 MAD) from the median, and a pose whose legs resist its weakest motion
/// (smallest singular value of the leg Jacobian, rotations in platform radii) less than `near_singular_share`
/// of the median of all poses.
struct NearSingularRule {
  double outlier_sigmas = 5;
  double near_singular_share = 0.5;
};
/// Indices of the poses that go out, in order.
[[nodiscard]] std::vector<std::size_t> near_singular_outliers(const PlatformGeometry& nominal,
                                                              const std::vector<PoseObservation>& poses,
                                                              const NearSingularRule& rule = {});

}  // namespace hexcal
