#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "photogrammetry/markers/refine.h"
#include "tests/support/marker_renderer.h"

namespace hexcal {
namespace {

using testing::TestImage;

MarkerPattern chessboard() {
  MarkerPattern pattern{8, 8, {}};
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) pattern.white.push_back(static_cast<std::uint8_t>((x + y) % 2));
  }
  return pattern;
}

struct Errors {
  double rms_px = 0;
  double normalised_variance = 0;
  int found = 0;
};

// All 49 inner corners of a tilted board.
Errors measure(double noise) {
  TestImage image;
  image.width_px = image.height_px = 270;
  image.noise = noise;
  image.shade_per_px = {0.001, -0.0005};
  const Eigen::Matrix3d board = testing::tilted_square({135.13, 134.79}, 160, 0.4, 0.6, 0.5);
  const cv::Mat grey = testing::render_image(image, {testing::flat_marker(chessboard(), board)});
  const auto at = [&board](int i, int j) -> Eigen::Vector2d {
    return (board * Eigen::Vector3d(i / 4.0 - 1, j / 4.0 - 1, 1)).hnormalized();
  };
  Errors errors;
  for (int j = 1; j < 8; ++j) {
    for (int i = 1; i < 8; ++i) {
      const Eigen::Vector2d truth = at(i, j);
      const PointObservation point =
          refine_saddle(grey, ToneCurve::srgb,
                        {truth + Eigen::Vector2d(0.6, -0.7), at(i + 1, j) - truth, at(i, j + 1) - truth});
      if (point.status != MarkerStatus::ok) continue;
      const Eigen::Vector2d error = point.px - truth;
      ++errors.found;
      errors.rms_px += error.squaredNorm() / 2;
      errors.normalised_variance += error.dot(point.covariance_px2.ldlt().solve(error)) / 2;
    }
  }
  errors.rms_px = std::sqrt(errors.rms_px / errors.found);
  errors.normalised_variance /= errors.found;
  return errors;
}

TEST(RefineSaddle, IsExactToRoundingWithoutNoise) {
  const Errors errors = measure(0);
  EXPECT_EQ(errors.found, 49);
  EXPECT_LT(errors.rms_px, 0.004);
}

TEST(RefineSaddle, NoisyCornersKeepTheBudget) {
  const Errors errors = measure(2);
  EXPECT_EQ(errors.found, 49);
  EXPECT_LT(errors.rms_px, 0.02);
}

// A ChArUco board's four squares around one corner, of 48 cells each: markers of 42 cells leave a gap of 3.
// Top left and bottom right are white, with a marker of which only the black border matters.
MarkerPattern charuco_corner() {
  constexpr int kSquare = 48;
  constexpr int kGap = 3;
  MarkerPattern pattern{2 * kSquare, 2 * kSquare, {}};
  for (int y = 0; y < 2 * kSquare; ++y) {
    for (int x = 0; x < 2 * kSquare; ++x) {
      const bool white_square = (x < kSquare) == (y < kSquare);
      const auto in_marker = [](int at) { return at % kSquare >= kGap && at % kSquare < kSquare - kGap; };
      pattern.white.push_back(white_square && !(in_marker(x) && in_marker(y)) ? 1 : 0);
    }
  }
  return pattern;
}

// Squares of 40 px, so that markers stand 2.5 px from the corner's edges.
TEST(RefineSaddle, MarkersBesideItArePartOfTheModel) {
  TestImage image;
  image.width_px = image.height_px = 120;
  image.noise = 1;
  const Eigen::Matrix3d board = testing::tilted_square({60.2, 59.7}, 80, 0.5, 0.3, 0.4);
  const cv::Mat grey = testing::render_image(image, {testing::flat_marker(charuco_corner(), board)});
  const auto at = [&board](double x, double y) -> Eigen::Vector2d {
    return (board * Eigen::Vector3d(x, y, 1)).hnormalized();
  };
  const Eigen::Vector2d truth = at(0, 0);
  SaddleGuess guess{truth + Eigen::Vector2d(0.6, -0.5), at(1, 0) - truth, at(0, 1) - truth, 3.0 / 48,
                    7.0 / 48};
  const PointObservation point = refine_saddle(grey, ToneCurve::srgb, guess);
  EXPECT_EQ(point.status, MarkerStatus::ok);
  EXPECT_LT((point.px - truth).norm(), 0.03);
  guess.top_left_white = true;
  EXPECT_EQ(refine_saddle(grey, ToneCurve::srgb, guess).status, MarkerStatus::ok);
  guess.top_left_white = false;  // a board turned by half a turn
  EXPECT_EQ(refine_saddle(grey, ToneCurve::srgb, guess).status, MarkerStatus::misfit);
}

TEST(RefineSaddle, RefusesFlatPaperAndTheFramesEdge) {
  const cv::Mat grey(100, 100, CV_8UC1, cv::Scalar(128));
  EXPECT_NE(refine_saddle(grey, ToneCurve::srgb, {{50, 50}, {20, 0}, {0, 20}}).status, MarkerStatus::ok);
  EXPECT_EQ(refine_saddle(grey, ToneCurve::srgb, {{2, 50}, {20, 0}, {0, 20}}).status,
            MarkerStatus::cut_by_frame);
  EXPECT_EQ(refine_saddle(grey, ToneCurve::srgb, {{50, 50}, {3, 0}, {0, 20}}).status,
            MarkerStatus::too_small);
}

}  // namespace
}  // namespace hexcal
