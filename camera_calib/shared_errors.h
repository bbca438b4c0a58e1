#pragma once

#include <Eigen/Core>
#include <vector>

#include "camera_calib/normal_equations.h"

namespace hexcal {

// Errors of corners are not independent: a sheet bends anew in every photograph, a lens model is off in the
// same place of every frame, a printer misplaces the same point in every photograph. What such common errors
// do to the shared unknowns is estimated from the residuals themselves.

/// What leaving one group of blocks (a photograph's sheets) out does, in closed form: one Gauss-Newton step
/// from the common solution, whose residuals are (I - L)^-1 r with the leverage L (Allen 1974).
struct LeftOut {
  Eigen::VectorXd chi2;    ///< per group: its residuals by the others' solution, its poses adjusted
  Eigen::MatrixXd shifts;  ///< shared unknowns x groups: the others' solution minus the common one
};

/// `group_of_block`: 0, 1, ... without gaps. The system must have a covariance.
[[nodiscard]] LeftOut leave_groups_out(const ReducedSystem& system, const std::vector<int>& group_of_block);

/// Covariance of the shared unknowns from these shifts (the jackknife; Tukey 1958). At least two groups.
[[nodiscard]] Eigen::MatrixXd jackknife_covariance(const LeftOut& left_out);

/// Covariance of the shared unknowns if the errors of rows with the same key depend on each other in any way
/// and others do not (Liang & Zeger 1986). `key_of_row` by row of the whole system, 0, 1, ... `keys` - 1.
[[nodiscard]] Eigen::MatrixXd clustered_covariance(const ReducedSystem& system,
                                                   const std::vector<int>& key_of_row, int keys);

}  // namespace hexcal
