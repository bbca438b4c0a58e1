#include "calibration/statistics.h"

#include <algorithm>
#include <cmath>

namespace hexcal {

ErrorStatistics error_statistics(std::span<const PosePair> pairs) {
  ErrorStatistics s;
  s.poses = static_cast<int>(pairs.size());
  if (pairs.empty()) return s;
  Vector6d low = pose_error(pairs[0].actual, pairs[0].target);
  Vector6d high = low;
  double position_squares = 0;
  double orientation_squares = 0;
  for (const PosePair& pair : pairs) {
    const Vector6d error = pose_error(pair.actual, pair.target);
    low = low.cwiseMin(error);
    high = high.cwiseMax(error);
    s.mean += error;
    s.rms += error.cwiseAbs2();
    s.max_abs = s.max_abs.cwiseMax(error.cwiseAbs());
    const double distance = error.head<3>().norm();
    const double angle =
        rotation_distance(quaternion_from_rpy(pair.actual.rpy_rad), quaternion_from_rpy(pair.target.rpy_rad));
    position_squares += distance * distance;
    orientation_squares += angle * angle;
    s.position_max_mm = std::max(s.position_max_mm, distance);
    s.orientation_max_rad = std::max(s.orientation_max_rad, angle);
  }
  const double n = static_cast<double>(pairs.size());
  s.range = high - low;
  s.position_magnitude_mm = range_magnitude(s.range.head<3>());
  s.orientation_magnitude_rad = range_magnitude(s.range.tail<3>());
  s.mean /= n;
  s.rms = (s.rms / n).cwiseSqrt();
  s.position_rms_mm = std::sqrt(position_squares / n);
  s.orientation_rms_rad = std::sqrt(orientation_squares / n);
  return s;
}

double squares_mm2(const Vector6d& error, double length_mm) {
  return error.head<3>().squaredNorm() + length_mm * length_mm * error.tail<3>().squaredNorm();
}

double range_magnitude(const Eigen::Vector3d& ranges) { return std::sqrt(ranges.squaredNorm() / 3.0); }

double improvement_percent(double before, double after) {
  return before == 0 ? 0.0 : 100.0 * (before - after) / before;
}

}  // namespace hexcal
