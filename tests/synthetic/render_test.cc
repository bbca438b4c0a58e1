#include "tools/synthetic/render.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "tests/support/error_matchers.h"
#include "tools/synthetic/grips.h"
#include "tools/synthetic/lens_profile.h"
#include "tools/synthetic/random_source.h"
#include "tools/synthetic/sheet_scene.h"
#include "tools/synthetic/stations.h"

namespace hexcal {
namespace {

Scene one_marker(double turn_rad) {
  Sticker sticker;
  sticker.id = 3;
  sticker.size_mm = 24;
  sticker.body_from_marker =
      Rigid3(quaternion_from_rotation_vector({0.2, -0.15, turn_rad}), Eigen::Vector3d::Zero());
  Scene scene;
  scene.surfaces = {sticker_surface("tag36h11", sticker)};
  return scene;
}

OpticsOptions plain_optics(double blur_px) {
  OpticsOptions optics;
  optics.blur_px = blur_px;
  optics.vignetting = {0, 0, 0};
  return optics;
}

// Mean signed distance (px) from where an edge of the marker should be to where the image has it. The black
// border beside each side is a cell wide: the light is summed across the edge, 1 px apart, on lines along it.
double edge_offset_px(const SensorImage& image, const CameraModel& camera, const Rigid3& camera_from_marker,
                      const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& inward) {
  const auto px = [&](const Eigen::Vector3d& p) { return *camera.project(camera_from_marker * p); };
  double sum = 0;
  int count = 0;
  for (double s = 0.1; s <= 0.9; s += 0.002) {
    const Eigen::Vector3d p = a + s * (b - a);
    const Eigen::Vector2d edge = px(p);
    const Eigen::Vector2d across = px(p + 0.01 * inward) - px(p - 0.01 * inward);
    // Sum along the image axis that crosses the edge best, so that the sum is over whole pixels.
    const int axis = std::abs(across.x()) > std::abs(across.y()) ? 0 : 1;
    const Eigen::Vector2d along = px(p + 0.01 * (b - a)) - px(p - 0.01 * (b - a));
    const double slope = along[axis] / along[1 - axis];
    const int line = static_cast<int>(std::lround(edge[1 - axis]));
    // The edge at the line's centre.
    const double expected = edge[axis] + slope * (line - edge[1 - axis]);
    const int middle = static_cast<int>(std::lround(expected));
    constexpr int kHalf = 7;
    const auto at = [&](int i) {
      return static_cast<double>(axis == 0 ? image.light.at<float>(line, i) : image.light.at<float>(i, line));
    };
    const double low = at(middle - kHalf);
    const double high = at(middle + kHalf);
    double fraction = 0;
    for (int i = middle - kHalf; i <= middle + kHalf; ++i) fraction += (at(i) - low) / (high - low);
    const double found = middle + kHalf + 0.5 - fraction;
    sum += (found - expected) * (across[axis] > 0 ? 1 : -1);
    ++count;
  }
  return sum / count;
}

TEST(Render, EdgesLieWhereTheyShould) {
  double largest_px = 0;
  for (const double blur_px : {0.5, 0.8, 1.2}) {
    for (const double turn_rad : {0.0, 0.013, 0.4}) {
      const Scene scene = one_marker(turn_rad);
      const CameraModel camera = profile_camera(35, 1504);
      // Away from the axis, where the lens bends edges.
      const Rigid3 camera_from_world = looking_at({45, -25, 260}, {32, -18, 0}, {0, 1, 0}, 0.0);
      const SensorImage image =
          render(scene, RayLattice(camera), camera_from_world, plain_optics(blur_px), 5);
      const Rigid3 camera_from_marker = camera_from_world * scene.surfaces[0].world_from_surface;
      const std::array<Eigen::Vector3d, 4> corners{{{-12, 12, 0}, {12, 12, 0}, {12, -12, 0}, {-12, -12, 0}}};
      for (std::size_t k = 0; k < 4; ++k) {
        const Eigen::Vector3d& a = corners[k];
        const Eigen::Vector3d& b = corners[(k + 1) % 4];
        const double offset = edge_offset_px(image, camera, camera_from_marker, a, b, -(a + b).normalized());
        largest_px = std::max(largest_px, std::abs(offset));
        EXPECT_NEAR(offset, 0, 0.005) << "blur " << blur_px << " px, turn " << turn_rad << ", side " << k;
      }
    }
  }
  RecordProperty("largest_offset_px", std::to_string(largest_px));
}

// Across a vertical edge the blurred image is the convolution of step, pixel and Gaussian.
TEST(Render, EdgeProfileIsPixelAndGaussian) {
  Surface half;
  half.outline_mm = rectangle_outline(100, 100);
  half.albedo = 0.8F;
  Decal dark;
  dark.top_left_mm = {-100, 100};
  dark.cell_mm = {100.03, 200};
  dark.albedo = {0.1F};
  half.decals = {dark};
  Scene scene;
  scene.surfaces = {half};
  scene.lamp = {{0, 0, 1}, 1, 0, {0, 0, 0}};
  const CameraModel camera(161, 121, 1000);
  const Rigid3 camera_from_world = looking_at({0, 0, 500}, {0, 0, 0}, {0, 1, 0}, 0);
  for (const double blur_px : {0.5, 0.7, 1.0}) {
    const SensorImage image = render(scene, RayLattice(camera), camera_from_world, plain_optics(blur_px), 1);
    const double edge_px = 80 + 0.03 * 2;
    const auto integral = [&](double x) {  // of the Gaussian's cumulative distribution
      const double z = x / blur_px;
      return x * 0.5 * std::erfc(-z / std::sqrt(2.0)) +
             blur_px * std::exp(-0.5 * z * z) / std::sqrt(2 * 3.14159265358979323846);
    };
    for (int x = 74; x <= 86; ++x) {
      const double share = integral(x + 0.5 - edge_px) - integral(x - 0.5 - edge_px);
      double mean = 0;
      for (int y = 30; y < 90; ++y) mean += image.light.at<float>(y, x) / 60;
      EXPECT_NEAR(mean, 0.1 + 0.7 * share, 0.002) << "blur " << blur_px << " px, pixel " << x;
    }
  }
}

TEST(Render, NearSurfaceHidesTheFar) {
  Surface near;
  near.outline_mm = rectangle_outline(10, 10);
  near.albedo = 0.6F;
  Surface far;
  far.world_from_surface = Rigid3::from_translation({0, 0, -5});
  far.outline_mm = rectangle_outline(100, 100);
  far.albedo = 0.2F;
  Scene scene;
  scene.surfaces = {far, near};
  scene.lamp = {{0, 0, 1}, 1, 0, {0, 0, 0}};
  const CameraModel camera(100, 80, 1000);
  const SensorImage image = render(scene, RayLattice(camera),
                                   looking_at({0, 0, 500}, {0, 0, 0}, {0, 1, 0}, 0), plain_optics(0.5), 1);
  EXPECT_FLOAT_EQ(image.light.at<float>(40, 50), 0.6F);
  EXPECT_FLOAT_EQ(image.light.at<float>(5, 5), 0.2F);
  // From behind neither is seen.
  const SensorImage back = render(scene, RayLattice(camera),
                                  looking_at({0, 0, -500}, {0, 0, 0}, {0, 1, 0}, 0), plain_optics(0.5), 1);
  EXPECT_LT(back.light.at<float>(40, 50), 0.01F);
}

TEST(Render, WarpedSheetIsPhotographedWhereItsPointsAre) {
  Sheet sheet;
  sheet.kind = SheetKind::chessboard;
  sheet.columns = 6;
  sheet.rows = 4;
  sheet.pitch_mm = 30;
  SheetPrint print;
  print.scale = {1.003, 0.999};
  print.warp_mm = {3, -1};
  Scene scene;
  scene.surfaces = {sheet_surface(sheet, print)};
  scene.lamp = {{0, 0, 1}, 1, 0, {0, 0, 0}};
  const CameraModel camera = profile_camera(35, 752);
  const Rigid3 camera_from_world = looking_at({120, -200, 380}, {0, 0, 0}, {0, 1, 0}, 0.1);
  const SensorImage image = render(scene, RayLattice(camera), camera_from_world, plain_optics(0.6), 1);
  // A saddle is where the image is antisymmetric: its mean equals that of opposite pixels around it.
  for (const SheetSaddle& saddle : sheet_geometry(sheet).saddles) {
    const Eigen::Vector2d px =
        *camera.project(camera_from_world * scene.surfaces[0].printed_point(saddle.position_mm));
    const auto mean_around = [&](double radius_px) {
      double sum = 0;
      for (int k = 0; k < 360; ++k) {
        const double angle = k * kRadPerDeg;
        const Eigen::Vector2d p = px + radius_px * Eigen::Vector2d(std::cos(angle), std::sin(angle));
        const int x = static_cast<int>(std::floor(p.x()));
        const int y = static_cast<int>(std::floor(p.y()));
        const double u = p.x() - x;
        const double v = p.y() - y;
        sum += (1 - v) * ((1 - u) * image.light.at<float>(y, x) + u * image.light.at<float>(y, x + 1)) +
               v * ((1 - u) * image.light.at<float>(y + 1, x) + u * image.light.at<float>(y + 1, x + 1));
      }
      return sum / 360;
    };
    const int x = static_cast<int>(std::lround(px.x()));
    const int y = static_cast<int>(std::lround(px.y()));
    EXPECT_NEAR(mean_around(4), 0.5 * (kPaperAlbedo + kInkAlbedo), 0.06);
    EXPECT_NEAR(image.light.at<float>(y, x), 0.5 * (kPaperAlbedo + kInkAlbedo), 0.13);
  }
}

TEST(Develop, NoiseHasTheStatedVariance) {
  SensorImage image;
  image.light = cv::Mat(300, 400, CV_32FC1, cv::Scalar(0.4));
  image.tint = cv::Mat::zeros(300, 400, CV_8UC1);
  image.tints = {{1, 1, 1}};
  SensorOptions sensor;
  sensor.tone = ToneCurveKind::linear;
  sensor.white_balance = {1, 1, 1};
  sensor.full_well_electrons = 1000;
  sensor.read_noise = 0.01;
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(develop(image, sensor, 3), mean, deviation);
  const double expected = 255 * std::sqrt(0.4 / 1000 + 1e-4);
  for (int channel = 0; channel < 3; ++channel) {
    EXPECT_NEAR(mean[channel], 0.4 * 255, 0.06);
    EXPECT_NEAR(deviation[channel], std::sqrt(expected * expected + 1.0 / 12), 0.05);
  }
}

TEST(Develop, ToneCurves) {
  EXPECT_NEAR(toned(ToneCurveKind::srgb, 0.5), 0.735357, 1e-6);
  EXPECT_NEAR(toned(ToneCurveKind::gamma22, 0.5), 0.729740, 1e-6);
  for (const auto kind :
       {ToneCurveKind::srgb, ToneCurveKind::gamma22, ToneCurveKind::s_curve, ToneCurveKind::linear}) {
    EXPECT_DOUBLE_EQ(toned(kind, 0), 0);
    EXPECT_DOUBLE_EQ(toned(kind, 1), 1);
    for (double v = 0.01; v < 1; v += 0.01) EXPECT_GT(toned(kind, v), toned(kind, v - 0.01));
  }
}

TEST(Render, SameBytesForAnyNumberOfThreads) {
  const Scene scene = one_marker(0.3);
  const CameraModel camera = profile_camera(35, 400);
  const Rigid3 station = looking_at({20, -10, 260}, {0, 0, 0}, {0, 1, 0}, 0.1);
  const auto once = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return develop(render(scene, RayLattice(camera), station, {}, 9), {}, 9);
  };
  EXPECT_EQ(cv::norm(once(1), once(2), cv::NORM_INF), 0);
}

TEST(Render, RefusesOptionsOutOfRange) {
  OpticsOptions optics;
  optics.blur_px = -1;
  EXPECT_THROW(optics.validate(), InputError);
  SensorOptions sensor;
  sensor.read_noise = -0.1;
  EXPECT_THROW(sensor.validate(), InputError);
}

TEST(Render, RefusesAMarkerALensAndASensorThatCannotBe) {
  Sticker sticker;
  sticker.id = 587;
  sticker.size_mm = 24;
  EXPECT_THAT([&] { (void)sticker_surface("tag36h11", sticker); },
              ThrowsInputError("marker family tag36h11 has ids 0 to 586, wanted 587"));
  CameraModel folded(640, 480, 600, LensModel::brown);
  folded.parameters[CameraModel::kNumPinhole] = -5;  // its image turns back inside the frame
  EXPECT_THAT([&] { (void)RayLattice(folded); }, ThrowsInputError("the lens has no inverse at pixel"));
  expect_option_refused<SensorOptions>("full_well_electrons is -1, wanted 0 or more",
                                       [](SensorOptions& options) { options.full_well_electrons = -1; });
}

}  // namespace
}  // namespace hexcal
