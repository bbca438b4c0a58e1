#include "kinematics/jacobian.h"

#include <ceres/jet.h>
#include <gmock/gmock.h>

#include <random>

#include "kinematics/forward.h"
#include "kinematics/geometry/covariance.h"
#include "kinematics/screw.h"
#include "tests/support/hexapods.h"
#include "tests/support/rigid_matchers.h"

namespace hexcal {
namespace {

// Pose 6, base joint 3, platform joint 3, offset, scale, lead of one leg.
constexpr int kInputs = 15;
using Jet = ceres::Jet<double, kInputs>;
template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

// The reading of one leg written out from its definition, with the pose perturbed by (dt, dr) = 0 to first
// order.
Jet reading(const PlatformGeometry& g, const Rigid3& pose, std::size_t i) {
  const auto variable = [](double value, int k) { return Jet(value, k); };
  Vector3<Jet> dt, dr, a, b;
  for (int k = 0; k < 3; ++k) {
    dt[k] = variable(0, k);
    dr[k] = variable(0, 3 + k);
    a[k] = variable(g.base_joints_mm[i][k], 6 + k);
    b[k] = variable(g.platform_joints_mm[i][k], 9 + k);
  }
  const Jet offset = variable(g.actuators[i].offset_mm, 12);
  const Jet scale = variable(g.actuators[i].mm_per_unit, 13);
  const Eigen::Matrix<Jet, 3, 3> r = pose.rotation_matrix().cast<Jet>();
  const auto turned = [&dr](const Vector3<Jet>& v) -> Vector3<Jet> { return v + dr.cross(v); };
  const Vector3<Jet> d = turned(r * b) + pose.translation.cast<Jet>() + dt - a;
  const Jet length = sqrt(d.dot(d));
  Jet total = length;
  if (g.screw) {
    const Jet lead = variable(g.screw->lead_mm, 14);
    const Vector3<Jet> u = d / length;
    const Vector3<Jet> nb = g.screw->base_axes[i].cast<Jet>();
    const Vector3<Jet> np = turned(r * g.screw->platform_axes[i].cast<Jet>());
    const Vector3<Jet> across_b = nb - u * u.dot(nb);
    const Vector3<Jet> across_p = np - u * u.dot(np);
    total +=
        lead / (2 * 3.14159265358979323846) * atan2(u.dot(across_b.cross(across_p)), across_b.dot(across_p));
  }
  return (total - offset) / scale;
}

std::vector<std::pair<PlatformGeometry, Rigid3>> cases() {
  std::mt19937_64 random(21);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<std::pair<PlatformGeometry, Rigid3>> all;
  for (PlatformGeometry g : {surrogate_hexapod(), nategh_agheli_hexapod(), jugglebot_hexapod()}) {
    for (int n = 0; n < 40; ++n) {
      g.screw.reset();
      if (n % 2 == 1) g.screw = screw_with_tangential_axes(g, 5 + u(random));
      for (Actuator& actuator : g.actuators) {
        actuator.offset_mm = 20 * u(random);
        actuator.mm_per_unit = 10 + u(random);
      }
      Vector6d away;
      for (Eigen::Index k = 0; k < 6; ++k) away[k] = u(random) * (k < 3 ? 60 : 0.3);
      all.emplace_back(g, perturbed(g.home_B_from_P(), away));
    }
  }
  return all;
}

TEST(Jacobian, OfReadingsEqualsAutomaticDifferentiation) {
  for (const auto& [g, pose] : cases()) {
    const ReadingJacobians j = reading_jacobians(g, pose);
    for (std::size_t i = 0; i < 6; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      const Jet q = reading(g, pose, i);
      Eigen::Matrix<double, kInputs, 1> analytic;
      analytic << j.by_pose.row(k).transpose(), j.by_base.row(k).transpose(),
          j.by_platform.row(k).transpose(), j.by_offset[k], j.by_scale[k], j.by_lead[k];
      EXPECT_NEAR(j.readings[k], q.a, 1e-11);
      EXPECT_LE((analytic - q.v).norm(), 1e-9 * q.v.norm()) << "leg " << i + 1;
    }
  }
}

// Forward kinematics of changed machines against the implicit derivatives.
TEST(Jacobian, OfThePoseTellsWhereForwardKinematicsGoes) {
  for (const auto& [g, named_pose] : cases()) {
    const Rigid3& pose = named_pose;  // clang 14 captures no structured binding
    const PoseJacobians j = pose_jacobians(g, pose);
    const LegVector lengths = actuated_lengths(g, pose);
    const LegVector q = readings_from_lengths(g, lengths);
    const double h = 1e-4;
    const auto moved = [&](const PlatformGeometry& changed) {
      const ForwardResult r = forward_kinematics(changed, lengths_from_readings(changed, q), pose);
      EXPECT_EQ(r.status, ForwardStatus::converged);
      return Vector6d(perturbation_between(pose, *r.B_from_P) / h);
    };
    PlatformGeometry changed = g;
    changed.base_joints_mm[2].y() += h;
    EXPECT_LE((moved(changed) - j.by_base.col(7)).norm(), 1e-4 * j.by_base.col(7).norm());
    changed = g;
    changed.platform_joints_mm[4].x() += h;
    EXPECT_LE((moved(changed) - j.by_platform.col(12)).norm(), 1e-4 * j.by_platform.col(12).norm());
    changed = g;
    changed.actuators[5].mm_per_unit += h;
    EXPECT_LE((moved(changed) - j.by_scale.col(5)).norm(), 1e-3 * j.by_scale.col(5).norm());
    if (!g.screw) continue;
    changed = g;
    changed.screw->lead_mm += h;
    EXPECT_LE((moved(changed) - j.by_lead).norm(), 1e-4 * j.by_lead.norm() + 1e-7);
  }
}

TEST(Screw, ForwardKinematicsUndoesIt) {
  for (const auto& [g, pose] : cases()) {
    const ForwardResult r = forward_kinematics(g, actuated_lengths(g, pose));
    ASSERT_EQ(r.status, ForwardStatus::converged) << r.reason;
    EXPECT_THAT(*r.B_from_P, RigidNear(pose, 1e-9, 1e-9));
  }
}

TEST(Screw, LegsAreNotTwistedAtHome) {
  PlatformGeometry g = surrogate_hexapod();
  g.screw = screw_with_tangential_axes(g, 5);
  EXPECT_LE(leg_twists(g, g.home_B_from_P()).cwiseAbs().maxCoeff(), 1e-12);
  // A turn of the platform about z twists every leg one way, and LinuxCNC's asin gives the same number.
  const Rigid3 turned = g.B_from_P({Eigen::Vector3d::Zero(), {0, 0, 0.2}});
  const LegVector twists = leg_twists(g, turned);
  EXPECT_GT(twists.minCoeff(), 0.05);
  for (std::size_t i = 0; i < 6; ++i) {
    const Eigen::Vector3d u = (turned * g.platform_joints_mm[i] - g.base_joints_mm[i]).normalized();
    const Eigen::Vector3d nb3 = u.cross(g.screw->base_axes[i].cross(u)).normalized();
    const Eigen::Vector3d na2 = (turned.rotation * g.screw->platform_axes[i]).cross(u).normalized();
    EXPECT_NEAR(twists[static_cast<Eigen::Index>(i)], std::asin(nb3.dot(na2)), 1e-12);
  }
}

}  // namespace
}  // namespace hexcal
