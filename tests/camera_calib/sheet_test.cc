#include "camera_calib/sheet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/error_matchers.h"

namespace hexcal {
namespace {

Sheet design_aprilgrid() {
  Sheet sheet;
  sheet.kind = SheetKind::aprilgrid;
  sheet.family = "tag36h11";
  sheet.columns = 8;
  sheet.rows = 6;
  sheet.marker_mm = 40;
  sheet.spacing_mm = 15;
  sheet.first_id = 200;
  return sheet;
}

Sheet cut_out_markers() {
  Sheet sheet = design_aprilgrid();
  sheet.kind = SheetKind::markers;
  sheet.columns = sheet.rows = 2;
  sheet.marker_mm = 24;
  sheet.ids = {3, 4, 5, 9};
  return sheet;
}

Sheet ringed_dots() {
  Sheet sheet;
  sheet.kind = SheetKind::photomodeler;
  sheet.columns = 10;
  sheet.rows = 8;
  sheet.pitch_mm = 20;
  sheet.dot_mm = 4.5;
  return sheet;
}

TEST(Sheet, AprilGridIsReadRowByRowFromTheTopLeft) {
  const SheetGeometry geometry = sheet_geometry(design_aprilgrid());
  ASSERT_EQ(geometry.markers.size(), 48u);
  EXPECT_EQ(geometry.markers[0].id, 200);
  EXPECT_EQ(geometry.markers[1].id, 201);
  // The first tag's top-left corner is the top-left of the whole pattern; the next tag is 55 mm to the right.
  EXPECT_LT((geometry.markers[0].corner_mm(0) - Eigen::Vector2d(-212.5, 157.5)).norm(), 1e-12);
  EXPECT_LT((geometry.markers[1].centre_mm - geometry.markers[0].centre_mm - Eigen::Vector2d(55, 0)).norm(),
            1e-12);
  EXPECT_LT((geometry.markers[8].centre_mm - geometry.markers[0].centre_mm - Eigen::Vector2d(0, -55)).norm(),
            1e-12);
  EXPECT_LT((geometry.markers[0].corner_mm(2) - Eigen::Vector2d(-172.5, 117.5)).norm(), 1e-12);
  const auto points = sheet_points(geometry);
  ASSERT_EQ(points.size(), 192u);
  EXPECT_EQ(points[5].name, "201.1");
}

TEST(Sheet, ChessboardHasInnerCornersAndABlackTopLeftSquare) {
  Sheet sheet;
  sheet.kind = SheetKind::chessboard;
  sheet.columns = 10;
  sheet.rows = 7;
  sheet.pitch_mm = 25;
  sheet.validate();
  const SheetGeometry geometry = sheet_geometry(sheet);
  EXPECT_EQ(geometry.saddles.size(), 54u);
  EXPECT_EQ(geometry.squares.size(), 35u);
  EXPECT_LT((geometry.squares[0].centre_mm - Eigen::Vector2d(-112.5, 75)).norm(), 1e-12);
  EXPECT_LT((geometry.saddles[0].position_mm - Eigen::Vector2d(-100, 62.5)).norm(), 1e-12);
}

TEST(Sheet, CharucoMarkersStandInTheWhiteSquares) {
  Sheet sheet;
  sheet.kind = SheetKind::charuco;
  sheet.family = "DICT_5X5_250";
  sheet.columns = 12;
  sheet.rows = 9;
  sheet.pitch_mm = 30;
  sheet.marker_mm = 22;
  sheet.validate();
  const SheetGeometry geometry = sheet_geometry(sheet);
  EXPECT_EQ(geometry.markers.size(), 54u);
  EXPECT_EQ(geometry.saddles.size(), 88u);
  // Top-left square black, so marker 0 is in the second square.
  EXPECT_LT((geometry.markers[0].centre_mm - geometry.squares[0].centre_mm - Eigen::Vector2d(30, 0)).norm(),
            1e-12);
}

TEST(Sheet, AnyFourByFourNodesOfADotSheetHoldAMarker) {
  Sheet sheet;
  sheet.kind = SheetKind::dots;
  sheet.family = "tag36h11";
  sheet.columns = 13;
  sheet.rows = 9;
  sheet.pitch_mm = 20;
  sheet.dot_mm = 8;
  sheet.marker_mm = 16;
  sheet.validate();
  const SheetGeometry geometry = sheet_geometry(sheet);
  EXPECT_EQ(geometry.markers.size(), 3u * 2u);
  EXPECT_EQ(geometry.markers.size() + geometry.dots.size(), 13u * 9u);
}

TEST(Sheet, ValidateNamesTheFieldAndItsValue) {
  Sheet sheet = design_aprilgrid();
  EXPECT_NO_THROW(sheet.validate());
  sheet.marker_mm = 0;
  EXPECT_THROW(sheet.validate(), InputError);
  sheet = design_aprilgrid();
  sheet.first_id = 580;  // the family ends at 586
  EXPECT_THAT([&sheet] { sheet.validate(); }, ThrowsInputError("id 587 is not in tag36h11"));
  sheet = cut_out_markers();
  sheet.ids[2] = sheet.ids[0];
  EXPECT_THAT([&sheet] { sheet.validate(); },
              ThrowsInputError("sheet: id 3 stands twice, wanted each id once"));
  sheet = ringed_dots();
  sheet.rows = 5;
  EXPECT_THAT([&sheet] { sheet.validate(); },
              ThrowsInputError("sheet: columns and rows is 5, wanted at least 6"));
}

TEST(Sheet, IsDescribedInALine) {
  EXPECT_EQ(describe_sheet(design_aprilgrid()),
            "aprilgrid tag36h11 8 x 6, tags 40 mm, gap 15 mm, ids 200-247");
  Sheet sheet = ringed_dots();
  sheet.validate();
  EXPECT_EQ(describe_sheet(sheet), "photomodeler 10 x 8 dots, pitch 20 mm, dots 4.5 mm");
  sheet.kind = SheetKind::chessboard;
  EXPECT_EQ(describe_sheet(sheet), "chessboard 10 x 8 squares of 20 mm");
  sheet.kind = SheetKind::charuco;
  sheet.family = "DICT_5X5_250";
  sheet.marker_mm = 15;
  EXPECT_EQ(describe_sheet(sheet), "charuco DICT_5X5_250 10 x 8 squares of 20 mm, markers 15 mm, ids 0-39");
  sheet.kind = SheetKind::dots;
  sheet.family = "tag36h11";
  EXPECT_EQ(describe_sheet(sheet), "dots 10 x 8, pitch 20 mm, dots 4.5 mm, markers tag36h11 15 mm, ids 0-5");
  sheet = cut_out_markers();
  sheet.validate();
  EXPECT_EQ(describe_sheet(sheet), "markers tag36h11, 24 mm, ids 3-5 9");
}

}  // namespace
}  // namespace hexcal
