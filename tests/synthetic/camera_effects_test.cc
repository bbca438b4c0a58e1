#include "tools/synthetic/camera_effects.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "kinematics/geometry/input_error.h"
#include "tools/synthetic/camera_body.h"
#include "tools/synthetic/camera_effects_file.h"
#include "tools/synthetic/demosaic.h"
#include "tools/synthetic/lens_effects.h"
#include "tools/synthetic/simulation.h"
#include "tools/synthetic/simulation_file.h"
#include "tools/synthetic/stations.h"

namespace hexcal {
namespace {

// A white sheet 800 mm away with a black square in its middle; `depth` also the depth map.
SensorImage black_square(const CameraModel& camera, double side_mm, double ink_spread_mm, bool depth) {
  Surface paper;
  paper.outline_mm = rectangle_outline(400, 400);
  paper.albedo = 0.8F;
  paper.ink_spread_mm = ink_spread_mm;
  Decal ink;
  ink.top_left_mm = {-0.5 * side_mm, 0.5 * side_mm};
  ink.cell_mm = {side_mm, side_mm};
  ink.albedo = {0.05F};
  paper.decals = {ink};
  Scene scene;
  scene.surfaces = {paper};
  scene.lamp = {{0, 0, 1}, 1, 0, {0, 0, 0}};
  OpticsOptions optics;
  optics.vignetting = {0, 0, 0};
  optics.depth = depth;
  return render(scene, RayLattice(camera), looking_at({0, 0, 800}, {0, 0, 0}, {0, 1, 0}, 0), optics, 7);
}

constexpr double kWhite = 0.8;
constexpr double kBlack = 0.05;

// Size of the square in an image, as the area of its darkness.
double side_px(const cv::Mat& light) { return std::sqrt(cv::sum(kWhite - light)[0] / (kWhite - kBlack)); }

// Where the left edge of the square lies in the middle row, and how wide it is (standard deviation).
struct EdgeShape {
  double place_px, sigma_px;
};
EdgeShape left_edge(const cv::Mat& light) {
  double weight = 0;
  double mean = 0;
  double square = 0;
  for (int x = 1; x < light.cols / 2; ++x) {
    const double step = light.at<float>(light.rows / 2, x - 1) - light.at<float>(light.rows / 2, x);
    weight += step;
    mean += step * (x - 0.5);
    square += step * (x - 0.5) * (x - 0.5);
  }
  mean /= weight;
  return {mean, std::sqrt(square / weight - mean * mean)};
}

TEST(CameraEffects, WithoutAnyTheCameraDevelopsAsTheIdealOne) {
  const CameraModel camera = profile_camera(35, 400);
  const SensorImage image = black_square(camera, 100, 0, false);
  const cv::Mat ideal = develop(image, SensorOptions{}, 3);
  const cv::Mat real = develop(image, ChannelShift({}, camera, 35, 3), {}, {}, {}, 3, 1);
  cv::Mat difference;
  cv::absdiff(ideal, real, difference);
  double largest = 0;
  cv::minMaxLoc(difference.reshape(1), nullptr, &largest);
  EXPECT_LE(largest, 1);
  EXPECT_LT(cv::countNonZero(difference.reshape(1)), 5);
}

TEST(CameraEffects, InkSpreadsBySoMuchOnEverySide) {
  const CameraModel camera(301, 301, 1000);
  const double drawn = side_px(black_square(camera, 100, 0, false).light);
  EXPECT_NEAR(drawn, 125, 0.01);
  EXPECT_NEAR(side_px(black_square(camera, 100, 0.4, false).light), 126, 0.01);
}

// The corner of the full frame, by lensfun's own terms (px): red and blue.
TEST(LensEffects, LateralColourIsTheProfiles) {
  const double corner = std::hypot(3007.5, 1999.5);
  struct {
    double focal_mm, red_px, blue_px;
  } const expected[] = {{18, 2.40, -0.08}, {24, 1.55, 0.44}, {35, 0.22, 1.33}, {105, -1.18, -1.08}};
  for (const auto& [focal_mm, red_px, blue_px] : expected) {
    const LateralColour colour = profile_lateral_colour(focal_mm, 6016);
    const double r2 = std::pow(corner / colour.unit_px, 2);
    EXPECT_NEAR(corner * (colour.v[0] - 1 + colour.b[0] * r2), red_px, 0.02) << focal_mm;
    EXPECT_NEAR(corner * (colour.v[2] - 1 + colour.b[2] * r2), blue_px, 0.02) << focal_mm;
  }
}

TEST(LensEffects, ChannelsLieWhereTheShiftSays) {
  const CameraModel camera(301, 301, 1000);
  const SensorImage image = black_square(camera, 100, 0, false);
  LensEffects effects;
  effects.lateral_colour = 8;
  const ChannelShift shift(effects, camera, 18, 1);
  const double green = left_edge(image.light).place_px;
  for (const std::size_t channel : {0U, 2U}) {
    cv::Mat shifted(image.light.size(), CV_32FC1);
    for (int y = 0; y < shifted.rows; ++y) {
      for (int x = 0; x < shifted.cols; ++x) {
        shifted.at<float>(y, x) = interpolated(image.light, shift.source(x, y, channel));
      }
    }
    const double place = left_edge(shifted).place_px;
    EXPECT_GT(std::abs(place - green), 0.02);
    const int nearest = static_cast<int>(std::lround(place));
    const double source = shift.source(nearest, 150, channel).x() + place - nearest;
    EXPECT_NEAR(source, green, 0.004) << channel;
  }
}

// A disc of radius R has the variance R^2 / 4 along an axis.
TEST(LensEffects, DefocusIsTheCircleOfConfusion) {
  const CameraModel camera(601, 401, 1000);
  SensorImage image = black_square(camera, 150, 0, true);
  EXPECT_NEAR(image.depth_mm.at<float>(200, 300), 800, 1e-3);
  const EdgeShape sharp = left_edge(image.light);
  LensEffects effects;
  effects.f_number = 4;
  apply_lens_effects(image, effects, 35, 500, 1);
  // Aperture x relative distance from the focus x magnification of the plane in focus.
  const double magnification = 35.0 / (500 - 35);
  const double diameter_px = 35.0 / 4 * (800.0 - 500) / 800 * magnification / (kSensorWidthMm / 601);
  const EdgeShape soft = left_edge(image.light);
  const double variance = soft.sigma_px * soft.sigma_px - sharp.sigma_px * sharp.sigma_px;
  EXPECT_NEAR(std::sqrt(4 * variance), 0.5 * diameter_px, 0.15);
  EXPECT_NEAR(soft.place_px, sharp.place_px, 0.002);
  SensorImage in_focus = black_square(camera, 150, 0, true);
  const cv::Mat before = in_focus.light.clone();
  apply_lens_effects(in_focus, effects, 35, 800, 1);
  EXPECT_EQ(cv::norm(before, in_focus.light, cv::NORM_INF), 0);
}

TEST(LensEffects, ShakeAndGlareKeepEdgesAndLight) {
  const CameraModel camera(301, 301, 1000);
  SensorImage image = black_square(camera, 100, 0, false);
  const EdgeShape sharp = left_edge(image.light);
  const double light = cv::mean(image.light)[0];
  LensEffects effects;
  effects.shake_px = 6;
  apply_lens_effects(image, effects, 35, 800, 4);
  const EdgeShape soft = left_edge(image.light);
  EXPECT_GT(soft.sigma_px, sharp.sigma_px + 0.2);
  EXPECT_NEAR(soft.place_px, sharp.place_px, 0.002);
  effects = {};
  effects.veiling_glare = 0.1;
  apply_lens_effects(image, effects, 35, 800, 4);
  EXPECT_GT(image.light.at<float>(150, 150), kBlack + 0.02);
  EXPECT_NEAR(cv::mean(image.light)[0], light, 0.01);
}

TEST(Demosaicing, GivesBackWhatChangesEvenly) {
  for (const Demosaicing method : {Demosaicing::linear, Demosaicing::adaptive}) {
    cv::Mat mosaic(40, 60, CV_32FC1);
    const auto truth = [](int x, int y, std::size_t channel) {
      return 0.1F + 0.2F * static_cast<float>(channel) + 0.002F * static_cast<float>(x) -
             0.001F * static_cast<float>(y);
    };
    for (int y = 0; y < mosaic.rows; ++y) {
      for (int x = 0; x < mosaic.cols; ++x) mosaic.at<float>(y, x) = truth(x, y, bayer_channel(x, y));
    }
    const auto rgb = demosaiced(mosaic, method);
    for (int y = 4; y < mosaic.rows - 4; ++y) {
      for (int x = 4; x < mosaic.cols - 4; ++x) {
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(rgb[c].at<float>(y, x), truth(x, y, c), 1e-5);
      }
    }
  }
  EXPECT_THROW((void)demosaiced(cv::Mat(8, 8, CV_32FC1, cv::Scalar(0)), Demosaicing::none), InputError);
}

TEST(CameraBody, SharpeningOvershootsAndGreyStaysGrey) {
  const CameraModel camera(301, 301, 1000);
  const SensorImage image = black_square(camera, 100, 0, false);
  SensorOptions quiet;
  quiet.full_well_electrons = 0;
  quiet.read_noise = 0;
  quiet.white_balance = {1, 1, 1};
  CameraEffects effects;
  effects.sensor.exposure = 1;
  effects.sensor.demosaicing = Demosaicing::adaptive;
  effects.sensor.colour_matrix = d3200_colour_matrix();
  const ChannelShift none({}, camera, 35, 1);
  const cv::Mat plain = develop(image, none, quiet, effects.sensor, effects.processing, 1, 1);
  const cv::Vec3b white = plain.at<cv::Vec3b>(20, 20);
  EXPECT_NEAR(white[1], 255 * toned(ToneCurveKind::srgb, kWhite), 1);
  EXPECT_LE(std::abs(white[0] - white[1]) + std::abs(white[2] - white[1]), 2);
  effects.processing.sharpening = 0.8;
  const cv::Mat sharp = develop(image, none, quiet, {}, effects.processing, 1, 1);
  double darkest = 0;
  cv::minMaxLoc(sharp.reshape(1), &darkest);
  EXPECT_LT(darkest, 255 * toned(ToneCurveKind::srgb, kBlack) - 10);
  EXPECT_NEAR(sharp.at<cv::Vec3b>(20, 20)[1], white[1], 1);
}

SimulationOptions small_d3200() {
  SimulationOptions options;
  options.width_px = 752;
  options.poses = 1;
  options.photos_per_pose = 1;
  options.machine.draws = 1;
  options.effects = d3200_effects();
  options.effects.platform = {0.02, 0.2};
  return options;
}

TEST(CameraEffects, SameSeedSameBytesForAnyNumberOfThreads) {
  const VirtualLaboratory laboratory = make_laboratory(small_d3200());
  const RayLattice lens(laboratory.camera);
  const Shot shot = pose_shots(laboratory, {{"home", Pose{}}}, 0, 1).front();
  const cv::Mat many = photograph(laboratory, lens, shot);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(cv::norm(many, photograph(laboratory, lens, shot), cv::NORM_INF), 0);
}

TEST(CameraEffects, ThePlatformTremblesBySoMuch) {
  SimulationOptions options = small_d3200();
  options.photos_per_pose = 50;
  const VirtualLaboratory laboratory = make_laboratory(options);
  double mm2 = 0;
  double rad2 = 0;
  const auto shots = pose_shots(laboratory, {{"home", Pose{}}}, 0, 1);
  for (const Shot& shot : shots) {
    const Rigid3 off = inverse(ug_from_lg(Pose{}, laboratory.machine.nominal.gd_mm)) * shot.UG_from_LG;
    mm2 += off.translation.squaredNorm() / 3;
    rad2 += rotation_vector_from_quaternion(off.rotation).squaredNorm() / 3;
  }
  EXPECT_NEAR(std::sqrt(mm2 / 50), 0.02, 0.004);
  EXPECT_NEAR(std::sqrt(rad2 / 50), 2e-4, 4e-5);
}

TEST(CameraEffectsFile, GivesBackTheEffects) {
  const CameraEffects d3200 = d3200_effects();
  EXPECT_EQ(camera_effects_of(YamlMap::parse(format_camera_effects(d3200), "test")), d3200);
  const CameraEffects changed = camera_effects_of(
      YamlMap::parse("preset: d3200\nsensor: {colour_matrix: [], demosaicing: linear}\n", "test"));
  EXPECT_EQ(changed.sensor.colour_matrix, std::nullopt);
  EXPECT_EQ(changed.sensor.demosaicing, Demosaicing::linear);
  EXPECT_EQ(changed.processing, d3200.processing);
  EXPECT_TRUE(read_camera_effects("ideal").ideal());
  SimulationOptions options;
  options.effects = d3200;
  const std::string text = format_simulation_file("", options);
  EXPECT_THAT(text, testing::HasSubstr("camera_effects:\n  print:"));
}

TEST(CameraEffectsFile, RefusesWhatCannotBe) {
  const auto read = [](const char* text) { (void)camera_effects_of(YamlMap::parse(text, "effects.yaml")); };
  EXPECT_THROW(read("lens: {f_numbre: 8}"), InputError);
  EXPECT_THROW(read("lens: {field_curvature_mm: 0.1}"), InputError);
  EXPECT_THROW(read("processing: {tone_curve: [0, 0, 0.5, 0.6, 0.4, 1]}"), InputError);
  EXPECT_THROW(read("sensor: {colour_matrix: [1, 2, 3]}"), InputError);
  EXPECT_THROW(read("preset: d9999"), InputError);
  EXPECT_THROW((void)read_camera_effects("no_such_preset"), InputError);
}

}  // namespace
}  // namespace hexcal
