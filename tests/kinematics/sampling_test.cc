#include "kinematics/sampling.h"

#include <gmock/gmock.h>

#include "kinematics/forward.h"
#include "kinematics/geometry/input_error.h"
#include "tests/support/hexapods.h"
#include "tests/support/rigid_matchers.h"

namespace hexcal {
namespace {

TEST(Sampling, EveryPoseKeepsItsMargins) {
  for (const PlatformGeometry& g : {surrogate_hexapod(), nategh_agheli_hexapod(), jugglebot_hexapod()}) {
    for (const SampleKind kind : {SampleKind::uniform, SampleKind::halton, SampleKind::load_paths}) {
      SampleOptions options;
      options.kind = kind;
      options.count = 34;
      // The Jugglebot's home is 1 mm from its lower stops.
      options.margins = {.stroke_mm = 0.5, .joint_rad = 2 * kRadPerDeg, .singular_mm = 6};
      const SampleResult result = sample_poses(g, options);
      ASSERT_EQ(result.poses.size(), 34u);
      for (const Pose& pose : result.poses) {
        const InverseResult r = inverse_kinematics(g, g.B_from_P(pose));
        EXPECT_TRUE(r.reachable()) << reason(r);
        EXPECT_GE(r.stroke_margin_mm, 0.5);
        EXPECT_GE(r.joint_margin_rad, 2 * kRadPerDeg);
        EXPECT_GE(r.singularity->distance_mm, 6);
      }
    }
  }
}

TEST(Sampling, SameSeedSamePoses) {
  const PlatformGeometry g = surrogate_hexapod();
  for (const SampleKind kind : {SampleKind::uniform, SampleKind::halton, SampleKind::load_paths}) {
    SampleOptions options;
    options.kind = kind;
    options.count = 10;
    const SampleResult a = sample_poses(g, options);
    const SampleResult b = sample_poses(g, options);
    options.seed = 2;
    const SampleResult c = sample_poses(g, options);
    EXPECT_EQ(a.poses[7].vector(), b.poses[7].vector());
    EXPECT_NE(a.poses[7].vector(), c.poses[7].vector());
  }
}

TEST(Sampling, LoadPathsMoveWhatTheyName) {
  const PlatformGeometry g = surrogate_hexapod();
  SampleOptions options;
  options.kind = SampleKind::load_paths;
  options.combine = false;
  options.load_paths = {LoadPath::tension};
  for (const Pose& pose : sample_poses(g, options).poses) {
    EXPECT_LE(pose.position_mm.z(), 0);  // LG hangs below UG: pulling moves it down
    EXPECT_EQ(pose.rpy_rad.norm(), 0);
    EXPECT_FALSE(std::signbit(pose.rpy_rad.z())) << "a zero is written without a sign";
  }
  options.load_paths = {LoadPath::torsion, LoadPath::bending_x};
  options.combine = true;
  bool combined = false;
  for (const Pose& pose : sample_poses(g, options).poses) {
    EXPECT_EQ(pose.position_mm.norm(), 0);
    EXPECT_EQ(pose.rpy_rad.y(), 0);
    combined = combined || (pose.rpy_rad.x() != 0 && pose.rpy_rad.z() != 0);
  }
  EXPECT_TRUE(combined);
}

TEST(Sampling, StopsWhenThereIsNothing) {
  PlatformGeometry g = surrogate_hexapod();
  for (Actuator& a : g.actuators) a = {0, 1, 600, 601};
  SampleOptions options;
  options.count = 5;
  options.largest_tries = 1000;
  EXPECT_TRUE(sample_poses(g, options).poses.empty());
  options.kind = SampleKind::load_paths;
  EXPECT_TRUE(sample_poses(g, options).poses.empty());
}

TEST(Sampling, RefusesOptionsByName) {
  SampleOptions options;
  options.margins.stroke_mm = -1;
  EXPECT_THROW(options.validate(), InputError);
  options = {};
  options.load_fraction = 1.5;
  EXPECT_THROW(options.validate(), InputError);
}

// The smaller version of the bench's 100 000 poses per machine.
TEST(Forward, FindsEveryPoseOfTheWorkspaceFromHome) {
  for (const PlatformGeometry& g : {surrogate_hexapod(), nategh_agheli_hexapod(), jugglebot_hexapod()}) {
    SampleOptions options;
    options.kind = SampleKind::uniform;
    options.count = 400;
    for (const Pose& pose : sample_poses(g, options).poses) {
      const Rigid3 truth = g.B_from_P(pose);
      const ForwardResult r = forward_kinematics(g, leg_lengths(g, truth), {.enforce_limits = true});
      if (r.status == ForwardStatus::singular) continue;
      ASSERT_EQ(r.status, ForwardStatus::converged) << r.reason;
      EXPECT_THAT(*r.B_from_P, RigidNear(truth, 1e-9, 1e-11 * kDegPerRad));
    }
  }
}

}  // namespace
}  // namespace hexcal
