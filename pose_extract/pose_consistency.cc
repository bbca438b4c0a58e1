#include "pose_extract/pose_consistency.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "kinematics/geometry/chi_squared.h"

namespace hexcal {
namespace {

constexpr int kComponentIterations = 100;
// The campaign's common component is used when the photographs disagree by more than chance does so often.
constexpr double kCommonProbability = 0.05;
constexpr double kStandsOutProbability = 1e-5;
// A motion is beyond doubt when the photographs scatter by so much of the noise (squared), and chance does
// not.
constexpr double kMovedFactor = 9;
constexpr double kMovedProbability = 1e-6;
// A photograph that the pose is without, and that shows the body farther off, is another pose's.
constexpr double kOtherPoseMm = 1;
constexpr double kOtherPoseRad = 0.02;

// Variances of the motion between photographs, per axis.
struct Components {
  double mm2 = 0, rad2 = 0;
  [[nodiscard]] Matrix6d covariance() const {
    Vector6d diagonal;
    diagonal << Eigen::Vector3d::Constant(mm2), Eigen::Vector3d::Constant(rad2);
    return diagonal.asDiagonal();
  }
};

using Group = std::vector<const PhotoMotion*>;

int freedom(const Group& group) { return 6 * (static_cast<int>(group.size()) - 1); }

struct GroupFit {
  std::vector<Matrix6d> weights;  // per photograph
  Matrix6d mean_covariance = Matrix6d::Zero();
  Vector6d mean = Vector6d::Zero();
  double chi2 = 0;
};

GroupFit fit_group(const Group& group, const Components& components) {
  GroupFit fit;
  Matrix6d total = Matrix6d::Zero();
  Vector6d right = Vector6d::Zero();
  const Matrix6d motion = components.covariance();
  for (const PhotoMotion* photo : group) {
    // (N^-1 + T)^-1 without inverting N.
    fit.weights.push_back((Matrix6d::Identity() + photo->information * motion).inverse() *
                          photo->information);
    total += fit.weights.back();
    right += fit.weights.back() * photo->motion;
  }
  fit.mean_covariance = total.inverse();
  fit.mean = fit.mean_covariance * right;
  for (std::size_t i = 0; i < group.size(); ++i) {
    const Vector6d off = group[i]->motion - fit.mean;
    fit.chi2 += off.dot(fit.weights[i] * off);
  }
  return fit;
}

double chi2_of(const Group& group, const Components& components) {
  return group.size() < 2 ? 0 : fit_group(group, components).chi2;
}

Components fit_components(const std::vector<const Group*>& groups) {
  // From the scatter as it is, noise and all.
  Components components;
  double count = 0;
  for (const Group* group : groups) {
    for (const PhotoMotion* photo : *group) {
      components.mm2 += photo->motion.head<3>().squaredNorm() / 3;
      components.rad2 += photo->motion.tail<3>().squaredNorm() / 3;
      count += 1;
    }
  }
  if (count == 0) return {};
  components.mm2 = std::max(components.mm2 / count, 1e-16);
  components.rad2 = std::max(components.rad2 / count, 1e-20);
  for (int i = 0; i < kComponentIterations; ++i) {
    double squares_mm = 0, squares_rad = 0, trace_mm = 0, trace_rad = 0;
    for (const Group* group : groups) {
      if (group->size() < 2) continue;
      const GroupFit fit = fit_group(*group, components);
      for (std::size_t p = 0; p < group->size(); ++p) {
        const Matrix6d& w = fit.weights[p];
        const Vector6d along = w * ((*group)[p]->motion - fit.mean);
        const Matrix6d projected = w - w * fit.mean_covariance * w;
        squares_mm += along.head<3>().squaredNorm();
        squares_rad += along.tail<3>().squaredNorm();
        trace_mm += projected.topLeftCorner<3, 3>().trace();
        trace_rad += projected.bottomRightCorner<3, 3>().trace();
      }
    }
    if (!(trace_mm > 0) || !(trace_rad > 0)) break;
    components.mm2 *= std::sqrt(squares_mm / trace_mm);
    components.rad2 *= std::sqrt(squares_rad / trace_rad);
  }
  return components;
}

// The campaign's own component, from epochs that do not stand out; says which do.
Components common_component(const std::vector<Group>& groups, std::vector<EpochConsistency>& epochs) {
  std::vector<std::size_t> order;
  for (std::size_t e = 0; e < groups.size(); ++e) {
    if (groups[e].size() >= 2) order.push_back(e);
  }
  if (order.empty()) return {};
  const auto factor = [&](std::size_t e) { return epochs[e].chi2 / epochs[e].dof; };
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return std::pair(factor(a), a) < std::pair(factor(b), b); });
  // The steadier half to begin with, so that no epoch that moved hides itself or another.
  std::vector<std::size_t> steady(order.begin(),
                                  order.begin() + static_cast<std::ptrdiff_t>((order.size() + 1) / 2));
  Components common;
  for (int i = 0; i < 4; ++i) {
    std::vector<const Group*> chosen;
    double chi2 = 0;
    int dof = 0;
    for (const std::size_t e : steady) {
      chosen.push_back(&groups[e]);
      chi2 += epochs[e].chi2;
      dof += epochs[e].dof;
    }
    common = chi2 > chi2_quantile(dof, kCommonProbability) ? fit_components(chosen) : Components();
    std::vector<std::size_t> still;
    for (const std::size_t e : order) {
      epochs[e].stands_out = chi2_of(groups[e], common) > chi2_quantile(epochs[e].dof, kStandsOutProbability);
      if (!epochs[e].stands_out) still.push_back(e);
    }
    if (still.empty() || still == steady) break;
    steady = std::move(still);
  }
  return common;
}

