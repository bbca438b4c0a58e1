#include "camera_calib/sheet_slip.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>

namespace hexcal {
namespace {

Sheet grid_8x6() {
  Sheet sheet;
  sheet.family = "tag36h11";
  sheet.columns = 8;
  sheet.rows = 6;
  sheet.marker_mm = 24;
  sheet.spacing_mm = 8;
  sheet.first_id = 20;
  return sheet;
}

Sheet board_9x6() {
  Sheet sheet;
  sheet.kind = SheetKind::charuco;
  sheet.family = "DICT_4X4_50";
  sheet.columns = 9;
  sheet.rows = 6;
  sheet.pitch_mm = 20;
  sheet.marker_mm = 15;
  return sheet;
}

// Two steep views of a printed sheet through a lens that bends its lines; y of the image points down.
std::vector<SheetPhotograph> photographs_of(const Sheet& printed, int quarter_turns = 0) {
  std::vector<SheetPhotograph> out(2);
  for (std::size_t p = 0; p < out.size(); ++p) {
    Eigen::Matrix3d h;
    h << 5, 0.7, 1000, 0.4, -4, 800, 0.001 * static_cast<double>(p), 0.0008, 1;
    for (const SheetMarker& marker : sheet_geometry(printed).markers) {
      MarkerRead read{printed.family, marker.id, {}};
      for (int i = 0; i < 4; ++i) {
        const Eigen::Vector2d mm = marker.corner_mm((i + 4 - quarter_turns) % 4);
        const Eigen::Vector2d from_centre = (h * mm.homogeneous()).hnormalized() - Eigen::Vector2d(1000, 800);
        read.corners_px[static_cast<std::size_t>(i)] =
            Eigen::Vector2d(1000, 800) + (1 - 4e-8 * from_centre.squaredNorm()) * from_centre;
      }
      out[p].markers.push_back(read);
    }
  }
  return out;
}

std::string named(const Sheet& described, const Sheet& printed, int quarter_turns = 0) {
  return sheet_slip({described}, 0, photographs_of(printed, quarter_turns)).value_or("");
}

TEST(SheetSlip, TheSheetAsDescribedIsNotDoubted) {
  EXPECT_EQ(named(grid_8x6(), grid_8x6()), "");
  EXPECT_EQ(named(board_9x6(), board_9x6()), "");
}

TEST(SheetSlip, ColumnsAndRowsExchangedOrOffByOneAreNamed) {
  Sheet other = grid_8x6();
  std::swap(other.columns, other.rows);
  EXPECT_EQ(named(other, grid_8x6()),
            "the sheet's description says columns: 6, rows: 8, the photographs show columns: 8, rows: 6 "
            "(96 of 96 markers lie so, 12 as described)");
  other = grid_8x6();
  other.columns = 7;
  EXPECT_THAT(named(other, grid_8x6()), ::testing::HasSubstr("the photographs show columns: 8, rows: 6"));
  other = grid_8x6();
  other.rows = 5;
  EXPECT_THAT(named(other, grid_8x6()), ::testing::HasSubstr("the photographs show columns: 8, rows: 6"));
  other = board_9x6();
  std::swap(other.columns, other.rows);
  EXPECT_THAT(named(other, board_9x6()), ::testing::HasSubstr("the photographs show columns: 9, rows: 6"));
}

TEST(SheetSlip, QuiteAnotherSheetIsNamed) {
  Sheet other = board_9x6();
  other.columns = 5;
  other.rows = 11;
  EXPECT_THAT(named(other, board_9x6()), ::testing::HasSubstr("the photographs show columns: 9, rows: 6"));
  other = grid_8x6();
  other.columns = 14;
  other.rows = 9;
  EXPECT_THAT(named(other, grid_8x6()), ::testing::HasSubstr("the photographs show columns: 8, rows: 6"));
}

TEST(SheetSlip, FirstIdIsNamed) {
  for (const int off : {-20, -1, 1, 2, 100}) {
    Sheet other = grid_8x6();
    other.first_id += off;
    EXPECT_THAT(named(other, grid_8x6()), ::testing::HasSubstr("the photographs show first_id: 20")) << off;
  }
}

TEST(SheetSlip, TheOtherColourOfOlderBoardsIsNamed) {
  Sheet older = board_9x6();
  older.top_left_white = true;
  EXPECT_THAT(named(board_9x6(), older), ::testing::HasSubstr("the photographs show top_left_white: true"));
  EXPECT_THAT(named(older, board_9x6()), ::testing::HasSubstr("the photographs show top_left_white: false"));
}

TEST(SheetSlip, MarkersTurnedInTheirPlacesAreNamed) {
  EXPECT_THAT(named(grid_8x6(), grid_8x6(), 2), ::testing::HasSubstr("turned by 180 degrees"));
  EXPECT_THAT(named(grid_8x6(), grid_8x6(), 1), ::testing::HasSubstr("degrees in their places"));
}

TEST(SheetSlip, OtherMarkersInTheSceneAreNoSlip) {
  std::vector<SheetPhotograph> photographs = photographs_of(grid_8x6());
  for (SheetPhotograph& photograph : photographs) {
    for (int id = 100; id < 130; ++id) {
      MarkerRead read{"tag36h11", id, {}};
      for (auto& corner : read.corners_px) corner = {37.0 * (id % 7), 51.0 * (id % 11)};
      photograph.markers.push_back(read);
    }
  }
  EXPECT_FALSE(sheet_slip({grid_8x6()}, 0, photographs));
  // Those of the template's second sheet neither.
  Sheet second = grid_8x6();
  second.first_id = 100;
  second.columns = 6;
  second.rows = 5;
  EXPECT_FALSE(sheet_slip({grid_8x6(), second}, 0, photographs));
}

}  // namespace
}  // namespace hexcal
