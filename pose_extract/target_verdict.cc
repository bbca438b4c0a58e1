#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "kinematics/geometry/nearest_name.h"
#include "kinematics/geometry/nearest_rotation.h"
#include "pose_extract/pose_verdict.h"

namespace hexcal {
namespace {

// A pose fits a place so many times better: machines are wrong by centimetres, but neighbouring poses not in
// opposite directions.
constexpr double kFitsBetter = 3;
constexpr double kLeverMm = 100;      // what a radian of rotation counts for
constexpr double kLeastTurnDeg = 20;  // frames are turned by slips of 90 and 180 deg, machines by a few
constexpr double kNearQuarterDeg = 15;
constexpr std::size_t kFewestPoses = 3;
// Two poses of which one's photographs lie in both folders differ by the measurement's noise only.
constexpr double kSamePoseMm = 0.05;

double pose_gap_mm(const Pose& a, const Pose& b) {
  const Rigid3 between = inverse(home_from_lg(a)) * home_from_lg(b);
  return (a.position_mm - b.position_mm).norm() +
         kLeverMm * rotation_vector_from_quaternion(between.rotation).norm();
}

void judge_names(const std::map<std::string, Pose>& commanded, CampaignResult& result) {
  std::vector<std::string> without_target;
  for (const MeasuredPose& pose : result.poses) {
    if (commanded.count(pose.id) == 0) without_target.push_back(pose.id);
  }
  for (const auto& [id, target] : commanded) {
    if (std::ranges::find(result.poses, id, &MeasuredPose::id) != result.poses.end()) continue;
    if (const auto meant = nearest_name(id, without_target)) {
      result.findings.emplace_back(
          fmt::format("target {} has no photographs, and pose {} has no target", id, *meant),
          fmt::format("did you mean {0}? Give folder and target one name", *meant));
    }
  }
}

// Both together in one space: positions and, as arcs, rotation vectors; a column per pose.
struct Motions {
  Eigen::Matrix3Xd positions_mm, arcs_mm;
};

Motions motions_of(const std::vector<Pose>& poses) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  Motions motions{Eigen::Matrix3Xd(3, n), Eigen::Matrix3Xd(3, n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const Pose& pose = poses[static_cast<std::size_t>(i)];
    motions.positions_mm.col(i) = pose.position_mm;
    motions.arcs_mm.col(i) = kLeverMm * rotation_vector_from_quaternion(quaternion_from_rpy(pose.rpy_rad));
  }
  return motions;
}

// Rotation (or, `mirrored`, rotation with a reflection) that takes the columns of `from` nearest to those of
// `to` (Kabsch 1976).
Eigen::Matrix3d best_turn(const Eigen::Matrix3d& to_from, bool mirrored) {
  return mirrored ? Eigen::Matrix3d(-nearest_rotation(-to_from)) : nearest_rotation(to_from);
}

// True if targets and measured poses are the same motions seen from axes that are turned or mirrored.
bool judge_axes(const std::map<std::string, Pose>& commanded, CampaignResult& result) {
  std::vector<Pose> targets, measured;
  for (const MeasuredPose& pose : result.poses) {
    const auto target = commanded.find(pose.id);
    if (!pose.pose || target == commanded.end()) continue;
    targets.push_back(target->second);
    measured.push_back(*pose.pose);
  }
  if (targets.size() < kFewestPoses) return false;
  const Motions t = motions_of(targets);
  const Motions m = motions_of(measured);
  const Eigen::Matrix3d positions = m.positions_mm * t.positions_mm.transpose();
  const Eigen::Matrix3d turn = best_turn(positions + m.arcs_mm * t.arcs_mm.transpose(), false);
  const double as_they_are =
      (m.positions_mm - t.positions_mm).squaredNorm() + (m.arcs_mm - t.arcs_mm).squaredNorm();
  const double turned =
      (m.positions_mm - turn * t.positions_mm).squaredNorm() + (m.arcs_mm - turn * t.arcs_mm).squaredNorm();
  const Eigen::AngleAxisd rotation(turn);
  // Rounded as it is printed; plus zero, so that no -0.00 is.
  const Eigen::Vector3d axis =
      (rotation.axis() * 100).array().round().matrix() / 100 + Eigen::Vector3d::Zero();
  if (rotation.angle() * kDegPerRad > kLeastTurnDeg && kFitsBetter * kFitsBetter * turned < as_they_are) {
    // Frames are exchanged by quarter turns; what is left beside one is the machine's own error.
    const double angle_deg = rotation.angle() * kDegPerRad;
    const double quarters_deg = 90 * std::round(angle_deg / 90);
    result.findings.emplace_back(
        fmt::format(
            "the measured poses are the commanded ones turned by {:.0f} deg about ({:.2f}, {:.2f}, {:.2f}): "
            "the axes of frame UG in campaign.yaml and those of the targets disagree",
            std::abs(angle_deg - quarters_deg) < kNearQuarterDeg ? quarters_deg : angle_deg, axis.x(),
            axis.y(), axis.z()),
        "find out which of the two is right and correct frames.UG (its file of nominal coordinates; hexcal "
        "init "
        "says what to write for UG from markers) or the targets",
        Severity::bad);
    return true;
  }
  const Eigen::Matrix3d mirror = best_turn(positions, true);
  const double off = (m.positions_mm - t.positions_mm).squaredNorm();
  const double mirrored = (m.positions_mm - mirror * t.positions_mm).squaredNorm();
  const double unmirrored = (m.positions_mm - best_turn(positions, false) * t.positions_mm).squaredNorm();
  const double factor = kFitsBetter * kFitsBetter;
  if (factor * mirrored < off && factor * mirrored < unmirrored) {
    result.findings.emplace_back(
        "the measured positions are the mirror image of the commanded ones: an axis has the other sign, or "
        "the "
        "frame of the targets is left-handed",
        "find the coordinate with the wrong sign in the targets or in the nominal coordinates of UG",
        Severity::bad);
    return true;
  }
  return false;
}

void judge_places(const std::map<std::string, Pose>& commanded, CampaignResult& result) {
  std::vector<MeasuredPose>& poses = result.poses;
  std::vector<const Pose*> targets;
  for (const MeasuredPose& pose : poses) {
    const auto target = commanded.find(pose.id);
    targets.push_back(!pose.pose || target == commanded.end() ? nullptr : &target->second);
  }
  const auto gap = [&](std::size_t measured, std::size_t target) {
    return pose_gap_mm(*poses[measured].pose, *targets[target]);
  };
  for (std::size_t i = 0; i < poses.size(); ++i) {
    for (std::size_t j = i + 1; j < poses.size(); ++j) {
      if (targets[i] == nullptr || targets[j] == nullptr) continue;
      const std::string& a = poses[i].id;
      const std::string& b = poses[j].id;
      if (kFitsBetter * (gap(i, j) + gap(j, i)) < gap(i, i) + gap(j, j)) {
        result.findings.emplace_back(
            fmt::format("{} and {} look swapped: each lies where the other was commanded to", a, b),
            fmt::format("exchange the two folders {} and {}", a, b), Severity::bad);
        suspect(poses[i], fmt::format("swapped with {}?", b));
        suspect(poses[j], fmt::format("swapped with {}?", a));
        continue;
      }
      const double sigma_mm = std::sqrt(std::max(poses[i].covariance.topLeftCorner<3, 3>().trace(),
                                                 poses[j].covariance.topLeftCorner<3, 3>().trace()));
      const double same_mm = kSamePoseMm + kContradictionSigmas * sigma_mm;
      if (pose_gap_mm(*poses[i].pose, *poses[j].pose) > same_mm ||
          pose_gap_mm(*targets[i], *targets[j]) < 10 * same_mm)
        continue;
      const std::size_t wrong = gap(i, i) > gap(j, j) ? i : j;
      const std::string& other = poses[wrong == i ? j : i].id;
      result.findings.emplace_back(
          fmt::format("{} and {} are the same measured pose, but were commanded to different ones", a, b),
          fmt::format("look whether the photographs of {} are those of {}", poses[wrong].id, other),
          Severity::bad);
      suspect(poses[wrong], fmt::format("stands where {} does", other));
    }
  }
}

}  // namespace

void judge_against_targets(const std::map<std::string, Pose>& commanded, CampaignResult& result) {
  judge_names(commanded, result);
  if (!judge_axes(commanded, result)) {
    judge_places(commanded, result);
    if (!judge_origin(commanded, result)) judge_target_steps(commanded, result);
    return;
  }
  for (MeasuredPose& pose : result.poses) {
    if (pose.pose) suspect(pose, "its axes are not those of the targets");
  }
}

}  // namespace hexcal
