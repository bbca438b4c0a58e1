#include "kinematics/geometry/pose_pole.h"

#include <algorithm>
#include <cmath>

namespace hexcal {

bool roll_and_yaw_are_known(const Pose& pose, const Matrix6d& covariance) {
  constexpr double kNearPole = 0.2;       // cosine of a pitch of 78 deg
  constexpr double kLargestSigma = 0.05;  // rad; the quadratic term is then 5 % of the linear one
  const double sigma2 = std::max(covariance(3, 3), covariance(5, 5));
  return std::abs(std::cos(pose.rpy_rad.y())) > kNearPole || sigma2 < kLargestSigma * kLargestSigma;
}

}  // namespace hexcal
