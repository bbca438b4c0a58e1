#include "calibration/normal_equations.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cmath>

namespace hexcal {
namespace {

// Up to six equations per pose, on the stack.
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;

Vector6d noise_factors(const LegNoise& noise) {
  Vector6d factors;
  factors << Eigen::Vector3d::Constant(noise.position_factor),
      Eigen::Vector3d::Constant(noise.orientation_factor);
  return factors;
}

// A covariance may be singular, and is zero for the defining home pose: a part of the legs' own noise that no
// measurement resolves keeps its Cholesky factor alive.
double leg_variance(const LegNoise& noise) {
  constexpr double kFloorMm = 1e-9;
  return std::max(noise.leg_sigma_mm * noise.leg_sigma_mm, kFloorMm * kFloorMm);
}

// Sums A^T A over the rows of many poses, which come six at a time: products of tall blocks are several times
// faster than those of single poses.
class RowProducts {
 public:
  RowProducts(Eigen::MatrixXd& sum, Eigen::Index columns) : sum_(sum) { block_.resize(kRows, columns); }

  void add(const Eigen::MatrixXd& rows) {
    if (used_ + rows.rows() > kRows) flush();
    block_.middleRows(used_, rows.rows()) = rows;
    used_ += rows.rows();
  }

  void flush() {
    if (used_ > 0) sum_.selfadjointView<Eigen::Lower>().rankUpdate(block_.topRows(used_).transpose());
    used_ = 0;
  }

