#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagCircle49h12.h>
#include <apriltag/tagCustom48h12.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>
#include <cairo.h>
#include <gmock/gmock.h>

#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/core/version.hpp>
#include <opencv2/imgproc.hpp>
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
#include <opencv2/objdetect/aruco_detector.hpp>
#else
#include <opencv2/aruco.hpp>
#endif
#include <set>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/markers/detect.h"
#include "photogrammetry/markers/printed_pattern.h"
#include "tools/io/template_drawing.h"
#include "tools/io/template_pdf.h"

// What `template` prints of every family is read by `detect`, and by the library that the family comes from.

namespace hexcal {
namespace {

using ::testing::ContainerEq;

constexpr double kPxPerMm = 4;
constexpr double kMarginMm = 15;

Sheet stickers(const std::string& family) {
  const int count = static_cast<int>(marker_family(family).patterns.size());
  Sheet sheet;
  sheet.kind = SheetKind::markers;
  sheet.family = family;
  for (const int id : {0, 1, count / 2, count - 2, count - 1, 7}) {
    const bool clear = !same_when_turned(marker_family(family).patterns[static_cast<std::size_t>(id)]);
    sheet.ids.push_back(clear ? id : id - 5);
  }
  sheet.columns = 3;
  sheet.rows = 2;
  // The same printed size for all, so that families with data outside their square are no smaller.
  sheet.marker_mm = 40 / printed_share(marker_family(family));
  sheet.spacing_mm = 12;
  sheet.validate();
  return sheet;
}

std::set<int> ids_of(const Sheet& sheet) { return {sheet.ids.begin(), sheet.ids.end()}; }

// The page as a camera sees it: in the linear light of a lens's blur, as 8-bit sRGB.
cv::Mat printed(const Sheet& sheet) {
  const Eigen::Vector2d extent = sheet_geometry(sheet).extent_mm.array() + 2 * kMarginMm;
  const int width = static_cast<int>(extent.x() * kPxPerMm);
  const int height = static_cast<int>(extent.y() * kPxPerMm);
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height), cairo_surface_destroy);
  const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> cr(cairo_create(surface.get()), cairo_destroy);
  cairo_set_antialias(cr.get(), CAIRO_ANTIALIAS_BEST);
  cairo_set_source_rgb(cr.get(), 1, 1, 1);
  cairo_paint(cr.get());
  // Pixel (0, 0) is the centre of the first one: the pattern's centre falls on 0.5 (width - 1).
  cairo_translate(cr.get(), 0.5 * width, 0.5 * height);
  cairo_scale(cr.get(), kPxPerMm, kPxPerMm);
  draw_sheet(cr.get(), sheet);
  cairo_surface_flush(surface.get());
  const cv::Mat view(height, width, CV_8UC4, cairo_image_surface_get_data(surface.get()),
                     static_cast<std::size_t>(cairo_image_surface_get_stride(surface.get())));
  cv::Mat light;
  cv::extractChannel(view, light, 1);
  light.convertTo(light, CV_32F, 0.75 / 255, 0.04);
  cv::GaussianBlur(light, light, {0, 0}, 0.7);
  cv::Mat srgb;
  cv::pow(light, 1 / 2.4, srgb);
  srgb.convertTo(srgb, CV_8U, 255 * 1.055, -255 * 0.055);
  return srgb;
}

Eigen::Vector2d expected_px(const cv::Mat& page, const Eigen::Vector2d& mm) {
  return {0.5 * (page.cols - 1) + kPxPerMm * mm.x(), 0.5 * (page.rows - 1) - kPxPerMm * mm.y()};
}

class PrintedFamily : public testing::TestWithParam<std::string> {};

TEST_P(PrintedFamily, IsReadWhereItWasPrinted) {
  const Sheet sheet = stickers(GetParam());
  const cv::Mat page = printed(sheet);
  std::set<int> found;
  DetectionOptions options;
  options.ids = sheet.ids;
  for (const MarkerObservation& marker :
       detect_markers(page, ToneCurve::srgb, marker_family(sheet.family), options)) {
    EXPECT_EQ(marker.status, MarkerStatus::ok) << marker.id << ": " << marker_status_name(marker.status);
    found.insert(marker.id);
    for (const SheetMarker& drawn : sheet_geometry(sheet).markers) {
      if (drawn.id != marker.id) continue;
      for (int corner = 0; corner < 4; ++corner) {
        const Eigen::Vector2d off =
            marker.corners_px[static_cast<std::size_t>(corner)] - expected_px(page, drawn.corner_mm(corner));
        // cairo rounds edges to 1/15 px.
        EXPECT_LT(off.norm(), 0.15) << marker.id << "." << corner;
      }
    }
  }
  EXPECT_THAT(found, ContainerEq(ids_of(sheet)));
}

