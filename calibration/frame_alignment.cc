#include "calibration/frame_alignment.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <vector>

#include "kinematics/forward.h"
#include "kinematics/geometry/nearest_rotation.h"

namespace hexcal {
namespace {

struct Pair {
  Rigid3 B_from_P;    // by the nominal machine
  Rigid3 UG_from_LG;  // measured, in the unknown frames
  bool full;
};

// R_P R_X = R_Y R_M for all poses: vec(R_X), vec(R_Y) are the leading singular vectors of sum R_M (x) R_P.
// False when the poses turn about fewer than two axes.
bool rotations_from_full_poses(const std::vector<Pair>& pairs, Eigen::Matrix3d& P_from_LG,
                               Eigen::Matrix3d& B_from_UG) {
  constexpr double kSmallestGap = 1e-5;
  Eigen::Matrix<double, 9, 9> k = Eigen::Matrix<double, 9, 9>::Zero();
  double count = 0;
  for (const Pair& pair : pairs) {
    if (!pair.full) continue;
    const Eigen::Matrix3d rm = pair.UG_from_LG.rotation_matrix();
    const Eigen::Matrix3d rp = pair.B_from_P.rotation_matrix();
    for (Eigen::Index r = 0; r < 3; ++r)
      for (Eigen::Index c = 0; c < 3; ++c) k.block<3, 3>(3 * r, 3 * c) += rm(r, c) * rp;
    count += 1;
  }
  if (count < 3) return false;
  const Eigen::JacobiSVD<Eigen::Matrix<double, 9, 9>> svd(k / count,
                                                          Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (svd.singularValues()[0] - svd.singularValues()[1] < kSmallestGap) return false;
  const Eigen::Matrix<double, 9, 1> x = svd.matrixV().col(0);
  const Eigen::Matrix<double, 9, 1> y = svd.matrixU().col(0);
  Eigen::Matrix3d rx = Eigen::Map<const Eigen::Matrix3d>(x.data());
  Eigen::Matrix3d ry = Eigen::Map<const Eigen::Matrix3d>(y.data());
  const double sign = rx.determinant() < 0 ? -1.0 : 1.0;
  P_from_LG = nearest_rotation(sign * rx);
  B_from_UG = nearest_rotation(sign * ry);
  return true;
}

// Rotation of the measurement frame from positions alone (Kabsch), the target's taken as nominal.
Eigen::Matrix3d rotation_from_positions(const std::vector<Pair>& pairs, const Rigid3& P_from_LG) {
  Eigen::Vector3d mean_b = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  const double n = static_cast<double>(pairs.size());
  for (const Pair& pair : pairs) {
    mean_b += pair.B_from_P * P_from_LG.translation / n;
    mean_m += pair.UG_from_LG.translation / n;
  }
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
  for (const Pair& pair : pairs) {
    cross +=
        (pair.B_from_P * P_from_LG.translation - mean_b) * (pair.UG_from_LG.translation - mean_m).transpose();
  }
  return nearest_rotation(cross);
}

}  // namespace

std::optional<AlignedFrames> align_frames(const PlatformGeometry& nominal,
                                          const ObservationSet& observations) {
  std::vector<Pair> pairs;
  for (const PoseObservation& pose : observations.poses) {
    if (!pose.observed[0] || !pose.observed[1] || !pose.observed[2]) continue;
    const ForwardResult solved = forward_kinematics(nominal, lengths_from_readings(nominal, pose.readings));
    if (solved.status != ForwardStatus::converged) continue;
    pairs.push_back({*solved.B_from_P, ug_from_lg(pose.measured, nominal.gd_mm), pose.complete()});
  }
  if (pairs.size() < 3) return std::nullopt;
  Eigen::Matrix3d P_from_LG = nominal.P_from_LG.rotation_matrix();
  Eigen::Matrix3d B_from_UG;
  if (!rotations_from_full_poses(pairs, P_from_LG, B_from_UG))
    B_from_UG = rotation_from_positions(pairs, nominal.P_from_LG);
  // R_P x - y = R_Y t_M - t_P, as corrections of the nominal x, so that what the poses leave open stays.
  const auto rows = static_cast<Eigen::Index>(3 * pairs.size());
  Eigen::MatrixXd a(rows, 6);
  Eigen::VectorXd b(rows);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(3 * i);
    a.middleRows<3>(at) << pairs[i].B_from_P.rotation_matrix(), -Eigen::Matrix3d::Identity();
    b.segment<3>(at) =
        B_from_UG * pairs[i].UG_from_LG.translation - pairs[i].B_from_P * nominal.P_from_LG.translation;
  }
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  solver.setThreshold(1e-3);
  const Eigen::Matrix<double, 6, 1> xy = solver.compute(a).solve(b);
  return AlignedFrames{Rigid3(B_from_UG, xy.tail<3>()),
                       Rigid3(P_from_LG, nominal.P_from_LG.translation + xy.head<3>())};
}

}  // namespace hexcal
