#include "camera_calib/sheet_image.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>

namespace hexcal {
namespace {

Sheet board() {
  Sheet sheet;
  sheet.kind = SheetKind::charuco;
  sheet.family = "DICT_4X4_50";
  sheet.columns = 6;
  sheet.rows = 5;
  sheet.pitch_mm = 20;
  sheet.marker_mm = 17;
  return sheet;
}

// A steep view, y of the image pointing down.
Eigen::Vector2d seen(const Eigen::Vector2d& mm) {
  Eigen::Matrix3d h;
  h << 5, 0.7, 400, 0.4, -4, 300, 0.001, 0.002, 1;
  return (h * mm.homogeneous()).hnormalized();
}

FeatureObservation marker_seen(const SheetMarker& marker, int index, const Eigen::Vector2d& moved_mm) {
  FeatureObservation feature;
  feature.first_point = 4 * index;
  feature.status = MarkerStatus::misfit;  // its place counts, whatever the photometric fit says
  feature.px.resize(8);
  for (int i = 0; i < 4; ++i) feature.px.segment<2>(2 * i) = seen(marker.corner_mm(i) + moved_mm);
  return feature;
}

TEST(SheetImage, FalseReadsElsewhereHarmNothing) {
  const SheetGeometry geometry = sheet_geometry(board());
  std::vector<FeatureObservation> features;
  // Three false ones first: two of them agree with each other.
  features.push_back(marker_seen(geometry.markers[3], 3, {200, 40}));
  features.push_back(marker_seen(geometry.markers[4], 4, {200, 40}));
  features.push_back(marker_seen(geometry.markers[7], 7, {-150, 90}));
  for (const int i : {0, 1, 3, 6, 7, 9, 12}) {
    features.push_back(marker_seen(geometry.markers[static_cast<std::size_t>(i)], i, {0, 0}));
  }
  const SheetImage image(geometry, features);
  ASSERT_TRUE(image.known());
  EXPECT_FALSE(image.contradicted());
  EXPECT_EQ(image.agrees(), (std::vector<char>{0, 0, 0, 1, 1, 1, 1, 1, 1, 1}));
  for (const SheetSaddle& saddle : geometry.saddles) {
    const auto homography = image.around(saddle.position_mm);
    ASSERT_TRUE(homography);
    const Eigen::Vector2d px = (*homography * saddle.position_mm.homogeneous()).hnormalized();
    EXPECT_LT((px - seen(saddle.position_mm)).norm(), 1e-6);
  }
}

TEST(SheetImage, OneMarkerOrMarkersThatDisagreeSayNothing) {
  const SheetGeometry geometry = sheet_geometry(board());
  EXPECT_FALSE(SheetImage(geometry, {}).known());
  EXPECT_FALSE(SheetImage(geometry, {marker_seen(geometry.markers[0], 0, {0, 0})}).known());
  EXPECT_FALSE(SheetImage(geometry, {marker_seen(geometry.markers[0], 0, {0, 0}),
                                     marker_seen(geometry.markers[1], 1, {20, 0})})
                   .known());
  const SheetImage image(
      geometry,
      {marker_seen(geometry.markers[0], 0, {0, 0}), marker_seen(geometry.markers[1], 1, {20, 0}),
       marker_seen(geometry.markers[3], 3, {-20, 0}), marker_seen(geometry.markers[4], 4, {0, 30})});
  EXPECT_FALSE(image.known());
  EXPECT_TRUE(image.contradicted());
}

}  // namespace
}  // namespace hexcal
