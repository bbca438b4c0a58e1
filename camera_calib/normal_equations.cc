#include "camera_calib/normal_equations.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "kinematics/geometry/rigid3.h"

namespace hexcal {
namespace {

// Normal equations in the form [A B; B^T D] with D block diagonal.
struct Bordered {
  Eigen::MatrixXd shared;                // A
  std::vector<Eigen::MatrixXd> borders;  // columns of B per pose
  std::vector<Matrix6d> poses;           // blocks of D
};

Bordered accumulate(const SparseRows& j, int shared_columns) {
  const int num_poses = (j.columns - shared_columns) / 6;
  Bordered n;
  n.shared = Eigen::MatrixXd::Zero(shared_columns, shared_columns);
  n.borders.assign(static_cast<std::size_t>(num_poses), Eigen::MatrixXd::Zero(shared_columns, 6));
  n.poses.assign(static_cast<std::size_t>(num_poses), Matrix6d::Zero());
  for (std::size_t row = 0; row + 1 < j.starts.size(); ++row) {
    const auto begin = static_cast<std::size_t>(j.starts[row]);
    const auto end = static_cast<std::size_t>(j.starts[row + 1]);
    for (std::size_t a = begin; a < end; ++a) {
      for (std::size_t b = begin; b < end; ++b) {
        const double product = j.values[a] * j.values[b];
        const int ca = j.indices[a];
        const int cb = j.indices[b];
        if (cb < shared_columns) {
          if (ca < shared_columns) n.shared(ca, cb) += product;
        } else {
          const auto pose = static_cast<std::size_t>((cb - shared_columns) / 6);
          const int within = (cb - shared_columns) % 6;
          if (ca < shared_columns) {
            n.borders[pose](ca, within) += product;
          } else {
            n.poses[pose]((ca - shared_columns) % 6, within) += product;
          }
        }
      }
    }
  }
  return n;
}

}  // namespace

BorderedCovariance bordered_covariance(const SparseRows& jacobian, int shared_columns) {
  Bordered n = accumulate(jacobian, shared_columns);
  std::vector<Matrix6d> inverses;
  std::vector<Eigen::MatrixXd> eliminated;  // B D^-1 per pose
  for (std::size_t i = 0; i < n.poses.size(); ++i) {
    inverses.push_back(n.poses[i].ldlt().solve(Matrix6d::Identity()));
    eliminated.push_back(n.borders[i] * inverses.back());
    n.shared.noalias() -= eliminated.back() * n.borders[i].transpose();
  }
  BorderedCovariance out;
  if (shared_columns > 0) {
    // Lens coefficients of different powers differ by many orders: scale to a unit diagonal before factoring.
    const Eigen::VectorXd scale = n.shared.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * n.shared * scale.asDiagonal();
    const Eigen::LLT<Eigen::MatrixXd> llt(scaled);
    if (llt.info() != Eigen::Success) return out;
    out.shared = scale.asDiagonal() * llt.solve(Eigen::MatrixXd::Identity(shared_columns, shared_columns)) *
                 scale.asDiagonal();
    out.shared = 0.5 * (out.shared + out.shared.transpose()).eval();
  }
  for (std::size_t i = 0; i < n.poses.size(); ++i) {
    Matrix6d covariance = inverses[i];
    if (shared_columns > 0) covariance += eliminated[i].transpose() * out.shared * eliminated[i];
    out.poses.push_back(covariance);
  }
  return out;
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
