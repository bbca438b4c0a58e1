#include "tools/synthetic/lens_effects.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "tools/synthetic/random_source.h"

namespace hexcal {
namespace {

constexpr std::uint64_t kShakeStream = 30;
constexpr std::uint64_t kShutterStream = 31;
constexpr double kMaxDiscPx = 16;  // radius; what is that far out of focus need not be more so
constexpr double kDiscStepPx = 1.0 / 16;

struct DiscTap {
  int dx, dy;
  float weight;
};

// A disc as weights of pixels: how much of each it covers, to 1/16 px.
std::vector<DiscTap> disc_taps(double radius_px) {
  constexpr int kFine = 16;
  const int reach = static_cast<int>(std::ceil(radius_px - 0.5));
  if (reach < 1) return {{0, 0, 1.0F}};
  std::vector<DiscTap> taps;
  double sum = 0;
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      int covered = 0;
      for (int v = 0; v < kFine; ++v) {
        for (int u = 0; u < kFine; ++u) {
          const double x = dx + (u + 0.5) / kFine - 0.5;
          const double y = dy + (v + 0.5) / kFine - 0.5;
          covered += x * x + y * y < radius_px * radius_px ? 1 : 0;
        }
      }
      if (covered > 0) taps.push_back({dx, dy, static_cast<float>(covered)});
      sum += covered;
    }
  }
  for (DiscTap& tap : taps) tap.weight /= static_cast<float>(sum);
  return taps;
}

const std::vector<std::vector<DiscTap>>& disc_table() {
  static const auto table = [] {
    std::vector<std::vector<DiscTap>> discs;
    for (double radius = 0; radius <= kMaxDiscPx; radius += kDiscStepPx) discs.push_back(disc_taps(radius));
    return discs;
  }();
  return table;
}

// Distance from the lens to the image of a point at `depth_mm`, by the thin lens equation.
double image_distance_mm(double focal_mm, double depth_mm) {
  return focal_mm * depth_mm / (depth_mm - focal_mm);
}

// Each pixel gathers over its own circle of confusion: right where the depth changes slowly.
void defocus(SensorImage& image, const LensEffects& effects, double focal_mm, double focus_mm) {
  const double pitch_mm = kSensorWidthMm / image.light.cols;
  const double sensor_mm = image_distance_mm(focal_mm, focus_mm);
  const double aperture_mm = focal_mm / effects.f_number;
  const double cx = 0.5 * (image.light.cols - 1);
  const double cy = 0.5 * (image.light.rows - 1);
  const auto radius_px = [&](int x, int y) {
    const float depth = image.depth_mm.at<float>(y, x);
    if (!(depth > 2 * focal_mm)) return 0.0;
    const double r2 = ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (cx * cx + cy * cy);
    const double image_mm = image_distance_mm(focal_mm, depth);
    const double off_mm = std::abs(sensor_mm - image_mm - effects.field_curvature_mm * r2);
    return 0.5 * aperture_mm * off_mm / image_mm / pitch_mm;
  };
  const auto& discs = disc_table();
  const int margin = static_cast<int>(std::ceil(kMaxDiscPx));
  cv::Mat padded;
  cv::copyMakeBorder(image.light, padded, margin, margin, margin, margin, cv::BORDER_REPLICATE);
  tbb::parallel_for(0, image.light.rows, [&](int y) {
    float* to = image.light.ptr<float>(y);
    for (int x = 0; x < image.light.cols; ++x) {
      const auto step = static_cast<std::size_t>(radius_px(x, y) / kDiscStepPx + 0.5);
      float sum = 0;
      for (const DiscTap& tap : discs[std::min(step, discs.size() - 1)]) {
        sum += tap.weight * padded.ptr<float>(y + margin + tap.dy)[x + margin + tap.dx];
      }
      to[x] = sum;
    }
  });
}

// The way of the image on the sensor, centred, as a kernel: even light along a straight line.
cv::Mat shake_kernel(double length_px, double direction_rad) {
  const int reach = static_cast<int>(std::ceil(0.5 * length_px)) + 1;
  cv::Mat kernel = cv::Mat::zeros(2 * reach + 1, 2 * reach + 1, CV_32FC1);
  constexpr int kSteps = 256;
  for (int i = 0; i < kSteps; ++i) {
    const double s = length_px * ((i + 0.5) / kSteps - 0.5);
    const double x = reach + s * std::cos(direction_rad);
    const double y = reach + s * std::sin(direction_rad);
    const int x0 = static_cast<int>(x);
    const int y0 = static_cast<int>(y);
    for (int k = 0; k < 4; ++k) {
      const double u = k % 2 == 0 ? 1 - (x - x0) : x - x0;
      const double v = k / 2 == 0 ? 1 - (y - y0) : y - y0;
      kernel.at<float>(y0 + k / 2, x0 + k % 2) += static_cast<float>(u * v / kSteps);
    }
  }
  return kernel;
}