// Nothing of a marker reaches into the gap around it.
TEST_P(PrintedFamily, LeavesTheGapWhite) {
  const Sheet sheet = stickers(GetParam());
  const SheetGeometry geometry = sheet_geometry(sheet);
  const double pitch = (geometry.markers[1].centre_mm - geometry.markers[0].centre_mm).norm();
  const MarkerFamily& family = marker_family(sheet.family);
  EXPECT_NEAR(pitch, sheet.marker_mm * printed_share(family) + sheet.spacing_mm, 1e-12);
  const cv::Mat page = printed(sheet);
  const Eigen::Vector2d a =
      expected_px(page, geometry.markers[0].centre_mm + Eigen::Vector2d(0.5 * pitch, 18));
  const Eigen::Vector2d b =
      expected_px(page, geometry.markers[0].centre_mm + Eigen::Vector2d(0.5 * pitch, -18));
  const cv::Rect gap(static_cast<int>(a.x() - 16), static_cast<int>(a.y()), 32,
                     static_cast<int>(b.y() - a.y()));
  double darkest = 0;
  cv::minMaxLoc(page(gap), &darkest);
  EXPECT_GT(darkest, 200);
}

std::vector<std::string> families_that_differ() {
  // Of OpenCV's dictionaries the larger ones hold the smaller: one of each size, and those of other origin.
  return {"tag36h11",
          "tag25h9",
          "tag16h5",
          "tagCircle21h7",
          "tagCircle49h12",
          "tagStandard41h12",
          "tagStandard52h13",
          "tagCustom48h12",
          "tag36h11_border2",
          "DICT_4X4_50",
          "DICT_5X5_250",
          "DICT_6X6_1000",
          "DICT_7X7_1000",
          "DICT_ARUCO_ORIGINAL",
          "DICT_APRILTAG_16h5",
          "DICT_APRILTAG_25h9",
          "DICT_APRILTAG_36h10",
          "DICT_APRILTAG_36h11"};
}

INSTANTIATE_TEST_SUITE_P(All, PrintedFamily, testing::ValuesIn(families_that_differ()),
                         [](const auto& family) { return family.param; });

