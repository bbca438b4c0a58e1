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

/// The whitened rows of one pose with the pose eliminated: what they say of the shared unknowns alone.
struct ReducedBlock {
  std::vector<int> rows;           ///< numbers in the whole system
  Eigen::MatrixXd jacobian;        ///< rows x shared
  Eigen::VectorXd residuals;       ///< at the solution
  Matrix6d pose_inverse;           ///< of the pose's own normal equations
  Eigen::MatrixXd pose_by_shared;  ///< 6 x shared: how the pose follows the shared unknowns
};

/// A least-squares system whose last columns are poses of six columns each that no row shares.
struct ReducedSystem {
  std::vector<ReducedBlock> blocks;  ///< one per pose
  Eigen::MatrixXd covariance;        ///< of the leading, shared columns; empty if the system is singular

  /// With `shared` as the covariance of the shared unknowns, for instance `covariance`.
  [[nodiscard]] Matrix6d pose_covariance(std::size_t block, const Eigen::MatrixXd& shared) const;
};

[[nodiscard]] ReducedSystem reduced_system(const SparseRows& jacobian, const std::vector<double>& residuals,
                                           int shared_columns);

/// From a covariance of (rotation vector, translation) to that of the perturbation (dt, dr) of covariance.h.
[[nodiscard]] Matrix6d pose_perturbation_covariance(const Matrix6d& covariance,
                                                    const std::array<double, 6>& pose);

}  // namespace hexcal
