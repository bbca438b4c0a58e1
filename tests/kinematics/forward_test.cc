#include "kinematics/forward.h"

#include <gmock/gmock.h>

#include <random>

#include "kinematics/geometry/covariance.h"
#include "tests/support/hexapods.h"
#include "tests/support/rigid_matchers.h"

namespace hexcal {
namespace {

std::array<PlatformGeometry, 3> machines() {
  return {surrogate_hexapod(), nategh_agheli_hexapod(), jugglebot_hexapod()};
}

TEST(Forward, HomeNeedsNoStep) {
  for (const PlatformGeometry& g : machines()) {
    EXPECT_EQ(geometry_fault(g), std::nullopt);
    const ForwardResult r = forward_kinematics(g, leg_lengths(g, g.home_B_from_P()));
    ASSERT_EQ(r.status, ForwardStatus::converged) << r.reason;
    EXPECT_THAT(*r.B_from_P, RigidNear(g.home_B_from_P(), 1e-11, 1e-11));
  }
}

TEST(Forward, FromANeighbourToRounding) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> u(-1, 1);
  for (const PlatformGeometry& g : machines()) {
    for (int n = 0; n < 300; ++n) {
      const Vector6d away = (Vector6d() << u(random) * 60, u(random) * 60, u(random) * 40, u(random) * 0.2,
                             u(random) * 0.2, u(random) * 0.2)
                                .finished();
      const Rigid3 truth = perturbed(g.home_B_from_P(), away);
      const Vector6d near = (Vector6d() << 3 * u(random), 3 * u(random), 3 * u(random), 0.02 * u(random),
                             0.02 * u(random), 0.02 * u(random))
                                .finished();
      const ForwardResult r = forward_kinematics(g, leg_lengths(g, truth), perturbed(truth, near));
      ASSERT_EQ(r.status, ForwardStatus::converged) << r.reason;
      EXPECT_THAT(*r.B_from_P, RigidNear(truth, 1e-10, 1e-10));
      EXPECT_LE(r.iterations, 5);
    }
  }
}

TEST(Forward, FromHomeWithoutAGuess) {
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> u(-1, 1);
  for (const PlatformGeometry& g : machines()) {
    for (int n = 0; n < 300; ++n) {
      const Vector6d away = (Vector6d() << u(random) * 80, u(random) * 80, u(random) * 60, u(random) * 0.3,
                             u(random) * 0.3, u(random) * 0.3)
                                .finished();
      const Rigid3 truth = perturbed(g.home_B_from_P(), away);
      const ForwardResult r = forward_kinematics(g, leg_lengths(g, truth));
      ASSERT_EQ(r.status, ForwardStatus::converged) << r.reason << " " << away.transpose();
      EXPECT_THAT(*r.B_from_P, RigidNear(truth, 1e-9, 1e-9));
    }
  }
}

TEST(Forward, RefusesLengthsThatAreNone) {
  const PlatformGeometry g = surrogate_hexapod();
  LegVector lengths = leg_lengths(g, g.home_B_from_P());
  lengths[2] = std::numeric_limits<double>::quiet_NaN();
  const ForwardResult r = forward_kinematics(g, lengths);
  EXPECT_EQ(r.status, ForwardStatus::failed);
  EXPECT_THAT(r.reason, testing::HasSubstr("leg 3"));
  EXPECT_FALSE(r.B_from_P);
}

}  // namespace
}  // namespace hexcal
