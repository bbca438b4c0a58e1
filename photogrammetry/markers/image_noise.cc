#include "photogrammetry/markers/image_noise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace hexcal {
namespace {

constexpr int kWindow = 8;
constexpr int kMaxWindowsPerAxis = 72;
constexpr std::size_t kMinWindows = 8;
constexpr double kQuantile = 0.25;
constexpr double kQuantileOfUnitVariance = 0.87;  // of chi^2 over 61 degrees of freedom
constexpr double kMaxRatio = 6;                   // between levels: more is texture

struct WindowNoise {
  double mean, variance;
  bool clipped;
};

// Where a heap at the end of a histogram begins, walking inwards from its last value that occurs; `end` (the
// end of the scale) without one. Clipping piles up whatever lay beyond on one value, and noise after it
// (JPEG) on its neighbours; light alone gives no value many times the pixels of those a little further in.
int clip_from(const std::array<int, 256>& histogram, int end, int inwards) {
  constexpr int kSearched = 24;  // from the end of the scale
  constexpr int kHeap = 4;       // values it spreads over
  constexpr int kBeside = 8;     // values beside it
  constexpr double kHeight = 6;  // over the mean of those
  constexpr int kLeastPixels = 20;
  int last = end;
  while (std::abs(last - end) < kSearched && histogram[static_cast<std::size_t>(last)] == 0) last += inwards;
  int peak = last;
  for (int k = 0; k < kHeap; ++k) {
    const int at = last + k * inwards;
    if (histogram[static_cast<std::size_t>(at)] > histogram[static_cast<std::size_t>(peak)]) peak = at;
  }
  const int height = histogram[static_cast<std::size_t>(peak)];
  double beside = 0;
  for (int k = kHeap; k < kHeap + kBeside; ++k) {
    beside += histogram[static_cast<std::size_t>(peak + k * inwards)] / double{kBeside};
  }
  if (height < kLeastPixels || height < kHeight * beside) return end;
  int from = peak;
  for (int k = 1; k < kHeap; ++k) {
    const int at = peak + k * inwards;
    if (histogram[static_cast<std::size_t>(at)] < 0.1 * height) break;
    from = at;
  }
  return from;
}

template <typename Pixel>
WindowNoise window_noise(const cv::Mat& grey, int x0, int y0, int black_clip, int white_clip) {
  constexpr double kMiddle = 0.5 * (kWindow - 1);
  constexpr int kCount = kWindow * kWindow;
  double sum = 0;
  double squares = 0;
  double along_x = 0;
  double along_y = 0;
  bool clipped = false;
  for (int y = 0; y < kWindow; ++y) {
    const Pixel* row = grey.ptr<Pixel>(y0 + y) + x0;
    for (int x = 0; x < kWindow; ++x) {
      const double value = row[x];
      clipped = clipped || row[x] <= black_clip || row[x] >= white_clip;
      sum += value;
      squares += value * value;
      along_x += value * (x - kMiddle);
      along_y += value * (y - kMiddle);
    }
  }
  constexpr double kMoment = kWindow * (kWindow * (kWindow * kWindow - 1) / 12.0);
  const double rest = squares - sum * sum / kCount - (along_x * along_x + along_y * along_y) / kMoment;
  return {sum / kCount, std::max(rest, 0.0) / (kCount - 3), clipped};
}

// 16 bits come from RAW or a program: they clip at the end of the scale alone.
void find_clipping(const cv::Mat& grey, const cv::Rect& box, int& black_clip, int& white_clip) {
  black_clip = 0;
  white_clip = grey.depth() == CV_16U ? 65535 : 255;
  if (grey.depth() == CV_16U) return;
  std::array<int, 256> histogram{};
  const int step = std::max(1, static_cast<int>(std::sqrt(box.area() / 250000.0)));
  for (int y = box.y; y < box.y + box.height; y += step) {
    const std::uint8_t* row = grey.ptr(y);
    for (int x = box.x; x < box.x + box.width; x += step) ++histogram[row[x]];
  }
  black_clip = clip_from(histogram, 0, 1);
  white_clip = clip_from(histogram, 255, -1);
}

}  // namespace

double full_scale(const cv::Mat& grey) { return grey.depth() == CV_16U ? 65535.0 : 255.0; }

double NoiseModel::variance(double encoded) const {
  const double at = std::clamp(encoded, 0.0, 1.0) * (kLevels - 1);
  const auto i = std::min(static_cast<std::size_t>(at), static_cast<std::size_t>(kLevels - 2));
  const double share = at - static_cast<double>(i);
  return at_level_[i] + share * (at_level_[i + 1] - at_level_[i]);
}

NoiseModel estimate_noise(const cv::Mat& grey, const cv::Rect& region) {
  const cv::Rect box = region & cv::Rect(0, 0, grey.cols, grey.rows);
  const double scale = full_scale(grey);
  const double rounding = 1 / (12 * scale * scale);
  NoiseModel model;
  find_clipping(grey, box, model.black_clip_, model.white_clip_);
  std::array<std::vector<double>, NoiseModel::kLevels> by_level;
  const int black = model.black_clip_;
  const int white = model.white_clip_;
  const auto stride_of = [](int length) { return std::max(length / kMaxWindowsPerAxis, kWindow / 2); };
  for (int y = box.y; y + kWindow <= box.y + box.height; y += stride_of(box.height)) {
    for (int x = box.x; x + kWindow <= box.x + box.width; x += stride_of(box.width)) {
      const WindowNoise window = grey.depth() == CV_16U
                                     ? window_noise<std::uint16_t>(grey, x, y, black, white)
                                     : window_noise<std::uint8_t>(grey, x, y, black, white);
      if (window.clipped) continue;
      const double level = window.mean / scale * (NoiseModel::kLevels - 1);
      by_level[static_cast<std::size_t>(level + 0.5)].push_back(window.variance / (scale * scale));
    }
  }
  std::array<double, NoiseModel::kLevels> found{};
  double quietest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < by_level.size(); ++i) {
    auto& variances = by_level[i];
    if (variances.size() < kMinWindows) continue;
    const auto nth =
        variances.begin() + static_cast<std::ptrdiff_t>(kQuantile * static_cast<double>(variances.size()));
    std::nth_element(variances.begin(), nth, variances.end());
    found[i] = std::max(*nth / kQuantileOfUnitVariance, rounding);
    quietest = std::min(quietest, found[i]);
  }
  if (!std::isfinite(quietest)) {
    model.at_level_.fill(std::max(1.0 / (255.0 * 255.0), rounding));
    return model;
  }
  // A level of which only edges and texture are seen tells nothing. Linear between the others, constant
  // beyond them.
  for (double& variance : found) {
    if (variance > kMaxRatio * quietest) variance = 0;
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    std::size_t below = i;
    while (below > 0 && found[below] == 0) --below;
    std::size_t above = i;
    while (above + 1 < found.size() && found[above] == 0) ++above;
    if (found[below] == 0) below = above;
    if (found[above] == 0) above = below;
    const double share =
        above > below ? static_cast<double>(i - below) / static_cast<double>(above - below) : 0;
    model.at_level_[i] = found[below] + share * (found[above] - found[below]);
  }
  return model;
}

}  // namespace hexcal
