#include <gmock/gmock.h>

#include <cmath>

#ifdef HEXCAL_HAVE_LENSFUN
#include <lensfun/lensfun.h>
#endif

#include "tools/synthetic/lens_profile.h"

namespace hexcal {
namespace {

#ifdef HEXCAL_HAVE_LENSFUN

// liblensfun 0.3 maps undistorted to distorted radii r (a r^3 + b r^2 + c r + d), d = 1 - a - b - c; an
// undistorted radius is the nominal focal length times tan(angle), which near the axis is 1 / d of ours.
TEST(ProfileCamera, AgreesWithLensfun) {
  lfDatabase* database = lf_db_new();
  if (lf_db_load(database) != LF_NO_ERROR) {
    lf_db_destroy(database);
    GTEST_SKIP() << "no lensfun database";
  }
  const lfCamera** bodies = lf_db_find_cameras(database, "NIKON CORPORATION", "NIKON D3200");
  const lfLens** lenses = bodies != nullptr
                              ? lf_db_find_lenses_hd(database, bodies[0], "Nikon",
                                                     "Nikon AF-S DX Zoom-Nikkor 18-105mm f/3.5-5.6G ED VR", 0)
                              : nullptr;
  if (lenses == nullptr) {
    lf_db_destroy(database);
    GTEST_SKIP() << "the lensfun database has no such lens";
  }
  constexpr int kWidth = 6016;
  constexpr int kHeight = 4000;
  for (const double focal_mm : profile_focal_lengths_mm()) {
    lfModifier* modifier = lf_modifier_new(lenses[0], bodies[0]->CropFactor, kWidth, kHeight);
    lf_modifier_initialize(modifier, lenses[0], LF_PF_U8, static_cast<float>(focal_mm), 8.0F, 1000.0F, 1.0F,
                           LF_RECTILINEAR, LF_MODIFY_DISTORTION, 0);
    lfLensCalibDistortion terms;
    ASSERT_TRUE(lf_lens_interpolate_distortion(lenses[0], static_cast<float>(focal_mm), &terms));
    const double d = 1.0 - terms.Terms[0] - terms.Terms[1] - terms.Terms[2];
    // lensfun's unit of radius: half the short side of the sensor that the profile was measured on.
    const double aspect = static_cast<double>(kWidth - 1) / (kHeight - 1);
    const double unit_px = 0.5 * (kHeight - 1) * std::hypot(aspect, 1.0) / std::hypot(1.5, 1.0) *
                           bodies[0]->CropFactor / lenses[0]->CropFactor;
    const double unit_mm = std::hypot(36.0, 24.0) / lenses[0]->CropFactor / std::hypot(1.5, 1.0) / 2;
    const CameraModel camera = profile_camera(focal_mm, kWidth);
    const double f_px = focal_mm * d / unit_mm * unit_px;
    for (int i = 1; i <= 12; ++i) {
      const double x = 0.5 * (kWidth - 1) + 250.0 * i;
      const double y = 0.5 * (kHeight - 1) + 165.0 * i;
      float distorted[2];
      ASSERT_TRUE(lf_modifier_apply_geometry_distortion(modifier, static_cast<float>(x),
                                                        static_cast<float>(y), 1, 1, distorted));
      // lensfun: undistorted radius at scale 1 -> distorted radius; ours: tan(angle) -> image.
      const Eigen::Vector2d undistorted(x - 0.5 * (kWidth - 1), y - 0.5 * (kHeight - 1));
      const Eigen::Vector2d ours = camera.distort(undistorted * d / f_px) * f_px;
      const Eigen::Vector2d theirs(distorted[0] - 0.5 * (kWidth - 1), distorted[1] - 0.5 * (kHeight - 1));
      EXPECT_NEAR((ours - theirs).norm(), 0, 0.01) << focal_mm << " mm, radius " << undistorted.norm();
    }
    lf_modifier_destroy(modifier);
  }
  lf_free(lenses);
  lf_free(bodies);
  lf_db_destroy(database);
}

#else

TEST(ProfileCamera, AgreesWithLensfun) { GTEST_SKIP() << "built without lensfun"; }

#endif

}  // namespace
}  // namespace hexcal