void add_glare(cv::Mat& light, double share) {
  const int columns = std::min(64, light.cols);
  const int rows = std::max(1, columns * light.rows / light.cols);
  cv::Mat veil;
  cv::resize(light, veil, {columns, rows}, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(veil, veil, {0, 0}, 0.2 * columns, 0, cv::BORDER_REPLICATE);
  cv::resize(veil, veil, light.size(), 0, 0, cv::INTER_LINEAR);
  cv::addWeighted(light, 1 - share, veil, share, 0, light);
}

// Lagrange's polynomials of degree 5 through the six nearest pixels, at 1/256 px. They keep the first moment
// of an edge, and so its place, exactly; a windowed sinc does not.
const std::vector<std::array<float, 6>>& lagrange_table() {
  constexpr int kPhases = 256;
  static const auto table = [] {
    std::vector<std::array<float, 6>> phases(kPhases + 1);
    for (int phase = 0; phase <= kPhases; ++phase) {
      const double t = 2 + static_cast<double>(phase) / kPhases;  // from the first of the six
      for (int k = 0; k < 6; ++k) {
        double weight = 1;
        for (int m = 0; m < 6; ++m) {
          if (m != k) weight *= (t - m) / (k - m);
        }
        phases[static_cast<std::size_t>(phase)][static_cast<std::size_t>(k)] = static_cast<float>(weight);
      }
    }
    return phases;
  }();
  return table;
}

}  // namespace

void apply_lens_effects(SensorImage& image, const LensEffects& effects, double focal_mm, double focus_mm,
                        std::uint64_t seed) {
  if (effects.f_number > 0) defocus(image, effects, focal_mm, focus_mm);
  if (effects.shake_px > 0) {
    RandomSource random(seed, kShakeStream);
    const cv::Mat kernel = shake_kernel(effects.shake_px, random.uniform(0, std::numbers::pi));
    cv::filter2D(image.light, image.light, -1, kernel, {-1, -1}, 0, cv::BORDER_REPLICATE);
  }
  if (effects.veiling_glare > 0) add_glare(image.light, effects.veiling_glare);
}

ChannelShift::ChannelShift(const LensEffects& effects, const CameraModel& camera, double focal_mm,
                           std::uint64_t seed)
    : colour_(profile_lateral_colour(focal_mm, camera.width_px)),
      principal_px_(camera.parameters[2], camera.parameters[3]),
      height_px_(camera.height_px) {
  for (std::size_t channel = 0; channel < 3; ++channel) {
    colour_.v[channel] = 1 + effects.lateral_colour * (colour_.v[channel] - 1);
    colour_.b[channel] *= effects.lateral_colour;
    none_[channel] = effects.rolling_shutter_px == 0 && (effects.lateral_colour == 0 || channel == 1);
  }
  RandomSource random(seed, kShutterStream);
  const double direction = random.uniform(0, 2 * std::numbers::pi);
  rows_px_ = effects.rolling_shutter_px * Eigen::Vector2d(std::cos(direction), std::sin(direction));
}

Eigen::Vector2d ChannelShift::source(int x, int y, std::size_t channel) const {
  const Eigen::Vector2d at(x, y);
  const Eigen::Vector2d from = at - principal_px_;
  // The factor at this radius instead of the one sought: they differ by less than 1e-6.
  const double r2 = from.squaredNorm() / (colour_.unit_px * colour_.unit_px);
  const Eigen::Vector2d seen = from / (colour_.v[channel] + colour_.b[channel] * r2);
  return principal_px_ + seen - (y / height_px_ - 0.5) * rows_px_;
}

float interpolated(const cv::Mat& image, const Eigen::Vector2d& px) {
  const auto& table = lagrange_table();
  const double fx = std::floor(px.x());
  const double fy = std::floor(px.y());
  const auto phase = [](double part) { return static_cast<std::size_t>(part * 256 + 0.5); };
  const std::array<float, 6>& across = table[phase(px.x() - fx)];
  const std::array<float, 6>& down = table[phase(px.y() - fy)];
  const int x0 = static_cast<int>(fx) - 2;
  const int y0 = static_cast<int>(fy) - 2;
  float sum = 0;
  for (int j = 0; j < 6; ++j) {
    const float* row = image.ptr<float>(std::clamp(y0 + j, 0, image.rows - 1));
    float line = 0;
    for (int i = 0; i < 6; ++i) {
      line += across[static_cast<std::size_t>(i)] * row[std::clamp(x0 + i, 0, image.cols - 1)];
    }
    sum += down[static_cast<std::size_t>(j)] * line;
  }
  return sum;
}

}  // namespace hexcal
