#include <fmt/format.h>

#include <Eigen/QR>
#include <cmath>

#include "pose_extract/pose_verdict.h"

namespace hexcal {
namespace {

constexpr double kStepLeverMm = 50;           // what an angle counts as
constexpr std::size_t kFewestBesideStep = 3;  // poses on either side
constexpr int kFewestStepFreedom = 8;
// The step must halve what is left, and stand out from it.
constexpr double kStepShare = 0.25;
constexpr double kStepRatio = 12;

// LG's origin is elsewhere in the targets: so far, and so many times better they fit then.
constexpr double kLeastOriginMm = 10;
constexpr double kOriginFitsBetter = 10;
constexpr std::size_t kFewestForOrigin = 4;

struct TargetError {
  std::size_t epoch;
  Pose commanded;
  Vector6d error;  // mm
};

// Errors of the poses that have a target, in the order in which they were photographed.
std::vector<TargetError> target_errors(const std::map<std::string, Pose>& commanded,
                                       const CampaignResult& result) {
  std::vector<TargetError> errors;
  for (const std::size_t e : result.order) {
    const MeasuredPose& pose = result.poses[e];
    const auto target = commanded.find(pose.id);
    // What the home is off by, all others share.
    const bool home = static_cast<int>(e) == result.home_epoch;
    if (home || !pose.pose || target == commanded.end()) continue;
    Vector6d error = pose_error(*pose.pose, target->second);
    error.tail<3>() *= kStepLeverMm;
    errors.push_back({e, target->second, error});
  }
  return errors;
}

}  // namespace

void judge_target_steps(const std::map<std::string, Pose>& commanded, CampaignResult& result) {
  const std::vector<TargetError> errors = target_errors(commanded, result);
  const auto n = static_cast<Eigen::Index>(errors.size());
  // A machine's own error is nearly linear over a small workspace.
  const Eigen::Index smooth = n - 8 >= kFewestStepFreedom ? 7 : 4;
  if (n - smooth - 1 < kFewestStepFreedom) return;
  Eigen::MatrixXd x(n, smooth);
  Eigen::MatrixXd y(n, 6);
  for (Eigen::Index i = 0; i < n; ++i) {
    const TargetError& at = errors[static_cast<std::size_t>(i)];
    x(i, 0) = 1;
    x.block<1, 3>(i, 1) = at.commanded.position_mm.transpose();
    if (smooth == 7) x.block<1, 3>(i, 4) = kStepLeverMm * at.commanded.rpy_rad.transpose();
    y.row(i) = at.error.transpose();
  }
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> fit(x);
  const auto left_of = [&](const Eigen::MatrixXd& values) -> Eigen::MatrixXd {
    return values - x * fit.solve(values);
  };
  const Eigen::MatrixXd left = left_of(y);
  double most = 0;
  Eigen::Index at = -1;
  Vector6d step = Vector6d::Zero();
  for (auto k = static_cast<Eigen::Index>(kFewestBesideStep);
       k + static_cast<Eigen::Index>(kFewestBesideStep) <= n; ++k) {
    Eigen::VectorXd after = Eigen::VectorXd::Zero(n);
    after.tail(n - k).setOnes();
    const Eigen::VectorXd own = left_of(after);
    const double square = own.squaredNorm();
    if (square < 0.5) continue;
    const Vector6d size = (own.transpose() * left).transpose() / square;
    const double gain = size.squaredNorm() * square;
    if (gain <= most) continue;
    most = gain;
    at = k;
    step = size;
  }
  if (at < 0) return;
  const double rest = left.squaredNorm() - most;
  const auto freedom = static_cast<double>(n - fit.rank() - 1);
  if (rest > kStepShare * left.squaredNorm() || most < kStepRatio * rest / freedom) return;
  const std::size_t before = errors[static_cast<std::size_t>(at - 1)].epoch;
  const std::size_t after = errors[static_cast<std::size_t>(at)].epoch;
  // What the measurement cannot tell from its noise is no step.
  const Vector6d sigma = result.poses[after].covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  if (step.head<3>().norm() < kContradictionSigmas * sigma.head<3>().norm()) return;
  const std::string words = fmt::format(
      "a grip or the base moved between {} and {} by {:.2g} mm: from there on the poses lie "
      "otherwise "
      "against "
      "the commanded ones",
      result.poses[before].id, result.poses[after].id, step.head<3>().norm());
  result.findings.emplace_back(
      words,
      fmt::format("fasten the grips and take the poses from {} on again, with the home",
                  result.poses[after].id),
      Severity::bad);
  for (Eigen::Index i = at; i < n; ++i)
    suspect(result.poses[errors[static_cast<std::size_t>(i)].epoch], words);
}

bool judge_origin(const std::map<std::string, Pose>& commanded, CampaignResult& result) {
  const std::vector<TargetError> errors = target_errors(commanded, result);
  if (errors.size() < kFewestForOrigin) return false;
  // A body that turns about another point than the one that the targets mean: error = (R - 1) c.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double before = 0;
  for (const TargetError& at : errors) {
    const Eigen::Matrix3d a = home_from_lg(at.commanded).rotation_matrix() - Eigen::Matrix3d::Identity();
    normal += a.transpose() * a;
    right += a.transpose() * at.error.head<3>();
    before += at.error.head<3>().squaredNorm();
  }
  const Eigen::Vector3d c = Eigen::CompleteOrthogonalDecomposition<Eigen::Matrix3d>(normal).solve(right);
  const double after = before - right.dot(c);
  if (c.norm() < kLeastOriginMm || !(kOriginFitsBetter * kOriginFitsBetter * after < before)) return false;
  const std::string words = fmt::format(
      "the poses fit the commanded ones if LG's origin lies elsewhere by ({:.0f}, {:.0f}, {:.0f}) mm",
      c.x() + 0.0, c.y() + 0.0, c.z() + 0.0);
  result.findings.emplace_back(
      words, "compare frames.LG.gd_mm, and the origins of UG and LG, with the point that the targets mean",
      Severity::bad);
  for (MeasuredPose& pose : result.poses) {
    if (pose.pose) suspect(pose, words);
  }
  return true;
}

}  // namespace hexcal
