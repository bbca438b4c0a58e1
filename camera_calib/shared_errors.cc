#include "camera_calib/shared_errors.h"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>

namespace hexcal {

LeftOut leave_groups_out(const ReducedSystem& system, const std::vector<int>& group_of_block) {
  assert(group_of_block.size() == system.blocks.size() && system.covariance.size() > 0);
  const int groups = 1 + *std::max_element(group_of_block.begin(), group_of_block.end());
  LeftOut out;
  out.chi2 = Eigen::VectorXd::Zero(groups);
  out.shifts = Eigen::MatrixXd::Zero(system.covariance.rows(), groups);
  for (int group = 0; group < groups; ++group) {
    Eigen::Index rows = 0;
    for (std::size_t b = 0; b < system.blocks.size(); ++b) {
      if (group_of_block[b] == group) rows += system.blocks[b].residuals.size();
    }
    Eigen::MatrixXd jacobian(rows, system.covariance.rows());
    Eigen::VectorXd residuals(rows);
    Eigen::Index at = 0;
    for (std::size_t b = 0; b < system.blocks.size(); ++b) {
      if (group_of_block[b] != group) continue;
      const ReducedBlock& block = system.blocks[b];
      jacobian.middleRows(at, block.residuals.size()) = block.jacobian;
      residuals.segment(at, block.residuals.size()) = block.residuals;
      at += block.residuals.size();
    }
    const Eigen::MatrixXd gain = system.covariance * jacobian.transpose();
    Eigen::MatrixXd rest = -jacobian * gain;
    rest.diagonal().array() += 1;
    const Eigen::VectorXd left_out = rest.partialPivLu().solve(residuals);
    out.chi2[group] = left_out.squaredNorm();
    out.shifts.col(group) = gain * left_out;
  }
  return out;
}

Eigen::MatrixXd jackknife_covariance(const LeftOut& left_out) {
  const auto groups = static_cast<double>(left_out.shifts.cols());
  const Eigen::MatrixXd centred = left_out.shifts.colwise() - left_out.shifts.rowwise().mean();
  return (groups - 1) / groups * centred * centred.transpose();
}

Eigen::MatrixXd clustered_covariance(const ReducedSystem& system, const std::vector<int>& key_of_row,
                                     int keys) {
  Eigen::MatrixXd scores = Eigen::MatrixXd::Zero(system.covariance.rows(), keys);
  for (const ReducedBlock& block : system.blocks) {
    for (std::size_t i = 0; i < block.rows.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      scores.col(key_of_row[static_cast<std::size_t>(block.rows[i])]) +=
          block.residuals[row] * block.jacobian.row(row).transpose();
    }
  }
  const double used = static_cast<double>((scores.colwise().squaredNorm().array() > 0).count());
  const Eigen::MatrixXd shifts = system.covariance * scores;
  return std::max(used, 2.0) / (std::max(used, 2.0) - 1) * shifts * shifts.transpose();
}

}  // namespace hexcal
