#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <map>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "kinematics/geometry/pose.h"
#include "photogrammetry/markers/detect.h"
#include "tests/support/marker_renderer.h"

namespace hexcal {
namespace {

using testing::flat_marker;
using testing::FlatPattern;
using testing::render_image;
using testing::square_corners;
using testing::TestImage;
using testing::tilted_square;

struct Scene {
  cv::Mat grey;
  std::array<Eigen::Vector2d, 4> corners;
};

Scene one_marker(const MarkerPattern& pattern, double side_px, double turn, double tilt,
                 const Eigen::Vector2d& shift = Eigen::Vector2d::Zero()) {
  TestImage image;
  const double grid_px = side_px * pattern.cells / pattern.square_cells;
  image.width_px = image.height_px = static_cast<int>(1.5 * grid_px + 40);
  image.noise = 1.5;
  image.oversampling = 4;
  const Eigen::Vector2d centre(0.5 * image.width_px + 0.2 + shift.x(),
                               0.5 * image.height_px - 0.3 + shift.y());
  const Eigen::Matrix3d square = tilted_square(centre, side_px, turn, tilt, 0.4);
  return {render_image(image, {flat_marker(pattern, square)}), square_corners(square)};
}

double largest_error(const MarkerObservation& marker, const std::array<Eigen::Vector2d, 4>& truth) {
  double largest = 0;
  for (std::size_t i = 0; i < 4; ++i) largest = std::max(largest, (marker.corners_px[i] - truth[i]).norm());
  return largest;
}

class EveryFamily : public ::testing::TestWithParam<std::string> {};

// Corner order and square are those of the marker drawn upright, here a quarter turn away.
TEST_P(EveryFamily, IdAndCornersOfTheUprightMarker) {
  const MarkerFamily& family = marker_family(GetParam());
  const Scene scene = one_marker(family.patterns[4], 80, std::numbers::pi / 2 + 0.1, 0.3);
  const auto markers = detect_markers(scene.grey, ToneCurve::srgb, family);
  ASSERT_EQ(markers.size(), 1U);
  EXPECT_EQ(markers[0].id, 4);
  EXPECT_EQ(markers[0].status, MarkerStatus::ok) << marker_status_name(markers[0].status);
  EXPECT_LT(largest_error(markers[0], scene.corners), 0.1);
}

INSTANTIATE_TEST_SUITE_P(Families, EveryFamily, ::testing::ValuesIn(marker_family_names()),
                         [](const auto& family) { return family.param; });

const MarkerFamily& usual() { return marker_family("tag36h11"); }

MarkerStatus status_of(const cv::Mat& grey) {
  const auto markers = detect_markers(grey, ToneCurve::srgb, usual());
  return markers.size() == 1 ? markers[0].status : MarkerStatus::not_refined;
}

TEST(DetectMarkers, MirroredIsNamed) {
  Scene scene = one_marker(usual().patterns[5], 90, 0.2, 0);
  cv::flip(scene.grey, scene.grey, 1);
  EXPECT_EQ(status_of(scene.grey), MarkerStatus::mirrored);
}

TEST(DetectMarkers, InvertedIsNamed) {
  Scene scene = one_marker(usual().patterns[5], 90, 0.2, 0);
  scene.grey = 255 - scene.grey;
  EXPECT_EQ(status_of(scene.grey), MarkerStatus::inverted);
}

TEST(DetectMarkers, CutByTheFrameIsNeverTrusted) {
  const Scene scene = one_marker(usual().patterns[5], 90, 0.0, 0);
  const double left = scene.corners[0].x();
  for (const int beyond : {0, 2, 5, 12}) {
    const int cut = static_cast<int>(left) + beyond;
    const cv::Mat part = scene.grey(cv::Rect(cut, 0, scene.grey.cols - cut, scene.grey.rows)).clone();
    for (const auto& marker : detect_markers(part, ToneCurve::srgb, usual())) {
      EXPECT_EQ(marker.status, MarkerStatus::cut_by_frame) << beyond << " px beyond";
    }
  }
}

// White that clips, at the end of the scale or below it, hides how much light there was; edges stay in place.
TEST(DetectMarkers, ClippedWhiteIsMeasuredWithinItsSigma) {
  for (const double ceiling : {255.0, 250.0}) {
    double largest = 0;
    double sum = 0;
    for (int i = 0; i < 6; ++i) {
      Scene scene = one_marker(usual().patterns[static_cast<std::size_t>(i)], 90, 0.2 + 0.4 * i, 0.1 * i);
      scene.grey.convertTo(scene.grey, -1, 1.25, 0);
      scene.grey = cv::min(scene.grey, ceiling);
      const auto markers = detect_markers(scene.grey, ToneCurve::srgb, usual());
      ASSERT_EQ(markers.size(), 1U);
      EXPECT_EQ(markers[0].status, MarkerStatus::ok) << marker_status_name(markers[0].status);
      largest = std::max(largest, largest_error(markers[0], scene.corners));
      Eigen::Matrix<double, 8, 1> error;
      for (int c = 0; c < 4; ++c) {
        const auto corner = static_cast<std::size_t>(c);
        error.segment<2>(2 * c) = markers[0].corners_px[corner] - scene.corners[corner];
      }
      sum += error.dot(markers[0].covariance_px2.ldlt().solve(error)) / 8;
    }
    EXPECT_LT(largest, 0.25) << ceiling;
    EXPECT_LT(sum / 6, 2.5) << ceiling;
  }
}

TEST(DetectMarkers, ToSteepIsNamed) {
  EXPECT_EQ(status_of(one_marker(usual().patterns[5], 300, 0.4, 83 * kRadPerDeg).grey),
            MarkerStatus::too_steep);
  const Scene scene = one_marker(usual().patterns[5], 300, 0.4, 78 * kRadPerDeg);
  const auto markers = detect_markers(scene.grey, ToneCurve::srgb, usual());
  ASSERT_EQ(markers.size(), 1U);
  EXPECT_EQ(markers[0].status, MarkerStatus::ok) << marker_status_name(markers[0].status);
  EXPECT_LT(largest_error(markers[0], scene.corners),
            5 * std::sqrt(markers[0].covariance_px2.diagonal().maxCoeff()));
}

// How many of 20 markers of so many pixels a side are read; none may be read as another, and what is trusted
// must be where its covariance says.
int read_of_twenty(const char* family_name, double side_px) {
  const MarkerFamily& family = marker_family(family_name);
  int read = 0;
  for (int i = 0; i < 20; ++i) {
    const int id = 2 * i;
    const Scene scene = one_marker(family.patterns[static_cast<std::size_t>(id)], side_px, 0.31 * i, 0,
                                   {0.13 * (i % 7), 0.17 * (i % 5)});
    for (const auto& marker : detect_markers(scene.grey, ToneCurve::srgb, family)) {
      EXPECT_EQ(marker.id, id) << family_name;
      if (marker.status != MarkerStatus::ok) continue;
      ++read;
      const double sigma = std::sqrt(marker.covariance_px2.diagonal().maxCoeff());
      EXPECT_LT(largest_error(marker, scene.corners), 5 * sigma) << family_name << " id " << id;
    }
  }
  return read;
}

TEST(DetectMarkers, TwelvePixelsASideAreReadWhereACellHasTwoPixels) {
  EXPECT_EQ(read_of_twenty("DICT_4X4_50", 12.3), 20);
  EXPECT_GE(read_of_twenty("tag36h11", 12.3), 15);  // cells of 1.5 px
  EXPECT_EQ(read_of_twenty("tag36h11", 16), 20);
}

TEST(DetectMarkers, TwoThousandPixelsASide) {
  TestImage image;
  image.width_px = image.height_px = 2700;
  image.oversampling = 2;
  image.noise = 1.5;
  const Eigen::Matrix3d square = tilted_square({1350.3, 1349.6}, 2000, 0.2, 0.3, 0.4);
  const cv::Mat grey = render_image(image, {flat_marker(usual().patterns[5], square)});
  const auto markers = detect_markers(grey, ToneCurve::srgb, usual());
  ASSERT_EQ(markers.size(), 1U);
  EXPECT_EQ(markers[0].id, 5);
  EXPECT_EQ(markers[0].status, MarkerStatus::ok) << marker_status_name(markers[0].status);
  EXPECT_LT(largest_error(markers[0], square_corners(square)), 0.05);
}

// Four photographs of 12 markers at all angles with a camera: 384 coordinates tell a variance of 1 to 7 %.
// (Where cells are smaller than the 8 pixels that the noise is told from, sigmas come out up to 20 % too
// large.)
TEST(DetectMarkers, CovariancesAreHonest) {
  CameraModel camera(720, 540, 900);
  const Eigen::Matrix3d normalised_from_px =
      (Eigen::Matrix3d() << 900, 0, camera.parameters[2], 0, 900, camera.parameters[3], 0, 0, 1)
          .finished()
          .inverse();
  double sum = 0;
  int markers = 0;
  for (int photograph = 0; photograph < 4; ++photograph) {
    TestImage image;
    image.width_px = 720;
    image.height_px = 540;
    image.blur_px = 0.5 + 0.2 * photograph;
    image.oversampling = 4;
    image.camera = &camera;
    image.seed = static_cast<std::uint64_t>(100 + photograph);
    std::vector<FlatPattern> patterns;
    std::map<int, std::array<Eigen::Vector2d, 4>> truth;
    for (int i = 0; i < 12; ++i) {
      const int id = 12 * photograph + i;
      const Eigen::Matrix3d square = tilted_square(
          {95 + 176 * (i % 4) + 0.13 * i, 95 + 175 * (i / 4) - 0.11 * i}, 100, 0.37 * id, 0.08 * i, 0.9 * id);
      patterns.push_back(
          flat_marker(usual().patterns[static_cast<std::size_t>(id)], normalised_from_px * square));
      truth[id] = square_corners(square);
    }
    const cv::Mat grey = render_image(image, patterns);
    for (const auto& marker : detect_markers(grey, ToneCurve::srgb, usual(), {}, &camera)) {
      ASSERT_EQ(marker.status, MarkerStatus::ok) << marker.id << " " << marker_status_name(marker.status);
      Eigen::Matrix<double, 8, 1> error;
      for (int c = 0; c < 4; ++c) {
        const auto corner = static_cast<std::size_t>(c);
        error.segment<2>(2 * c) = marker.corners_px[corner] - truth.at(marker.id)[corner];
      }
      sum += error.dot(marker.covariance_px2.ldlt().solve(error));
      ++markers;
    }
  }
  EXPECT_EQ(markers, 48);
  EXPECT_GT(sum / (8 * markers), 0.8);
  EXPECT_LT(sum / (8 * markers), 1.3);
}

// Processed pictures leave residuals far above the noise of their flat areas: the marker is measured all the
// same, and its sigmas say how much worse.
TEST(DetectMarkers, StrongJpegAndSharpeningWidenTheSigmas) {
  const Scene scene = one_marker(usual().patterns[6], 78, 0.3, 0.3);
  const auto plain = detect_markers(scene.grey, ToneCurve::srgb, usual());
  ASSERT_EQ(plain.size(), 1U);
  std::vector<cv::Mat> processed;
  for (const int quality : {70, 50}) {
    std::vector<std::uint8_t> bytes;
    cv::imencode(".jpg", scene.grey, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
    processed.push_back(cv::imdecode(bytes, cv::IMREAD_GRAYSCALE));
  }
  cv::Mat soft;
  cv::GaussianBlur(scene.grey, soft, {}, 1.0);
  processed.emplace_back();
  cv::addWeighted(scene.grey, 1.4, soft, -0.4, 0, processed.back());
  for (const cv::Mat& grey : processed) {
    const auto markers = detect_markers(grey, ToneCurve::srgb, usual());
    ASSERT_EQ(markers.size(), 1U);
    EXPECT_EQ(markers[0].status, MarkerStatus::ok) << marker_status_name(markers[0].status);
    EXPECT_LT(largest_error(markers[0], scene.corners), 0.1);
    EXPECT_GT(markers[0].covariance_px2.trace(), plain[0].covariance_px2.trace());
  }
}

// Halos as a phone's sharpening and smoothing leave them, clipped and no longer linear: whatever measures the
// markers, their sigma is what it and the edges disagree by.
TEST(DetectMarkers, HeavyHalosAreMeasuredWithinTheirSigma) {
  double sum = 0;
  for (int i = 0; i < 6; ++i) {
    const Scene scene =
        one_marker(usual().patterns[static_cast<std::size_t>(i)], 100, 0.3 + 0.5 * i, 0.1 * i);
    cv::Mat soft;
    cv::GaussianBlur(scene.grey, soft, {}, 2.0);
    cv::Mat grey;
    cv::addWeighted(scene.grey, 2.6, soft, -1.6, 0, grey);
    cv::medianBlur(grey, grey, 3);
    const auto markers = detect_markers(grey, ToneCurve::srgb, usual());
    ASSERT_EQ(markers.size(), 1U);
    EXPECT_EQ(markers[0].status, MarkerStatus::ok) << marker_status_name(markers[0].status);
    EXPECT_LT(largest_error(markers[0], scene.corners), 0.3);
    Eigen::Matrix<double, 8, 1> error;
    for (int c = 0; c < 4; ++c) {
      const auto corner = static_cast<std::size_t>(c);
      error.segment<2>(2 * c) = markers[0].corners_px[corner] - scene.corners[corner];
    }
    sum += error.dot(markers[0].covariance_px2.ldlt().solve(error)) / 8;
  }
  EXPECT_LT(sum / 6, 2.5);
}

// A finger over the rim: what is left is read, and too little to be trusted.
TEST(DetectMarkers, TooMuchCoveredIsOccluded) {
  Scene scene = one_marker(usual().patterns[5], 120, 0, 0);
  const cv::Point from(static_cast<int>(scene.corners[0].x()) - 20,
                       static_cast<int>(scene.corners[0].y()) - 20);
  cv::Mat(scene.grey, cv::Rect(from.x, from.y, 160, 48)).setTo(90);
  for (const auto& marker : detect_markers(scene.grey, ToneCurve::srgb, usual())) {
    EXPECT_NE(marker.status, MarkerStatus::ok);
  }
}

TEST(DetectMarkers, TheSameIdTwiceIsTrustedInNeitherPlace) {
  const Scene scene = one_marker(usual().patterns[5], 60, 0.2, 0);
  cv::Mat twice;
  cv::hconcat(scene.grey, scene.grey, twice);
  const auto markers = detect_markers(twice, ToneCurve::srgb, usual());
  ASSERT_EQ(markers.size(), 2U);
  EXPECT_EQ(markers[0].status, MarkerStatus::duplicate);
  EXPECT_EQ(markers[1].status, MarkerStatus::duplicate);
}

TEST(DetectMarkers, CoveredCellsDoNotMoveTheCorners) {
  Scene scene = one_marker(usual().patterns[5], 120, 0, 0);
  // A pale stripe over two cells of the inside.
  cv::Mat(scene.grey, cv::Rect(static_cast<int>(scene.corners[0].x()) + 50,
                               static_cast<int>(scene.corners[0].y()) + 35, 14, 30))
      .setTo(170);
  const auto markers = detect_markers(scene.grey, ToneCurve::srgb, usual());
  ASSERT_EQ(markers.size(), 1U);
  EXPECT_LT(largest_error(markers[0], scene.corners), 0.05);
}

TEST(DetectMarkers, FlatPaperAndNoiseHoldNone) {
  cv::Mat grey(400, 400, CV_8UC1, cv::Scalar(140));
  EXPECT_TRUE(detect_markers(grey, ToneCurve::srgb, usual()).empty());
  cv::RNG random(7);
  random.fill(grey, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(grey, grey, {}, 3);
  cv::normalize(grey, grey, 0, 255, cv::NORM_MINMAX);
  EXPECT_TRUE(detect_markers(grey, ToneCurve::srgb, usual()).empty());
}

}  // namespace
}  // namespace hexcal