// Covariance of the mean that the adjustment made of the photographs, weighted by their noise alone, from
// what they scatter beyond it.
Matrix6d excess_of_mean(const Group& group, const Components& components) {
  Matrix6d total = Matrix6d::Zero();
  Matrix6d scatter = Matrix6d::Zero();
  const Matrix6d motion = components.covariance();
  for (const PhotoMotion* photo : group) {
    if (!photo->in_pose) continue;
    total += photo->information;
    scatter += photo->information * motion * photo->information;
  }
  const Matrix6d inverse = total.inverse();
  const Matrix6d excess = inverse * scatter * inverse.transpose();
  return excess.allFinite() ? excess : motion;
}

}  // namespace

CampaignConsistency pose_consistency(const Network& network, const AdjustmentResult& adjusted) {
  CampaignConsistency out;
  out.epochs.resize(static_cast<std::size_t>(network.num_epochs));
  const PhotoMotions photos = photo_motions(network, adjusted);
  std::vector<Group> groups(out.epochs.size());
  for (const PhotoMotion& photo : photos.motions) {
    const bool other_pose = !photo.in_pose && (photo.motion.head<3>().norm() > kOtherPoseMm ||
                                               photo.motion.tail<3>().norm() > kOtherPoseRad);
    if (!other_pose) groups[photo.epoch].push_back(&photo);
  }
  for (std::size_t e = 0; e < groups.size(); ++e) {
    EpochConsistency& epoch = out.epochs[e];
    epoch.photos = static_cast<int>(groups[e].size());
    if (groups[e].size() < 2) continue;
    epoch.dof = freedom(groups[e]);
    epoch.chi2 = chi2_of(groups[e], {});
    epoch.moved =
        epoch.chi2 > std::max(kMovedFactor * epoch.dof, chi2_quantile(epoch.dof, kMovedProbability));
    for (const PhotoMotion* a : groups[e]) {
      for (const PhotoMotion* b : groups[e]) {
        epoch.moved_mm = std::max(epoch.moved_mm, (a->motion - b->motion).head<3>().norm());
        epoch.moved_rad = std::max(epoch.moved_rad, (a->motion - b->motion).tail<3>().norm());
      }
    }
  }
  const Components common = common_component(groups, out.epochs);
  out.common_mm = std::sqrt(common.mm2);
  out.common_rad = std::sqrt(common.rad2);
  for (std::size_t e = 0; e < groups.size(); ++e) {
    EpochConsistency& epoch = out.epochs[e];
    if (groups[e].empty() || !adjusted.geometry.has_body(kMovingBody, static_cast<int>(e))) continue;
    Components components = common;
    if (epoch.stands_out) {
      // Few photographs tell their own scatter badly: the factor keeps the mean square of error over sigma
      // at 1, as Student's t has it with n - 1 of each of three axes.
      const double n = 3.0 * (epoch.photos - 1);
      const Components own = fit_components({&groups[e]});
      components.mm2 = std::max(common.mm2, own.mm2 * n / (n - 2));
      components.rad2 = std::max(common.rad2, own.rad2 * n / (n - 2));
    }
    const Matrix6d back = about_middle(network, adjusted.geometry, e).inverse();
    epoch.excess = back * excess_of_mean(groups[e], components) * back.transpose();
  }
  return out;
}

}  // namespace hexcal
