#include "kinematics/workspace.h"

#include <gmock/gmock.h>

#include "kinematics/screw.h"
#include "tests/support/hexapods.h"

namespace hexcal {
namespace {

TEST(Workspace, SliceAgreesWithTheVerdictsAndTheThreads) {
  const PlatformGeometry g = surrogate_hexapod();
  SliceOptions options;
  options.axis_u = 0;
  options.axis_v = 2;
  options.u_low = -150;
  options.u_high = 150;
  options.v_low = -100;
  options.v_high = 120;
  options.u_count = 31;
  options.v_count = 23;
  const std::vector<SliceCell> one = workspace_slice(g, options);
  options.threads = 3;
  const std::vector<SliceCell> three = workspace_slice(g, options);
  ASSERT_EQ(one.size(), 31u * 23u);
  for (std::size_t n = 0; n < one.size(); ++n) {
    EXPECT_EQ(one[n].verdict, three[n].verdict);
    EXPECT_EQ(one[n].pose.vector(), three[n].pose.vector());
  }
  // Cell (15, 10) is home: u fast, v slow.
  EXPECT_EQ(one[10 * 31 + 15].pose.vector(), Vector6d::Zero().eval());
  EXPECT_EQ(one[10 * 31 + 15].verdict, PoseVerdict::reachable);
  EXPECT_EQ(one[0].verdict, PoseVerdict::too_short);
}

TEST(Workspace, LargestBoxIsValidAndCannotGrow) {
  const PlatformGeometry g = surrogate_hexapod();
  const RestState rest(g);
  const ConstantOrientationBox box = largest_box(g);
  ASSERT_TRUE(box.found);
  EXPECT_GT(box.volume_mm3(), 1e6);
  const auto all_valid = [&](const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) {
    for (int n = 0; n < 9 * 9 * 9; ++n) {
      const Eigen::Vector3d part(n % 9 / 8.0, n / 9 % 9 / 8.0, n / 81 / 8.0);
      if (!is_valid(g, rest, {lower + part.cwiseProduct(upper - lower), Eigen::Vector3d::Zero()}))
        return false;
    }
    return true;
  };
  EXPECT_TRUE(all_valid(box.lower_mm, box.upper_mm));
  for (int k = 0; k < 3; ++k) {
    Eigen::Vector3d more = box.upper_mm;
    more[k] += 1;
    EXPECT_FALSE(all_valid(box.lower_mm, more)) << k;
    more = box.lower_mm;
    more[k] -= 1;
    EXPECT_FALSE(all_valid(more, box.upper_mm)) << k;
  }
}

TEST(Workspace, NoBoxWhereHomeIsNotValid) {
  BoxOptions options;
  options.margins.stroke_mm = 300;
  EXPECT_FALSE(largest_box(surrogate_hexapod(), options).found);
}

// Every failure has a name.
TEST(GeometryFault, NamesWhatNoMachineCanHave) {
  const auto fault = [](auto change) {
    PlatformGeometry g = surrogate_hexapod();
    change(g);
    return geometry_fault(g).value_or("");
  };
  using testing::HasSubstr;
  using G = PlatformGeometry;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(fault([](G&) {}), "");
  EXPECT_THAT(fault([](G& g) { g.base_joints_mm[2].y() = kNan; }), HasSubstr("leg 3: base joint"));
  EXPECT_THAT(fault([](G& g) { g.actuators[1].max_mm = 10; }), HasSubstr("leg 2: max_mm"));
  EXPECT_THAT(fault([](G& g) { g.actuators[1].min_mm = 0; }), HasSubstr("leg 2: min_mm"));
  EXPECT_THAT(fault([](G& g) { g.actuators[0].mm_per_unit = 0; }), HasSubstr("mm_per_unit is zero"));
  EXPECT_THAT(fault([](G& g) { g.actuators[3].offset_mm = kNan; }),
              HasSubstr("leg 4: offset_mm or mm_per_unit is not finite"));
  EXPECT_THAT(fault([](G& g) { g.P_from_LG.translation.z() = kNan; }),
              HasSubstr("B_from_UG or P_from_LG is not finite"));
  EXPECT_THAT(fault([](G& g) { g.gd_mm = kNan; }), HasSubstr("gd_mm"));
  EXPECT_THAT(fault([](G& g) { g.leg_radius_mm = -1; }), HasSubstr("radius"));
  EXPECT_THAT(fault([](G& g) { g.min_gap_mm = g.gd_mm + 1; }), HasSubstr("min_gap_mm"));
  EXPECT_THAT(fault([](G& g) { g.joint_limits->base_rad = 0; }), HasSubstr("base joints' limit"));
  EXPECT_THAT(fault([](G& g) { g.joint_limits->platform_rad = 0; }), HasSubstr("platform joints' limit"));
  EXPECT_THAT(fault([](G& g) {
                g.joint_limits->base_axes_rad = {0.5, 0};
              }),
              HasSubstr("the limits about the base joints' axes must be greater than zero"));
  EXPECT_THAT(fault([](G& g) { g.screw = screw_with_tangential_axes(g, kNan); }), HasSubstr("lead"));
  EXPECT_THAT(fault([](G& g) {
                g.screw = screw_with_tangential_axes(g, 5);
                g.screw->base_axes[1] *= 2;
              }),
              HasSubstr("leg 2: the screw's base axis has no length 1"));
  EXPECT_THAT(fault([](G& g) {
                g.screw = screw_with_tangential_axes(g, 5);
                g.screw->platform_axes[5].setZero();
              }),
              HasSubstr("leg 6: the screw's platform axis has no length 1"));
  EXPECT_THAT(fault([](G& g) { g.platform_joints_mm.fill(Eigen::Vector3d(1, 2, 3)); }),
              HasSubstr("all platform joints coincide"));
  EXPECT_THAT(fault([](G& g) {
                g.base_joints_mm[4] = g.base_joints_mm[0];
                g.platform_joints_mm[4] = g.platform_joints_mm[0];
              }),
              HasSubstr("legs 1 and 5 have the same joints"));
  EXPECT_THAT(fault([](G& g) {
                for (std::size_t i = 0; i < 6; ++i) g.base_joints_mm[i] = {static_cast<double>(i) * 50, 0, 0};
              }),
              HasSubstr("one line"));
  EXPECT_THAT(fault([](G& g) { g.base_joints_mm[2] = g.home_B_from_P() * g.platform_joints_mm[2]; }),
              HasSubstr("leg 3: has no length at home"));
  // Similar hexagons move freely in every pose.
  EXPECT_THAT(fault([](G& g) {
                for (std::size_t i = 0; i < 6; ++i) g.platform_joints_mm[i] = 0.5 * g.base_joints_mm[i];
              }),
              HasSubstr("architecture singularity"));
  // Also when they are written with three decimals.
  EXPECT_THAT(fault([](G& g) {
                for (std::size_t i = 0; i < 6; ++i) {
                  g.base_joints_mm[i] = 1e-3 * (1e3 * g.base_joints_mm[i]).array().round().matrix();
                  g.platform_joints_mm[i] = 1e-3 * (500 * g.base_joints_mm[i]).array().round().matrix();
                }
              }),
              HasSubstr("architecture singularity"));
  // A quarter turn at home: singular there only.
  EXPECT_THAT(
      fault([](G& g) {
        g.B_from_UG = g.B_from_UG * Rigid3::from_rotation(quaternion_from_rpy({0, 0, 90 * kRadPerDeg}));
      }),
      HasSubstr("home is a singular pose"));
}

TEST(GeometryFault, SharedJointsAreNoFault) {
  PlatformGeometry g = surrogate_hexapod();
  for (std::size_t i = 0; i < 6; ++i)
    g.platform_joints_mm[i] = on_circle(150, 60 + 120 * static_cast<double>(i / 2));
  EXPECT_EQ(geometry_fault(g), std::nullopt);  // a 6-3 platform
}

}  // namespace
}  // namespace hexcal
