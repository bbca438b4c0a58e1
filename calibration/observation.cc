#include "calibration/observation.h"

namespace hexcal {

ObservationSet ObservationSet::subset(const std::vector<std::size_t>& indices) const {
  ObservationSet part;
  part.covariance_known = covariance_known;
  for (const std::size_t i : indices) part.poses.push_back(poses[i]);
  if (joint_covariance.size() > 0) {
    const auto n = static_cast<Eigen::Index>(indices.size());
    part.joint_covariance.resize(6 * n, 6 * n);
    for (Eigen::Index a = 0; a < n; ++a) {
      for (Eigen::Index b = 0; b < n; ++b) {
        part.joint_covariance.block<6, 6>(6 * a, 6 * b) =
            joint_covariance.block<6, 6>(6 * static_cast<Eigen::Index>(indices[static_cast<std::size_t>(a)]),
                                         6 * static_cast<Eigen::Index>(indices[static_cast<std::size_t>(b)]));
      }
    }
  }
  return part;
}

Matrix6d ObservationSet::covariance(std::size_t index) const {
  if (joint_covariance.size() == 0) return poses[index].covariance;
  const auto i = 6 * static_cast<Eigen::Index>(index);
  return joint_covariance.block<6, 6>(i, i);
}

}  // namespace hexcal
