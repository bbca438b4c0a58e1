#include "tools/synthetic/demosaic.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

constexpr int kMargin = 4;  // mirrored pixels around the mosaic; even, so that the pattern goes on

// A mosaic with a mirrored border, addressed by the pixel's own coordinates.
class Mosaic {
 public:
  explicit Mosaic(const cv::Mat& mosaic) {
    cv::copyMakeBorder(mosaic, padded_, kMargin, kMargin, kMargin, kMargin, cv::BORDER_REFLECT_101);
  }
  [[nodiscard]] float at(int x, int y) const { return padded_.ptr<float>(y + kMargin)[x + kMargin]; }
  [[nodiscard]] float beside(int x, int y) const { return at(x - 1, y) + at(x + 1, y); }
  [[nodiscard]] float over(int x, int y) const { return at(x, y - 1) + at(x, y + 1); }
  [[nodiscard]] float diagonal(int x, int y) const {
    return at(x - 1, y - 1) + at(x + 1, y - 1) + at(x - 1, y + 1) + at(x + 1, y + 1);
  }
  [[nodiscard]] float two_beside(int x, int y) const { return at(x - 2, y) + at(x + 2, y); }
  [[nodiscard]] float two_over(int x, int y) const { return at(x, y - 2) + at(x, y + 2); }

 private:
  cv::Mat padded_;
};

// Malvar, He and Cutler 2004, figure 2.
void linear_pixel(const Mosaic& m, int x, int y, std::array<float, 3>& rgb) {
  const std::size_t own = bayer_channel(x, y);
  rgb[own] = m.at(x, y);
  if (own == 1) {
    const float five = 5 * m.at(x, y) - m.diagonal(x, y);
    const float along = (five + 4 * m.beside(x, y) - m.two_beside(x, y) + 0.5F * m.two_over(x, y)) / 8;
    const float across = (five + 4 * m.over(x, y) - m.two_over(x, y) + 0.5F * m.two_beside(x, y)) / 8;
    const bool red_row = y % 2 == 0;
    rgb[0] = red_row ? along : across;
    rgb[2] = red_row ? across : along;
    return;
  }
  const float far = m.two_beside(x, y) + m.two_over(x, y);
  rgb[1] = (4 * m.at(x, y) + 2 * (m.beside(x, y) + m.over(x, y)) - far) / 8;
  rgb[2 - own] = (6 * m.at(x, y) + 2 * m.diagonal(x, y) - 1.5F * far) / 8;
}

// Green at a red or blue pixel along the smoother direction, corrected by that channel's second difference.
float adaptive_green(const Mosaic& m, int x, int y) {
  const float curve_x = 2 * m.at(x, y) - m.two_beside(x, y);
  const float curve_y = 2 * m.at(x, y) - m.two_over(x, y);
  const float change_x = std::abs(m.at(x - 1, y) - m.at(x + 1, y)) + std::abs(curve_x);
  const float change_y = std::abs(m.at(x, y - 1) - m.at(x, y + 1)) + std::abs(curve_y);
  const float along_x = 0.5F * m.beside(x, y) + 0.25F * curve_x;
  const float along_y = 0.5F * m.over(x, y) + 0.25F * curve_y;
  if (change_x < change_y) return along_x;
  return change_y < change_x ? along_y : 0.5F * (along_x + along_y);
}

// Red and blue where they are missing: mean colour difference of the neighbours that have them.
void adaptive_pixel(const Mosaic& m, const Mosaic& green, int x, int y, std::array<float, 3>& rgb) {
  const std::size_t own = bayer_channel(x, y);
  const float g = green.at(x, y);
  rgb[1] = g;
  if (own == 1) {
    const float along = g + 0.5F * (m.beside(x, y) - green.beside(x, y));
    const float across = g + 0.5F * (m.over(x, y) - green.over(x, y));
    const bool red_row = y % 2 == 0;
    rgb[0] = red_row ? along : across;
    rgb[2] = red_row ? across : along;
    return;
  }
  rgb[own] = m.at(x, y);
  rgb[2 - own] = g + 0.25F * (m.diagonal(x, y) - green.diagonal(x, y));
}

}  // namespace

std::array<cv::Mat, 3> demosaiced(const cv::Mat& mosaic, Demosaicing method) {
  if (method == Demosaicing::none) throw InputError("a mosaic needs a way of demosaicing");
  std::array<cv::Mat, 3> rgb;
  for (cv::Mat& plane : rgb) plane.create(mosaic.size(), CV_32FC1);
  const Mosaic raw(mosaic);
  const auto for_all = [&](const auto& pixel) {
    tbb::parallel_for(0, mosaic.rows, [&](int y) {
      std::array<float, 3> value{};
      for (int x = 0; x < mosaic.cols; ++x) {
        pixel(x, y, value);
        for (std::size_t c = 0; c < 3; ++c) rgb[c].ptr<float>(y)[x] = value[c];
      }
    });
  };
  if (method == Demosaicing::linear) {
    for_all([&](int x, int y, auto& value) { linear_pixel(raw, x, y, value); });
    return rgb;
  }
  cv::Mat full_green(mosaic.size(), CV_32FC1);
  tbb::parallel_for(0, mosaic.rows, [&](int y) {
    for (int x = 0; x < mosaic.cols; ++x) {
      full_green.ptr<float>(y)[x] = bayer_channel(x, y) == 1 ? raw.at(x, y) : adaptive_green(raw, x, y);
    }
  });
  const Mosaic green(full_green);
  for_all([&](int x, int y, auto& value) { adaptive_pixel(raw, green, x, y, value); });
  return rgb;
}

}  // namespace hexcal
