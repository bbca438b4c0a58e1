#include "camera_calib/normal_equations.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "kinematics/geometry/rigid3.h"

namespace hexcal {
namespace {

// The rows of each pose, and of none (priors) last.
std::vector<std::vector<int>> rows_by_pose(const SparseRows& j, int shared_columns) {
  const auto num_poses = static_cast<std::size_t>((j.columns - shared_columns) / 6);
  std::vector<std::vector<int>> rows(num_poses + 1);
  for (std::size_t row = 0; row + 1 < j.starts.size(); ++row) {
    std::size_t pose = num_poses;
    for (auto at = static_cast<std::size_t>(j.starts[row]); at < static_cast<std::size_t>(j.starts[row + 1]);
         ++at) {
      if (j.indices[at] >= shared_columns) {
        pose = static_cast<std::size_t>((j.indices[at] - shared_columns) / 6);
        break;
      }
    }
    rows[pose].push_back(static_cast<int>(row));
  }
  return rows;
}

ReducedBlock reduced_block(const SparseRows& j, const std::vector<double>& residuals, std::vector<int> rows,
                           int shared_columns) {
  ReducedBlock block;
  const auto count = static_cast<Eigen::Index>(rows.size());
  block.jacobian = Eigen::MatrixXd::Zero(count, shared_columns);
  block.residuals.resize(count);
  Eigen::MatrixXd by_pose = Eigen::MatrixXd::Zero(count, 6);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto row = static_cast<std::size_t>(rows[static_cast<std::size_t>(i)]);
    block.residuals[i] = residuals[row];
    for (auto at = static_cast<std::size_t>(j.starts[row]); at < static_cast<std::size_t>(j.starts[row + 1]);
         ++at) {
      const int column = j.indices[at];
      if (column < shared_columns) {
        block.jacobian(i, column) = j.values[at];
      } else {
        by_pose(i, (column - shared_columns) % 6) = j.values[at];
      }
    }
  }
  block.rows = std::move(rows);
  block.pose_inverse = Matrix6d(by_pose.transpose() * by_pose).ldlt().solve(Matrix6d::Identity());
  block.pose_by_shared = -block.pose_inverse * (by_pose.transpose() * block.jacobian);
  block.jacobian.noalias() += by_pose * block.pose_by_shared;
  return block;
}

}  // namespace

ReducedSystem reduced_system(const SparseRows& jacobian, const std::vector<double>& residuals,
                             int shared_columns) {
  ReducedSystem system;
  std::vector<std::vector<int>> rows = rows_by_pose(jacobian, shared_columns);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(shared_columns, shared_columns);
  for (const int row : rows.back()) {
    const auto begin = static_cast<std::size_t>(jacobian.starts[static_cast<std::size_t>(row)]);
    const auto end = static_cast<std::size_t>(jacobian.starts[static_cast<std::size_t>(row) + 1]);
    for (std::size_t a = begin; a < end; ++a) {
      for (std::size_t b = begin; b < end; ++b) {
        information(jacobian.indices[a], jacobian.indices[b]) += jacobian.values[a] * jacobian.values[b];
      }
    }
  }
  rows.pop_back();
  for (std::vector<int>& of_pose : rows) {
    system.blocks.push_back(reduced_block(jacobian, residuals, std::move(of_pose), shared_columns));
    information.selfadjointView<Eigen::Lower>().rankUpdate(system.blocks.back().jacobian.transpose());
  }
  if (shared_columns == 0) return system;
  // Lens coefficients of different powers differ by many orders: scale to a unit diagonal before factoring.
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled =
      scale.asDiagonal() * Eigen::MatrixXd(information.selfadjointView<Eigen::Lower>()) * scale.asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> llt(scaled);
  if (llt.info() != Eigen::Success) return system;
  system.covariance = scale.asDiagonal() *
                      llt.solve(Eigen::MatrixXd::Identity(shared_columns, shared_columns)) *
                      scale.asDiagonal();
  system.covariance = 0.5 * (system.covariance + system.covariance.transpose()).eval();
  return system;
}

Matrix6d ReducedSystem::pose_covariance(std::size_t block, const Eigen::MatrixXd& shared) const {
  const ReducedBlock& b = blocks[block];
  if (shared.size() == 0) return b.pose_inverse;
  return b.pose_inverse + b.pose_by_shared * shared * b.pose_by_shared.transpose();
}

Matrix6d pose_perturbation_covariance(const Matrix6d& covariance, const std::array<double, 6>& pose) {
  // exp(w + dw) = exp(J_l(w) dw) exp(w), J_l the left Jacobian of SO(3).
  const Eigen::Vector3d w(pose[0], pose[1], pose[2]);
  const double angle = w.norm();
  const Eigen::Matrix3d cross = skew(w);
  Eigen::Matrix3d left = Eigen::Matrix3d::Identity() + 0.5 * cross;
  if (angle > 1e-4) {
    left = Eigen::Matrix3d::Identity() + (1 - std::cos(angle)) / (angle * angle) * cross +
           (angle - std::sin(angle)) / (angle * angle * angle) * cross * cross;
  }
  Matrix6d j = Matrix6d::Zero();
  j.topRightCorner<3, 3>().setIdentity();
  j.bottomLeftCorner<3, 3>() = left;
  return j * covariance * j.transpose();
}

}  // namespace hexcal
