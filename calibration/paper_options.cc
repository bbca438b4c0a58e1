#include "calibration/paper_options.h"

#include <Eigen/SVD>
#include <cassert>
#include <cmath>

#include "kinematics/dh_chain.h"
#include "kinematics/geometry/median.h"

namespace hexcal {
namespace {

struct Sample {
  double target;
  double error;
};

ErrorLine least_squares(const std::vector<Sample>& samples, ErrorCurve curve) {
  ErrorLine line;
  if (samples.empty()) return line;
  const double n = static_cast<double>(samples.size());
  double mean_target = 0;
  double mean_error = 0;
  for (const Sample& s : samples) {
    mean_target += s.target / n;
    mean_error += s.error / n;
  }
  double tt = 0;
  double te = 0;
  for (const Sample& s : samples) {
    tt += (s.target - mean_target) * (s.target - mean_target);
    te += (s.target - mean_target) * (s.error - mean_error);
  }
  // A parameter that never moved (level poses) tells no slope.
  if (curve == ErrorCurve::line && tt > 1e-12 * n * (1.0 + mean_target * mean_target)) line.slope = te / tt;
  line.intercept = mean_error - line.slope * mean_target;
  return line;
}

bool usable(const PoseObservation& pose) { return pose.target && pose.complete() && !pose.is_definition; }

double stiffness_of_weakest_motion(const PlatformGeometry& geometry, const Pose& pose) {
  Matrix6d jacobian = leg_jacobian(geometry, geometry.B_from_P(pose));
  jacobian.rightCols<3>() /= characteristic_length_mm(geometry);
  return Eigen::JacobiSVD<Matrix6d>(jacobian).singularValues()[5];
}

}  // namespace

PaperModel fit_paper_option(const PlatformGeometry& nominal, int option,
                            const std::vector<PoseObservation>& poses, ErrorCurve curve) {
  assert(option >= 1 && option <= 3);
  PaperModel model;
  model.option = option;
  for (std::size_t i = 0; i < 6; ++i) {
    std::vector<Sample> samples;
    for (const PoseObservation& pose : poses) {
      if (!usable(pose)) continue;
      const auto k = static_cast<Eigen::Index>(i);
      samples.push_back({pose.target->vector()[k], pose_error(pose.measured, *pose.target)[k]});
    }
    model.pose_lines[i] = least_squares(samples, curve);
  }
  if (option == 3) return model;
  const std::array<LegChain, 6> chains = leg_chains(nominal);
  std::array<std::array<std::vector<Sample>, 6>, 6> samples;
  for (const PoseObservation& pose : poses) {
    if (!usable(pose)) continue;
    const Rigid3 target = nominal.B_from_P(*pose.target);
    const Matrix6d variables = dh_table(chains, target);
    const Matrix6d errors = dh_error_table(chains, nominal.B_from_P(pose.measured), target);
    for (std::size_t leg = 0; leg < 6; ++leg)
      for (std::size_t i = 0; i < 6; ++i) {
        const auto row = static_cast<Eigen::Index>(leg);
        const auto column = static_cast<Eigen::Index>(i);
        samples[leg][i].push_back({variables(row, column), errors(row, column)});
      }
  }
  for (std::size_t leg = 0; leg < 6; ++leg)
    for (std::size_t i = 0; i < 6; ++i) model.joint_lines[leg][i] = least_squares(samples[leg][i], curve);
  return model;
}

Pose predicted_pose(const PlatformGeometry& nominal, const PaperModel& model, const Pose& target) {
  Pose predicted = target;
  const auto corrected = [&](std::size_t i, double value) {
    return value - (model.pose_lines[i].intercept + model.pose_lines[i].slope * value);
  };
  if (model.option != 1) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      predicted.rpy_rad[k] = corrected(i + 3, target.rpy_rad[k]);
    }
  }
  if (model.option == 3) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      predicted.position_mm[k] = corrected(i, target.position_mm[k]);
    }
    return predicted;
  }
  const std::array<LegChain, 6> chains = leg_chains(nominal);
  const Matrix6d variables = dh_table(chains, nominal.B_from_P(target));
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t leg = 0; leg < 6; ++leg) {
    Vector6d dh = variables.row(static_cast<Eigen::Index>(leg));
    for (std::size_t i = 0; i < 6; ++i) {
      double& value = dh[static_cast<Eigen::Index>(i)];
      value -= model.joint_lines[leg][i].intercept + model.joint_lines[leg][i].slope * value;
    }
    sum += nominal.pose_from_B_from_P(pose_along_leg(chains[leg], dh)).position_mm;
  }
  predicted.position_mm = sum / 6.0;
  return predicted;
}

std::optional<Pose> target_of_command(const PlatformGeometry& nominal, const PaperModel& model,
                                      const Pose& command) {
  // The correction varies slowly with the target: a fixed point contracts by its slope.
  Pose target = command;
  for (int step = 0; step < 200; ++step) {
    const Vector6d excess = pose_error(predicted_pose(nominal, model, target), command);
    if (!excess.allFinite()) return std::nullopt;
    if (excess.cwiseAbs().maxCoeff() < 1e-11) return target;
    target = Pose::from_vector(target.vector() - excess);
  }
  return std::nullopt;
}

std::vector<std::size_t> near_singular_outliers(const PlatformGeometry& nominal,
                                                const std::vector<PoseObservation>& poses,
                                                const NearSingularRule& rule) {
  std::vector<std::size_t> indices;
  std::vector<double> stiffness;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!usable(poses[i])) continue;
    indices.push_back(i);
    stiffness.push_back(stiffness_of_weakest_motion(nominal, *poses[i].target));
  }
  std::vector<std::size_t> out;
  if (indices.size() < 5) return out;
  Vector6d center;
  Vector6d sigma;
  for (Eigen::Index k = 0; k < 6; ++k) {
    std::vector<double> errors;
    for (const std::size_t i : indices) errors.push_back(pose_error(poses[i].measured, *poses[i].target)[k]);
    center[k] = median(errors);
    for (double& error : errors) error = std::abs(error - center[k]);
    sigma[k] = 1.4826 * median(errors);
  }
  const double typical = median(stiffness);
  for (std::size_t n = 0; n < indices.size(); ++n) {
    const PoseObservation& pose = poses[indices[n]];
    const Vector6d off = (pose_error(pose.measured, *pose.target) - center).cwiseAbs();
    const bool far_out = (off.array() > rule.outlier_sigmas * sigma.array() + 1e-12).any();
    if (far_out && stiffness[n] < rule.near_singular_share * typical) out.push_back(indices[n]);
  }
  return out;
}

}  // namespace hexcal
