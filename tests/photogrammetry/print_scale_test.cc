#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <random>

#include "photogrammetry/adjustment/adjustment.h"
#include "tests/support/observation_scene.h"
#include "tests/support/scene_errors.h"

// Markers that are not as large as is stated of them: the scale and the poses of a campaign with freed
// corners lie where their sigmas say, and nothing is gained by shrinking the world.

namespace hexcal {
namespace {

enum class ScaleSource { sizes, one_bar, two_bars, bars_that_disagree };

// Errors over their sigmas of one draw: of the fixed body's scale, and mean square of the poses.
struct ScaleDraw {
  double scale = 0;
  double poses = 0;
  double print_scale = 0;
};

constexpr double kBarSigmaMm = 0.02;

// Distance of two fixed markers' centres beside the truth, over its sigma: as good as the scale alone.
double scale_error_in_sigmas(const ObservationScene& scene, const AdjustmentResult& result, int a, int b) {
  const EstimatedPoint at_a = result.point(a);
  const EstimatedPoint at_b = result.point(b);
  const Eigen::Vector3d d = at_b.in_body - at_a.in_body;
  const double sigma = (d.normalized().transpose() * (at_b.by_error - at_a.by_error)).norm();
  const double truth = (scene.body_from_marker[static_cast<std::size_t>(b)].translation -
                        scene.body_from_marker[static_cast<std::size_t>(a)].translation)
                           .norm();
  return (d.norm() - truth) / sigma;
}

ScaleDraw draw_scale(ScaleSource source, double size_sigma, double print_scale_sigma, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  ObservationSceneOptions options;
  options.num_epochs = 3;
  options.markers_per_body = 6;
  options.noise_px = 0.01;
  options.size_sigma = size_sigma;
  options.print_scale = print_scale_sigma * normal(rng);
  options.seed = seed;
  ObservationScene scene = make_observation_scene(options);
  AdjustmentOptions adjust;
  adjust.print_scale_free = source != ScaleSource::sizes;
  adjust.print_scale_sigma = print_scale_sigma;
  const auto add_bar = [&](int a, int b, double off_mm) {
    const double length = (scene.body_from_marker[static_cast<std::size_t>(a)].translation -
                           scene.body_from_marker[static_cast<std::size_t>(b)].translation)
                              .norm();
    scene.network.lengths.push_back({a, -1, b, -1, length + off_mm, kBarSigmaMm});
  };
  if (source != ScaleSource::sizes) add_bar(0, 4, kBarSigmaMm * normal(rng));
  if (source == ScaleSource::two_bars) add_bar(5, 2, kBarSigmaMm * normal(rng));
  if (source == ScaleSource::bars_that_disagree) add_bar(5, 2, 15 * kBarSigmaMm);
  const AdjustmentResult result = adjust_network(scene.network, adjust);
  EXPECT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  EXPECT_TRUE(result.shape_free);
  if (source == ScaleSource::bars_that_disagree) {
    EXPECT_GT(result.length_inflation, 5);
  }
  return {scale_error_in_sigmas(scene, result, 1, 3), mean_normalised_square(scene, result),
          result.geometry.print_scale};
}

class PrintScale : public ::testing::TestWithParam<ScaleSource> {};

TEST_P(PrintScale, StaysWithinItsSigmasWhenEveryMarkersSizeIsOff) {
  const std::array<double, 4> size_sigmas{0.0005, 0.001, 0.002, 0.004};
  const std::array<double, 2> scale_sigmas{0.001, 0.005};
  const unsigned draws = GetParam() == ScaleSource::sizes || GetParam() == ScaleSource::one_bar ? 40 : 16;
  double scale = 0;
  double poses = 0;
  for (unsigned i = 0; i < draws; ++i) {
    const double size_sigma = size_sigmas[i % 4];
    const double scale_sigma = scale_sigmas[i / 4 % 2];
    const ScaleDraw draw = draw_scale(GetParam(), size_sigma, scale_sigma, 500 + i);
    EXPECT_LT(std::abs(draw.scale), 3.5)
        << "sizes " << size_sigma << ", scale " << scale_sigma << ", draw " << i;
    EXPECT_LT(std::abs(draw.print_scale), 0.05);
    scale += draw.scale * draw.scale / draws;
    poses += draw.poses / draws;
  }
  const bool disagree = GetParam() == ScaleSource::bars_that_disagree;
  RecordProperty("scale", std::to_string(std::sqrt(scale)));
  std::cout << "scale " << std::sqrt(scale) << " poses " << std::sqrt(poses) << std::endl;
  EXPECT_LT(std::sqrt(scale), 1.25);
  EXPECT_LT(std::sqrt(poses), 1.25);
  if (disagree) return;  // the two are off by what covers both
  EXPECT_GT(std::sqrt(scale), 0.8);
  EXPECT_GT(std::sqrt(poses), 0.8);
}

INSTANTIATE_TEST_SUITE_P(Sources, PrintScale,
                         ::testing::Values(ScaleSource::sizes, ScaleSource::one_bar, ScaleSource::two_bars,
                                           ScaleSource::bars_that_disagree));

}  // namespace
}  // namespace hexcal
