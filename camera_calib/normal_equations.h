#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "kinematics/geometry/pose.h"

namespace hexcal {

/// A sparse Jacobian by rows (compressed row storage, as solvers hand it out).
struct SparseRows {
  int columns = 0;
  const std::vector<int>& starts;   ///< rows + 1 entries
  const std::vector<int>& indices;  ///< column of each value
  const std::vector<double>& values;
};

/// Inverse of J^T J whose last columns are poses of six columns each that no row shares.
struct BorderedCovariance {
  Eigen::MatrixXd shared;       ///< of the leading columns; empty if the system is singular
  std::vector<Matrix6d> poses;  ///< of each pose
};

[[nodiscard]] BorderedCovariance bordered_covariance(const SparseRows& jacobian, int shared_columns);

/// From a covariance of (rotation vector, translation) to that of the perturbation (dt, dr) of covariance.h.
[[nodiscard]] Matrix6d pose_perturbation_covariance(const Matrix6d& covariance,
                                                    const std::array<double, 6>& pose);

}  // namespace hexcal
