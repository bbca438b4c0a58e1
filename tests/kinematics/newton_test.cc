#include "kinematics/newton.h"

#include <gmock/gmock.h>

#include <Eigen/LU>
#include <random>

#include "kinematics/geometry/covariance.h"
#include "kinematics/leg_elimination.h"
#include "kinematics/screw.h"
#include "tests/support/hexapods.h"
#include "tests/support/rigid_matchers.h"

namespace hexcal {
namespace {

Matrix6d random_matrix(std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(-1, 1);
  Matrix6d m;
  for (Eigen::Index k = 0; k < 36; ++k) m(k) = u(random) * (k < 18 ? 1 : 100);
  return m;
}

LegElimination::Columns columns_of(const Matrix6d& m) {
  LegElimination::Columns columns;
  for (std::size_t k = 0; k < 6; ++k) columns[k] = m.col(static_cast<Eigen::Index>(k)).array();
  return columns;
}

TEST(LegElimination, EqualsTheLuDecomposition) {
  std::mt19937_64 random(17);
  for (int n = 0; n < 200; ++n) {
    const Matrix6d m = random_matrix(random);
    if (std::abs(m.determinant()) < 1e4) continue;
    const Vector6d x = random_matrix(random).col(0);
    LegElimination elimination;
    if (!elimination.factor(columns_of(m))) continue;
    EXPECT_NEAR(elimination.determinant() / m.determinant(), 1, 1e-9);
    EXPECT_LE((elimination.solve((m * x).array()) - x).norm(), 1e-7);
  }
}

TEST(LegElimination, PutsLegsThatSpanSpaceFirst) {
  std::mt19937_64 random(18);
  Matrix6d m = random_matrix(random);
  // Legs 1, 3, 5 parallel, and legs 2, 4, 6 in a plane.
  for (const Eigen::Index i : {0, 2, 4}) m.row(i).head<3>() << 0.1, 0.2, 1;
  for (const Eigen::Index i : {1, 3, 5}) m(i, 2) = 0;
  LegElimination elimination;
  EXPECT_FALSE(elimination.factor(columns_of(m)));
  const LegOrder order = LegElimination::spanning_order(columns_of(m));
  Matrix6d ordered;
  for (std::size_t lane = 0; lane < 6; ++lane)
    ordered.row(static_cast<Eigen::Index>(lane)) = m.row(order[lane]);
  EXPECT_TRUE(elimination.factor(columns_of(ordered)));
  EXPECT_NEAR(elimination.determinant() / m.determinant(), is_odd(order) ? -1 : 1, 1e-9);
  const Vector6d x = random_matrix(random).col(0);
  EXPECT_LE((elimination.solve(in_order((m * x).array(), order)) - x).norm(), 1e-9);
}

// Three columns and three sideways struts, in the order in which the usual first three are the columns.
PlatformGeometry column_hexapod() {
  PlatformGeometry g;
  const std::array<Eigen::Vector3d, 6> ends{
      {{100, 0, 0}, {0, 80, 0}, {-50, 86, 0}, {0, -80, 0}, {-50, -86, 0}, {90, 10, 0}}};
  const std::array<Eigen::Vector3d, 6> ways{
      {{0, 0, 400}, {400, 0, 0}, {0, 0, 400}, {400, 0, 0}, {0, 0, 400}, {0, 400, 0}}};
  for (std::size_t i = 0; i < 6; ++i) {
    g.platform_joints_mm[i] = ends[i];
    g.base_joints_mm[i] = ends[i] + Eigen::Vector3d(0, 0, 400) - ways[i];
    g.actuators[i] = {0, 1, 300, 500};
  }
  g.B_from_UG = Rigid3::from_translation({0, 0, 400});
  return g;
}

TEST(Newton, SolvesAMachineWhoseUsualFirstLegsAreParallel) {
  const PlatformGeometry g = column_hexapod();
  ASSERT_EQ(geometry_fault(g), std::nullopt);
  const LegArray legs(g);
  std::mt19937_64 random(19);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int n = 0; n < 100; ++n) {
    Vector6d away;
    for (Eigen::Index k = 0; k < 6; ++k) away[k] = u(random) * (k < 3 ? 20 : 0.1);
    const Rigid3 truth = perturbed(g.home_B_from_P(), away);
    for (const Rigid3& start : {g.home_B_from_P(), truth}) {
      const NewtonResult r = newton(legs, leg_lengths(legs, truth), start);
      ASSERT_TRUE(r.converged);
      EXPECT_THAT(r.B_from_P, RigidNear(truth, 1e-11, 1e-11));
      EXPECT_GT(r.determinant * leg_jacobian(g, truth).determinant(), 0);
    }
  }
  PlatformGeometry screwed = g;
  screwed.screw = screw_with_tangential_axes(g, 4);
  const Rigid3 truth = perturbed(g.home_B_from_P(), (Vector6d() << 9, -7, 5, 0.05, 0.04, -0.06).finished());
  const NewtonResult r =
      newton_with_screws(screwed, actuated_lengths(screwed, truth), screwed.home_B_from_P());
  ASSERT_TRUE(r.converged);
  EXPECT_THAT(r.B_from_P, RigidNear(truth, 1e-11, 1e-11));
}

// The bench's problem: from 5 mm and 2 deg away, by two Jacobians, to 1e-12 mm.
TEST(Newton, TwoJacobiansLeadHomeFromANeighbour) {
  const PlatformGeometry g = nategh_agheli_hexapod();
  const LegArray legs(g);
  std::mt19937_64 random(20);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int n = 0; n < 300; ++n) {
    Vector6d away;
    for (Eigen::Index k = 0; k < 6; ++k) away[k] = u(random) * (k < 3 ? 80 : 0.2);
    const Rigid3 truth = perturbed(g.home_B_from_P(), away);
    Vector6d near;
    for (double& x : near) x = u(random);
    near.head<3>() *= 5 / near.head<3>().norm();
    near.tail<3>() *= 2 * kRadPerDeg / near.tail<3>().norm();
    const NewtonResult r = newton(legs, leg_lengths(legs, truth), perturbed(truth, near));
    ASSERT_TRUE(r.converged);
    EXPECT_EQ(r.iterations, 2);
    EXPECT_LE((r.B_from_P.translation - truth.translation).norm(), 2e-12);  // the lengths are rounded too
  }
}

TEST(Newton, NeverClaimsToHaveConvergedWhereLegsDoNotMeet) {
  const PlatformGeometry g = nategh_agheli_hexapod();
  LegVector lengths = leg_lengths(g, g.home_B_from_P());
  lengths[0] = 3000;
  EXPECT_FALSE(newton(LegArray(g), lengths, g.home_B_from_P()).converged);
}

}  // namespace
}  // namespace hexcal
