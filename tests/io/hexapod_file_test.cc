#include "tools/io/hexapod_file.h"

#include <gmock/gmock.h>

#include "kinematics/geometry/input_error.h"
#include "tests/support/hexapods.h"
#include "tests/support/rigid_matchers.h"

namespace hexcal {
namespace {

using testing::HasSubstr;

std::string refusal(const std::string& text) {
  try {
    (void)parse_hexapod(text, "hexapod.yaml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  return at == std::string::npos ? text : text.replace(at, what.size(), with);
}

TEST(HexapodFile, ReadsWhatItWrites) {
  PlatformGeometry g = surrogate_hexapod();
  g.actuators[3] = {12.25, 0.075, 381, 579.5};
  g.leg_radius_mm = 14;
  g.min_gap_mm = -3.5;
  g.joint_limits->base_axes_rad = {0.5, 0.25};
  g.screw = ScrewLead{5, {}, {}};
  g.screw->base_axes.fill(Eigen::Vector3d::UnitY());
  g.screw->platform_axes.fill(Eigen::Vector3d::UnitX());
  g.P_from_LG = Rigid3{quaternion_from_rpy({0.01, -0.02, 0.03}), {1, 2, 70}};
  const PlatformGeometry back = parse_hexapod(hexapod_text("# a head\n", g), "hexapod.yaml");
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(back.base_joints_mm[i], g.base_joints_mm[i]);
    EXPECT_EQ(back.platform_joints_mm[i], g.platform_joints_mm[i]);
    EXPECT_EQ(back.actuators[i].offset_mm, g.actuators[i].offset_mm);
    EXPECT_EQ(back.actuators[i].mm_per_unit, g.actuators[i].mm_per_unit);
    EXPECT_EQ(back.actuators[i].min_mm, g.actuators[i].min_mm);
    EXPECT_EQ(back.actuators[i].max_mm, g.actuators[i].max_mm);
    EXPECT_EQ(back.screw->base_axes[i], g.screw->base_axes[i]);
  }
  EXPECT_THAT(back.P_from_LG, RigidNear(g.P_from_LG, 1e-13, 1e-12));
  EXPECT_EQ(back.gd_mm, 50);
  EXPECT_EQ(back.leg_radius_mm, g.leg_radius_mm);
  EXPECT_EQ(back.min_gap_mm, g.min_gap_mm);
  EXPECT_EQ(back.screw->lead_mm, 5);
  EXPECT_NEAR(back.joint_limits->base_rad, 45 * kRadPerDeg, 1e-15);
  EXPECT_NEAR((*back.joint_limits->base_axes_rad)[1], 0.25, 1e-15);
}

TEST(HexapodFile, SaysWhatIsWrong) {
  const std::string good = hexapod_text("", surrogate_hexapod());
  EXPECT_EQ(refusal(good), "");
  EXPECT_THAT(refusal(good + "stroke_mm: 3\n"), HasSubstr("stroke_mm"));
  EXPECT_THAT(refusal(replaced(good, "min_mm: 380", "min_mm: 680")),
              HasSubstr("leg 1: max_mm must be greater"));
  EXPECT_THAT(refusal(replaced(good, "mm_per_unit: 1", "mm_per_unit: 0")),
              HasSubstr("mm_per_unit: found 0, wanted at least 1e-09"));
  EXPECT_THAT(refusal(replaced(good, "home", "hime")), HasSubstr("home: missing"));
}

}  // namespace
}  // namespace hexcal