struct LibraryFamily {
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

std::set<int> read_by_apriltag(const cv::Mat& page, const LibraryFamily& source) {
  apriltag_family_t* family = source.create();
  apriltag_detector_t* detector = apriltag_detector_create();
  apriltag_detector_add_family_bits(detector, family, 1);
  detector->quad_decimate = 1;
  cv::Mat copy = page.clone();
  image_u8_t image{copy.cols, copy.rows, static_cast<std::int32_t>(copy.step[0]), copy.data};
  zarray_t* detections = apriltag_detector_detect(detector, &image);
  std::set<int> ids;
  for (int i = 0; i < zarray_size(detections); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(detections, i, &detection);
    ids.insert(detection->id);
  }
  apriltag_detections_destroy(detections);
  apriltag_detector_destroy(detector);
  source.destroy(family);
  return ids;
}

TEST(PrintedFamilies, AreReadByAprilTagsLibrary) {
  const std::map<std::string, LibraryFamily> sources{
      {"tag36h11", {tag36h11_create, tag36h11_destroy}},
      {"tag25h9", {tag25h9_create, tag25h9_destroy}},
      {"tag16h5", {tag16h5_create, tag16h5_destroy}},
      {"tagCircle21h7", {tagCircle21h7_create, tagCircle21h7_destroy}},
      {"tagCircle49h12", {tagCircle49h12_create, tagCircle49h12_destroy}},
      {"tagStandard41h12", {tagStandard41h12_create, tagStandard41h12_destroy}},
      {"tagStandard52h13", {tagStandard52h13_create, tagStandard52h13_destroy}},
      {"tagCustom48h12", {tagCustom48h12_create, tagCustom48h12_destroy}}};
  for (const auto& [name, source] : sources) {
    const Sheet sheet = stickers(name);
    EXPECT_THAT(read_by_apriltag(printed(sheet), source), testing::IsSupersetOf(ids_of(sheet))) << name;
  }
}

std::set<int> read_by_opencv(const cv::Mat& page, decltype(cv::aruco::DICT_4X4_50) dictionary) {
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
  cv::aruco::ArucoDetector(cv::aruco::getPredefinedDictionary(dictionary)).detectMarkers(page, corners, ids);
#else
  cv::aruco::detectMarkers(page, cv::aruco::getPredefinedDictionary(dictionary), corners, ids);
#endif
  return {ids.begin(), ids.end()};
}

TEST(PrintedFamilies, AreReadByOpenCv) {
  const std::map<std::string, decltype(cv::aruco::DICT_4X4_50)> sources{
      {"DICT_4X4_50", cv::aruco::DICT_4X4_50},
      {"DICT_5X5_250", cv::aruco::DICT_5X5_250},
      {"DICT_6X6_1000", cv::aruco::DICT_6X6_1000},
      {"DICT_7X7_1000", cv::aruco::DICT_7X7_1000},
      {"DICT_ARUCO_ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL},
      {"DICT_APRILTAG_25h9", cv::aruco::DICT_APRILTAG_25h9},
      {"DICT_APRILTAG_36h10", cv::aruco::DICT_APRILTAG_36h10},
      {"DICT_APRILTAG_36h11", cv::aruco::DICT_APRILTAG_36h11}};
  for (const auto& [name, number] : sources) {
    const Sheet sheet = stickers(name);
    EXPECT_THAT(read_by_opencv(printed(sheet), number), testing::IsSupersetOf(ids_of(sheet))) << name;
  }
}

// Kalibr draws black squares of the gap's size where four tags meet, touching their corners.
TEST(PrintedFamilies, KalibrsAprilGridIsRead) {
  Sheet sheet;
  sheet.kind = SheetKind::markers;
  sheet.family = "tag36h11_border2";
  sheet.columns = 4;
  sheet.rows = 3;
  for (int row = 2; row >= 0; --row) {  // Kalibr counts from the bottom left
    for (int column = 0; column < 4; ++column) sheet.ids.push_back(4 * row + column);
  }
  sheet.marker_mm = 40;
  sheet.spacing_mm = 12;
  cv::Mat page = printed(sheet);
  for (const SheetMarker& marker : sheet_geometry(sheet).markers) {
    for (int corner = 0; corner < 4; ++corner) {
      const Eigen::Vector2d c = marker.corner_mm(corner);
      const Eigen::Vector2d way = (c - marker.centre_mm).cwiseSign();
      const Eigen::Vector2d from = expected_px(page, c);
      const Eigen::Vector2d to = expected_px(page, c + sheet.spacing_mm * way);
      const cv::Point first(static_cast<int>(std::ceil(std::min(from.x(), to.x()))),
                            static_cast<int>(std::ceil(std::min(from.y(), to.y()))));
      page(cv::Rect(first, cv::Size(static_cast<int>(sheet.spacing_mm * kPxPerMm),
                                    static_cast<int>(sheet.spacing_mm * kPxPerMm))))
          .setTo(page.at<std::uint8_t>(static_cast<int>(expected_px(page, marker.corner_mm(0)).y()) + 6,
                                       static_cast<int>(expected_px(page, marker.corner_mm(0)).x()) + 6));
    }
  }
  cv::GaussianBlur(page, page, {0, 0}, 0.6);
  std::set<int> found;
  for (const MarkerObservation& marker : detect_markers(page, ToneCurve::srgb, marker_family(sheet.family))) {
    if (marker.status == MarkerStatus::ok) found.insert(marker.id);
  }
  EXPECT_THAT(found, ContainerEq(ids_of(sheet)));
}

// Read turned by half a turn its corners would be wrong by its size.
TEST(PrintedFamilies, APatternThatLooksTheSameTurnedIsNeitherPrintedNorRead) {
  Sheet sheet = stickers("DICT_ARUCO_ORIGINAL");
  sheet.ids[3] = 1023;
  EXPECT_THROW(sheet.validate(), InputError);
  std::set<int> found;
  for (const MarkerObservation& marker :
       detect_markers(printed(sheet), ToneCurve::srgb, marker_family(sheet.family))) {
    found.insert(marker.id);
  }
  EXPECT_EQ(found.count(1023), 0u);
}

TEST(StickerPages, HoldWholeStickersOnly) {
  Sheet sheet;
  sheet.kind = SheetKind::markers;
  sheet.family = "tag36h11";
  for (int id = 0; id < 100; ++id) sheet.ids.push_back(id);
  sheet.marker_mm = 24;
  sheet.spacing_mm = 8;
  const TemplatePdfOptions options;
  sheet.columns = largest_grid(sheet, options).first;
  sheet.rows = (100 + sheet.columns - 1) / sheet.columns;
  ASSERT_GT(template_tiles(sheet, options).rows, 1);  // tiles would cut stickers
  std::vector<int> ids;
  for (const Sheet& page : sticker_pages(sheet, options)) {
    page.validate();
    const TemplateTiles tiles = template_tiles(page, options);
    EXPECT_EQ(tiles.columns * tiles.rows, 1);
    ids.insert(ids.end(), page.ids.begin(), page.ids.end());
  }
  EXPECT_EQ(ids, sheet.ids);
  sheet.marker_mm = 500;
  EXPECT_ANY_THROW((void)sticker_pages(sheet, options));
}

}  // namespace
}  // namespace hexcal
