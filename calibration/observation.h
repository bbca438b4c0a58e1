#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "kinematics/platform.h"

namespace hexcal {

/// One measured pose of the machine and the actuator readings at which it stood.
struct PoseObservation {
  std::string id;
  LegVector readings = LegVector::Zero();
  /// Direction of the last movement of each leg: +1 growing, -1 shrinking, 0 unknown.
  LegVector approach = LegVector::Zero();
  std::optional<Pose> target;  ///< what was commanded, in the frames of the hexapod
  Pose measured;
  std::array<bool, 6> observed{true, true, true, true, true, true};  ///< which of x .. yaw were measured
  Matrix6d covariance = Matrix6d::Zero();  ///< of x, y, z, roll, pitch, yaw: mm^2, mm rad, rad^2
  /// The home pose where it defines LG (`LG: {from: home}`): zero without an error of its own. It binds the
  /// machine's home readings to the zero pose but is no test of anything, so it is never held out or counted.
  bool is_definition = false;

  [[nodiscard]] bool complete() const {
    for (const bool one : observed)
      if (!one) return false;
    return true;
  }
};

/// The poses of one campaign.
struct ObservationSet {
  std::vector<PoseObservation> poses;
  /// Covariance of all pose parameters together, 6N x 6N in the order of `poses`; empty when the poses are
  /// independent. Its diagonal blocks replace PoseObservation::covariance.
  Eigen::MatrixXd joint_covariance;
  /// Whether the covariances were measured. If not, they hold only a guess of the ratio of mm to rad, and
  /// identification estimates both noises from the residuals.
  bool covariance_known = true;

  /// The poses of these indices, in that order.
  [[nodiscard]] ObservationSet subset(const std::vector<std::size_t>& indices) const;
  [[nodiscard]] Matrix6d covariance(std::size_t index) const;
};

}  // namespace hexcal
