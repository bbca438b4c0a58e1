#include "pose_extract/target_alignment.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>

#include "kinematics/geometry/nearest_rotation.h"

namespace hexcal {
namespace {

constexpr double kLeastSecondTurn = 0.02;  // rad, rms about the axis about which the poses turn second most
constexpr double kOpenDirection = 0.02;    // of the shift, relative to the best known

// The motion of LG from home to where it is, in UG.
Rigid3 motion_in_ug(const Pose& pose, const Pose& home, double gd_mm) {
  return ug_from_lg(pose, gd_mm) * inverse(ug_from_lg(home, gd_mm));
}

}  // namespace

std::optional<TargetAlignment> align_with_targets(
    const std::vector<std::pair<Pose, Pose>>& target_and_measured, const Pose& home_target, double gd_mm) {
  if (target_and_measured.size() < 3) return std::nullopt;
  std::vector<Rigid3> commanded;
  std::vector<Rigid3> measured;
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
  for (const auto& [target, pose] : target_and_measured) {
    commanded.push_back(motion_in_ug(target, home_target, gd_mm));
    measured.push_back(motion_in_ug(pose, Pose{}, gd_mm));
    cross += rotation_vector_from_quaternion(measured.back().rotation) *
             rotation_vector_from_quaternion(commanded.back().rotation).transpose();
  }
  const auto count = static_cast<double>(commanded.size());
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(cross);
  if (std::sqrt(svd.singularValues()[1] / count) < kLeastSecondTurn) return std::nullopt;
  const Eigen::Matrix3d turn = nearest_rotation(cross);
  // t_measured = turn t_commanded + (1 - R_measured) shift.
  Eigen::MatrixXd a(static_cast<Eigen::Index>(3 * commanded.size()), 3);
  Eigen::VectorXd b(a.rows());
  double squares = 0;
  for (std::size_t i = 0; i < commanded.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(3 * i);
    a.middleRows<3>(row) = Eigen::Matrix3d::Identity() - measured[i].rotation_matrix();
    b.segment<3>(row) = measured[i].translation - turn * commanded[i].translation;
    const Eigen::Quaterniond expected(
        Eigen::Matrix3d(turn * commanded[i].rotation_matrix() * turn.transpose()));
    squares += std::pow(rotation_distance(expected, measured[i].rotation), 2);
  }
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  solver.setThreshold(kOpenDirection);
  const Eigen::Vector3d shift = solver.compute(a).solve(b);
  return TargetAlignment{Rigid3(turn, shift), std::sqrt(squares / count) * kDegPerRad};
}

}  // namespace hexcal