 private:
  static constexpr Eigen::Index kRows = 192;
  Eigen::MatrixXd& sum_;
  Eigen::MatrixXd block_;
  Eigen::Index used_ = 0;
};

// Of whitened quantities; factor * factor^T is the component's covariance.
void add_component(NormalEquations::Component& component, RowProducts& information,
                   const Eigen::MatrixXd& factor, const Eigen::VectorXd& residuals,
                   const Eigen::MatrixXd& jacobian, double weight) {
  component.quadratic += (factor.transpose() * residuals).squaredNorm();
  component.trace += weight * factor.squaredNorm();
  information.add(factor.transpose() * jacobian);
}

// trace((L L^T)^-1) of a lower triangle L: the squares of the inverse's entries. Column block by column
// block, of which only the rows from the block on are not zero.
double trace_of_inverse(const Eigen::MatrixXd& lower) {
  constexpr Eigen::Index kColumns = 32;
  const Eigen::Index n = lower.rows();
  double trace = 0;
  Eigen::MatrixXd inverse(n, kColumns);
  for (Eigen::Index from = 0; from < n; from += kColumns) {
    const Eigen::Index left = n - from;
    auto columns = inverse.topLeftCorner(left, std::min(kColumns, left));
    columns.setIdentity();
    lower.bottomRightCorner(left, left).triangularView<Eigen::Lower>().solveInPlace(columns);
    trace += columns.squaredNorm();
  }
  return trace;
}

}  // namespace

ReducedPose reduce_to_observed(const LegLinearization& legs, const std::array<bool, 6>& observed,
                               const ParameterSelection& selection) {
  ReducedPose reduced;
  reduced.residuals = legs.residuals_mm;
  reduced.jacobian.setZero(6, selection.free_count);
  for (std::size_t j = 0; j < selection.free_of.size(); ++j) {
    if (selection.free_of[j] >= 0)
      reduced.jacobian.col(selection.free_of[j]) += legs.jacobian.col(static_cast<Eigen::Index>(j));
  }
  reduced.by_pose = legs.by_pose;
  Eigen::Index missing = 0;
  Eigen::MatrixXd by_missing(6, 6);
  for (Eigen::Index i = 0; i < 6; ++i) {
    if (observed[static_cast<std::size_t>(i)]) continue;
    by_missing.col(missing++) = legs.by_pose.col(i);
    reduced.by_pose.col(i).setZero();
  }
  if (missing == 0) return reduced;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(by_missing.leftCols(missing));
  const Eigen::MatrixXd q = qr.householderQ();
  const Eigen::MatrixXd keep = q.rightCols(6 - missing).transpose();
  reduced.residuals = keep * reduced.residuals;
  reduced.jacobian = keep * reduced.jacobian;
  reduced.by_pose = keep * reduced.by_pose;
  return reduced;
}

Matrix6d pose_covariance(const ObservationSet& observations, std::size_t index, const LegNoise& noise) {
  const Vector6d factors = noise_factors(noise);
  return factors.asDiagonal() * observations.covariance(index) * factors.asDiagonal();
}

double NormalEquations::Component::factor(const Eigen::MatrixXd& posterior) const {
  const Eigen::MatrixXd full = information.selfadjointView<Eigen::Lower>();
  const double redundancy = trace - posterior.cwiseProduct(full).sum();
  return redundancy > 1e-6 * trace ? quadratic / redundancy : 1.0;
}

NormalEquations normal_equations(const std::vector<ReducedPose>& reduced, const ObservationSet& observations,
                                 const std::vector<double>& weights, const LegNoise& noise,
                                 const NormalEquationsRequest& request) {
  const Eigen::Index parameters = reduced.empty() ? 0 : reduced[0].jacobian.cols();
  NormalEquations sums;
  sums.information.setZero(parameters, parameters);
  sums.gradient.setZero(parameters);
  for (auto* component : {&sums.leg, &sums.position, &sums.orientation})
    component->information.setZero(parameters, parameters);
  sums.squares_of_pose.resize(reduced.size());
  const bool joint = observations.joint_covariance.size() > 0;

  RowProducts information(sums.information, parameters);
  RowProducts leg_information(sums.leg.information, parameters);
  RowProducts position_information(sums.position.information, parameters);
  RowProducts orientation_information(sums.orientation.information, parameters);
  Eigen::Index rows = 0;
  Eigen::MatrixXd white;
  for (std::size_t i = 0; i < reduced.size(); ++i) {
    const ReducedPose& pose = reduced[i];
    const Eigen::Index m = pose.residuals.size();
    const double root = std::sqrt(weights[i]);
    const Matrix6d noise_of_pose = pose_covariance(observations, i, noise);
    SmallMatrix covariance = pose.by_pose * noise_of_pose * pose.by_pose.transpose();
    covariance.diagonal().array() += leg_variance(noise);
    const Eigen::LLT<SmallMatrix> llt(covariance);
    const SmallVector white_residuals = llt.matrixL().solve(SmallVector(pose.residuals));
    rows += m;
    sums.rows += weights[i] * static_cast<double>(m);
    sums.squares_of_pose[i] = white_residuals.squaredNorm();
    if (joint && !request.information_of_pose) continue;
    white = pose.jacobian;
    llt.matrixL().solveInPlace(white);
    if (request.information_of_pose)
      sums.information_of_pose.push_back(weights[i] * white.transpose() * white);
    if (joint) continue;
    const SmallVector weighted_residuals = root * white_residuals;
    white *= root;
    information.add(white);
    sums.gradient.noalias() += white.transpose() * weighted_residuals;
    sums.squares += weighted_residuals.squaredNorm();
    if (!request.components) continue;
    const SmallMatrix leg_factor = llt.matrixL().solve(noise.leg_sigma_mm * SmallMatrix::Identity(m, m));
    add_component(sums.leg, leg_information, leg_factor, weighted_residuals, white, weights[i]);
    if (!observations.covariance_known) {
      const SmallMatrix factor =
          llt.matrixL().solve(SmallMatrix(pose.by_pose * noise_of_pose.diagonal().cwiseSqrt().asDiagonal()));
      add_component(sums.position, position_information, factor.leftCols(3), weighted_residuals, white,
                    weights[i]);
      add_component(sums.orientation, orientation_information, factor.rightCols(3), weighted_residuals, white,
                    weights[i]);
    }
  }
  if (joint) {
    std::vector<Eigen::Index> starts;
    Eigen::VectorXd residuals(rows);
    Eigen::MatrixXd jacobian(rows, parameters);
    Eigen::Index at = 0;
    double mean_weight = 0;
    for (std::size_t i = 0; i < reduced.size(); ++i) {
      const ReducedPose& pose = reduced[i];
      const Eigen::Index m = pose.residuals.size();
      const double root = std::sqrt(weights[i]);
      starts.push_back(at);
      residuals.segment(at, m) = root * pose.residuals;
      jacobian.middleRows(at, m) = root * pose.jacobian;
      mean_weight += weights[i] / static_cast<double>(reduced.size());
      at += m;
    }
    // A pose's legs depend on that pose only: block by block, of which the lower triangle is enough.
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(rows, rows);
    for (std::size_t i = 0; i < reduced.size(); ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        const Matrix6d block = observations.joint_covariance.block<6, 6>(6 * static_cast<Eigen::Index>(i),
                                                                         6 * static_cast<Eigen::Index>(j));
        const SmallMatrix through = reduced[i].by_pose * block;
        covariance.block(starts[i], starts[j], through.rows(), reduced[j].by_pose.rows()) =
            through.lazyProduct(reduced[j].by_pose.transpose());
      }
    }
    covariance.diagonal().array() += leg_variance(noise);
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(covariance);  // into the covariance itself
    llt.matrixL().solveInPlace(residuals);
    llt.matrixL().solveInPlace(jacobian);
    sums.information.selfadjointView<Eigen::Lower>().rankUpdate(jacobian.transpose());
    sums.gradient = jacobian.transpose() * residuals;
    sums.squares = residuals.squaredNorm();
    if (request.components) {
      // The legs' own part of the covariance, sigma_l^2 I, between C^-1 and C^-1.
      llt.matrixU().solveInPlace(residuals);
      llt.matrixU().solveInPlace(jacobian);
      const double variance = noise.leg_sigma_mm * noise.leg_sigma_mm;
      sums.leg.quadratic = variance * residuals.squaredNorm();
      sums.leg.trace = mean_weight * variance * trace_of_inverse(covariance);
      sums.leg.information.selfadjointView<Eigen::Lower>().rankUpdate(jacobian.transpose(), variance);
    }
  }
  for (RowProducts* products :
       {&information, &leg_information, &position_information, &orientation_information})
    products->flush();
  const Eigen::MatrixXd lower = sums.information;
  sums.information = lower.selfadjointView<Eigen::Lower>();
  return sums;
}

}  // namespace hexcal
