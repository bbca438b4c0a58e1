#include <gmock/gmock.h>

#include <opencv2/calib3d.hpp>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/pose.h"
#include "tests/support/rigid_matchers.h"
#include "tools/synthetic/lens_profile.h"
#include "tools/synthetic/random_source.h"
#include "tools/synthetic/ray_lattice.h"

namespace hexcal {
namespace {

TEST(BrownCamera, AgreesWithOpenCvProjection) {
  const CameraModel camera = brown_camera(35, 6016);
  RandomSource random(1);
  std::vector<cv::Point3d> points;
  std::vector<Eigen::Vector2d> ours;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d p(random.uniform(-220, 220), random.uniform(-150, 150), random.uniform(650, 750));
    points.emplace_back(p.x(), p.y(), p.z());
    ours.push_back(*camera.project(p));
  }
  const cv::Matx33d k(camera.fx_px(), 0, camera.cx_px(), 0, camera.fy_px(), camera.cy_px(), 0, 0, 1);
  std::vector<double> distortion(camera.parameters.data() + 4, camera.parameters.data() + 9);
  std::vector<cv::Point2d> theirs;
  cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), k, distortion, theirs);
  for (std::size_t i = 0; i < ours.size(); ++i) {
    EXPECT_THAT(ours[i], MatrixNear(Eigen::Vector2d(theirs[i].x, theirs[i].y), 1e-6)) << "point " << i;
  }
}

// The paraxial focal lengths and polynomial terms that the profile's terms give (photograph of 6016 px).
TEST(ProfileCamera, KeepsTheParaxialFocalLength) {
  struct Expected {
    double focal_mm, f_px, a, b, c;
  };
  for (const Expected& e : {Expected{18, 4849.4, 0.285766, -0.330534, 0.003411},
                            Expected{35, 9011.1, 0.645894, -0.071374, 0.015862},
                            Expected{105, 27371.9, -0.625429, 3.793953, -0.349949}}) {
    const CameraModel camera = profile_camera(e.focal_mm, 6016);
    EXPECT_NEAR(camera.fy_px(), e.f_px, 0.06);
    EXPECT_NEAR(camera.parameters[4], e.c, 1e-6);
    EXPECT_NEAR(camera.parameters[5], e.b, 1e-6);
    EXPECT_NEAR(camera.parameters[6], e.a, 1e-6);
  }
  EXPECT_EQ(profile_camera(35, 6016).height_px, 4000);
  EXPECT_EQ(profile_camera(35, 1504).height_px, 1000);
}

TEST(ProfileCamera, RefusesOtherFocalLengths) {
  EXPECT_THROW((void)profile_camera(17, 6016), InputError);
  EXPECT_THROW((void)profile_camera(120, 6016), InputError);
}

TEST(RayLattice, InvertsTheLensToATenThousandthOfAPixel) {
  for (const double focal_mm : profile_focal_lengths_mm()) {
    const CameraModel camera = profile_camera(focal_mm, 3008);
    const RayLattice lattice(camera);
    RandomSource random(2);
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Vector2d px(random.uniform(-4, camera.width_px + 3),
                               random.uniform(-4, camera.height_px + 3));
      ASSERT_THAT(camera.image_from_normalised(lattice.at(px)), MatrixNear(px, 1e-4)) << focal_mm << " mm";
    }
  }
}

}  // namespace
}  // namespace hexcal
