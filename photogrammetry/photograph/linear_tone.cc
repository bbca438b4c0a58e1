#include "photogrammetry/photograph/linear_tone.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "photogrammetry/photograph/file_signature.h"

namespace hexcal {
namespace {

constexpr int kBlock = 8;
constexpr double kLevelsPerDoubling = 2;
constexpr std::size_t kFewestBlocks = 12;  // of a level
constexpr double kLeastRange = 2.5;        // brightest over darkest: less does not tell
// Exponent of the variance over the value: 1 for light, about -0.4 after the sRGB curve.
constexpr double kLinearExponent = 0.35;

// The gamma chunk's number over 100 000 (PNG 1.2, 11.3.3.2): 1 is linear, 0.45455 the usual.
std::optional<double> png_gamma(std::string_view bytes) {
  if (file_signature(bytes) != FileSignature::png) return std::nullopt;
  const std::size_t chunk = bytes.substr(0, bytes.find("IDAT")).find("gAMA");
  if (chunk == std::string_view::npos || chunk + 8 > bytes.size()) return std::nullopt;
  std::uint32_t value = 0;
  for (std::size_t i = chunk + 4; i < chunk + 8; ++i) {
    value = value << 8 | static_cast<unsigned char>(bytes[i]);
  }
  return value / 100000.0;
}

struct Block {
  double mean, variance;  // the variance about a plane
};

Block block_at(const cv::Mat& grey, int x0, int y0) {
  constexpr double kMiddle = 0.5 * (kBlock - 1);
  constexpr double kPoints = kBlock * kBlock;
  constexpr double kSquares = kPoints * (kBlock * kBlock - 1) / 12.0;  // of x about its middle
  double sum = 0;
  double squares = 0;
  double by_x = 0;
  double by_y = 0;
  for (int y = 0; y < kBlock; ++y) {
    const std::uint16_t* row = grey.ptr<std::uint16_t>(y0 + y) + x0;
    for (int x = 0; x < kBlock; ++x) {
      sum += row[x];
      squares += static_cast<double>(row[x]) * row[x];
      by_x += (x - kMiddle) * row[x];
      by_y += (y - kMiddle) * row[x];
    }
  }
  const double mean = sum / kPoints;
  const double left = squares - kPoints * mean * mean - (by_x * by_x + by_y * by_y) / kSquares;
  return {mean, std::max(left, 0.0) / (kPoints - 3)};
}

// Blocks by brightness, in steps of half a doubling; clipped and black ones have no noise.
std::map<int, std::vector<Block>> blocks_by_level(const cv::Mat& grey) {
  constexpr double kDarkest = 64;
  constexpr double kBrightest = 64000;
  std::map<int, std::vector<Block>> levels;
  for (int y = 0; y + kBlock <= grey.rows; y += kBlock) {
    for (int x = 0; x + kBlock <= grey.cols; x += kBlock) {
      const Block block = block_at(grey, x, y);
      if (block.mean < kDarkest || block.mean > kBrightest) continue;
      levels[static_cast<int>(std::floor(kLevelsPerDoubling * std::log2(block.mean)))].push_back(block);
    }
  }
  return levels;
}

// Slope of log variance over log mean, of each level its quiet tenth: edges and texture only add variance.
std::optional<double> noise_exponent(const cv::Mat& grey) {
  constexpr double kRounding = 1.0 / 12;
  double count = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double xx = 0;
  double xy = 0;
  double darkest = 0;
  double brightest = 0;
  for (auto& [level, blocks] : blocks_by_level(grey)) {
    if (blocks.size() < kFewestBlocks) continue;
    const auto quiet = blocks.begin() + static_cast<std::ptrdiff_t>(blocks.size() / 10);
    std::nth_element(blocks.begin(), quiet, blocks.end(),
                     [](const Block& a, const Block& b) { return a.variance < b.variance; });
    if (quiet->variance < 4 * kRounding) continue;  // smoothed away
    const Eigen::Vector2d point(std::log(quiet->mean), std::log(quiet->variance));
    if (count == 0) darkest = quiet->mean;
    brightest = quiet->mean;
    count += 1;
    sum += point;
    xx += point.x() * point.x();
    xy += point.x() * point.y();
  }
  if (count < 2 || brightest < kLeastRange * darkest) return std::nullopt;
  return (xy - sum.x() * sum.y() / count) / (xx - sum.x() * sum.x() / count);
}

}  // namespace

ToneCurve judged_tone(std::string_view bytes, const cv::Mat& grey) {
  if (const auto gamma = png_gamma(bytes)) return *gamma > 0.8 ? ToneCurve::linear : ToneCurve::srgb;
  const auto exponent = noise_exponent(grey);
  return exponent && *exponent > kLinearExponent ? ToneCurve::linear : ToneCurve::srgb;
}

}  // namespace hexcal
