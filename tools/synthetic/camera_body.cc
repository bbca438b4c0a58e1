#include "tools/synthetic/camera_body.h"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "tools/synthetic/demosaic.h"
#include "tools/synthetic/native_colour.h"
#include "tools/synthetic/random_source.h"
#include "tools/synthetic/sensor_noise.h"

namespace hexcal {
namespace {

constexpr std::uint64_t kDustStream = 32;
constexpr std::uint64_t kHotPixelStream = 33;
constexpr int kToneLevels = 65536;

using Planes = std::array<cv::Mat, 3>;  // red, green, blue, CV_32FC1

// Share of the light that passes the dust on the sensor's glass: soft-edged spots.
cv::Mat dust_map(const cv::Size& size, int specks, std::uint64_t camera_seed) {
  cv::Mat passing(size, CV_32FC1, cv::Scalar(1));
  RandomSource random(camera_seed, kDustStream);
  for (int i = 0; i < specks; ++i) {
    const double cx = random.uniform(0, size.width);
    const double cy = random.uniform(0, size.height);
    const double radius = random.uniform(1.0e-3, 3.0e-3) * size.width;  // 25 to 70 um
    const double depth = random.uniform(0.05, 0.25);
    const cv::Rect box = cv::Rect(static_cast<int>(cx - 2 * radius), static_cast<int>(cy - 2 * radius),
                                  static_cast<int>(4 * radius) + 2, static_cast<int>(4 * radius) + 2) &
                         cv::Rect({0, 0}, size);
    for (int y = box.y; y < box.y + box.height; ++y) {
      for (int x = box.x; x < box.x + box.width; ++x) {
        const double distance = std::hypot(x - cx, y - cy) / radius;
        passing.at<float>(y, x) *= static_cast<float>(1 - depth / (1 + std::pow(distance, 8)));
      }
    }
  }
  return passing;
}

void add_hot_pixels(cv::Mat& raw, double per_mpx, std::size_t channel, std::uint64_t camera_seed) {
  RandomSource random(camera_seed, kHotPixelStream + 16 * channel);
  const auto count = static_cast<int>(std::lround(per_mpx * 1e-6 * static_cast<double>(raw.total())));
  for (int i = 0; i < count; ++i) {
    const int x = static_cast<int>(random.uniform(0, raw.cols));
    const int y = static_cast<int>(random.uniform(0, raw.rows));
    float& pixel = raw.at<float>(y, x);
    pixel = std::max(pixel, static_cast<float>(random.uniform(0.1, 1.0)));
  }
}

// What the sensor reads, clipped at 1 and without white balance: a mosaic in the first plane, or three
// planes.
class Exposure {
 public:
  Exposure(const SensorImage& image, const ChannelShift& shift, const SensorOptions& options,
           const NativeColour& colour)
      : image_(image), shift_(shift) {
    for (const auto& tint : image.tints) {
      Eigen::Vector3f srgb;
      for (Eigen::Index c = 0; c < 3; ++c) {
        const auto channel = static_cast<std::size_t>(c);
        srgb[c] = tint[channel] * options.white_balance[channel];
      }
      factors_.push_back((colour.balanced_from_srgb * srgb).cwiseQuotient(colour.balance));
    }
  }

  [[nodiscard]] float light(int x, int y, std::size_t channel) const {
    if (shift_.none(channel)) {
      return image_.light.ptr<float>(y)[x] * factors_[image_.tint.ptr<std::uint8_t>(y)[x]][to_index(channel)];
    }
    const Eigen::Vector2d px = shift_.source(x, y, channel);
    const int nearest_x = std::clamp(static_cast<int>(std::lround(px.x())), 0, image_.tint.cols - 1);
    const int nearest_y = std::clamp(static_cast<int>(std::lround(px.y())), 0, image_.tint.rows - 1);
    return std::max(0.0F, interpolated(image_.light, px)) *
           factors_[image_.tint.ptr<std::uint8_t>(nearest_y)[nearest_x]][to_index(channel)];
  }

 private:
  static Eigen::Index to_index(std::size_t channel) { return static_cast<Eigen::Index>(channel); }

  const SensorImage& image_;
  const ChannelShift& shift_;
  std::vector<Eigen::Vector3f> factors_;  // of the light, per tint
};

Planes raw_planes(const Exposure& exposure, const cv::Size& size, const SensorNoise& noise,
                  const SensorEffects& sensor, std::uint64_t camera_seed) {
  const bool mosaic = sensor.demosaicing != Demosaicing::none;
  const cv::Mat dust = sensor.dust_specks > 0 ? dust_map(size, sensor.dust_specks, camera_seed) : cv::Mat();
  Planes planes;
  for (std::size_t c = 0; c < (mosaic ? 1U : 3U); ++c) planes[c].create(size, CV_32FC1);
  tbb::parallel_for(0, size.height, [&](int y) {
    for (int x = 0; x < size.width; ++x) {
      const std::uint64_t random = noise.random(x, y);
      const float passing = dust.empty() ? 1.0F : dust.ptr<float>(y)[x];
      const auto read = [&](std::size_t channel) {
        return std::clamp(noise.added(exposure.light(x, y, channel) * passing, random, channel), 0.0F, 1.0F);
      };
      if (mosaic) {
        planes[0].ptr<float>(y)[x] = read(bayer_channel(x, y));
      } else {
        for (std::size_t c = 0; c < 3; ++c) planes[c].ptr<float>(y)[x] = read(c);
      }
    }
  });
  for (std::size_t c = 0; c < 3 && !planes[c].empty(); ++c) {
    add_hot_pixels(planes[c], sensor.hot_pixels_per_mpx, c, camera_seed);
  }
  return planes;
}

// White balance and what is missing of a mosaic; clipped, so that burnt white stays white.
Planes balanced_planes(Planes raw, const NativeColour& colour, Demosaicing demosaicing) {
  const bool mosaic = demosaicing != Demosaicing::none;
  for (std::size_t c = 0; c < (mosaic ? 1U : 3U); ++c) {
    tbb::parallel_for(0, raw[c].rows, [&](int y) {
      float* row = raw[c].ptr<float>(y);
      for (int x = 0; x < raw[c].cols; ++x) {
        const std::size_t channel = mosaic ? bayer_channel(x, y) : c;
        row[x] = std::min(1.0F, row[x] * colour.balance[static_cast<Eigen::Index>(channel)]);
      }
    });
  }
  return mosaic ? demosaiced(raw[0], demosaicing) : raw;
}

// A monotone cubic through the nodes (Fritsch and Carlson 1980; slopes by the harmonic mean).
double profile_value(const std::vector<std::array<double, 2>>& nodes, double v) {
  if (nodes.empty()) return v;
  if (v <= nodes.front()[0]) return nodes.front()[1];
  if (v >= nodes.back()[0]) return nodes.back()[1];
  const auto secant = [&](std::size_t i) {
    return (nodes[i + 1][1] - nodes[i][1]) / (nodes[i + 1][0] - nodes[i][0]);
  };
  const auto slope = [&](std::size_t i) {
    if (i == 0) return secant(0);
    if (i + 1 == nodes.size()) return secant(i - 1);
    const double a = secant(i - 1);
    const double b = secant(i);
    return a * b <= 0 ? 0.0 : 2 * a * b / (a + b);
  };
  std::size_t i = 0;
  while (nodes[i + 1][0] < v) ++i;
  const double h = nodes[i + 1][0] - nodes[i][0];
  const double t = (v - nodes[i][0]) / h;
  return nodes[i][1] * (1 + 2 * t) * (1 - t) * (1 - t) + h * slope(i) * t * (1 - t) * (1 - t) +
         nodes[i + 1][1] * t * t * (3 - 2 * t) + h * slope(i + 1) * t * t * (t - 1);
}

// Grey values (0 to 255, not rounded) of the photograph's red, green and blue.
Planes tone_mapped(Planes linear, const NativeColour& colour, const SensorOptions& options,
                   const ProcessingEffects& processing) {
  std::vector<float> tone(kToneLevels);
  for (int i = 0; i < kToneLevels; ++i) {
    const double v = profile_value(processing.tone_curve, i / (kToneLevels - 1.0));
    tone[static_cast<std::size_t>(i)] = static_cast<float>(255 * toned(options.tone, v));
  }
  tbb::parallel_for(0, linear[0].rows, [&](int y) {
    const std::array<float*, 3> rows{linear[0].ptr<float>(y), linear[1].ptr<float>(y),
                                     linear[2].ptr<float>(y)};
    for (int x = 0; x < linear[0].cols; ++x) {
      const Eigen::Vector3f srgb =
          colour.srgb_from_balanced * Eigen::Vector3f(rows[0][x], rows[1][x], rows[2][x]);
      for (std::size_t c = 0; c < 3; ++c) {
        const float step =
            std::clamp(srgb[static_cast<Eigen::Index>(c)], 0.0F, 1.0F) * (kToneLevels - 1) + 0.5F;
        rows[c][x] = tone[static_cast<std::size_t>(step)];
      }
    }
  });
  return linear;
}

// A bilateral filter (Tomasi and Manduchi 1998), flat over 5 x 5 pixels: the mean of like neighbours.
cv::Mat smoothed_luminance(const cv::Mat& luminance, double strength) {
  constexpr int kReach = 2;
  constexpr double kLikeGrey = 4;  // neighbours that differ less are noise
  constexpr int kPerGrey = 8;
  cv::Mat padded;
  cv::copyMakeBorder(luminance, padded, kReach, kReach, kReach, kReach, cv::BORDER_REPLICATE);
  std::array<float, 512> weight_of{};  // of the difference in steps of 1 / kPerGrey; none beyond
  for (std::size_t i = 0; i < weight_of.size(); ++i) {
    const double relative = static_cast<double>(i) / kPerGrey / kLikeGrey;
    weight_of[i] = static_cast<float>(std::exp(-0.5 * relative * relative / std::max(strength, 0.1)));
  }
  cv::Mat smooth(luminance.size(), CV_32FC1);
  tbb::parallel_for(0, luminance.rows, [&](int y) {
    for (int x = 0; x < luminance.cols; ++x) {
      const float own = padded.ptr<float>(y + kReach)[x + kReach];
      float sum = 0;
      float weights = 0;
      for (int dy = 0; dy <= 2 * kReach; ++dy) {
        const float* row = padded.ptr<float>(y + dy) + x;
        for (int dx = 0; dx <= 2 * kReach; ++dx) {
          const auto step = static_cast<std::size_t>(std::abs(row[dx] - own) * kPerGrey);
          const float weight = step < weight_of.size() ? weight_of[step] : 0.0F;
          sum += weight * row[dx];
          weights += weight;
        }
      }
      smooth.ptr<float>(y)[x] = sum / weights;
    }
  });
  const double share = std::min(1.0, strength);
  cv::addWeighted(luminance, 1 - share, smooth, share, 0, smooth);
  return smooth;
}

// Noise reduction and sharpening work on luminance and colour differences (ITU-R BT.601), as cameras do.
void reduce_noise_and_sharpen(Planes& grey, const ProcessingEffects& processing) {
  cv::Mat luminance = 0.299 * grey[0] + 0.587 * grey[1] + 0.114 * grey[2];
  for (cv::Mat& plane : grey) plane -= luminance;
  if (processing.noise_reduction > 0) {
    luminance = smoothed_luminance(luminance, processing.noise_reduction);
    for (cv::Mat& plane : grey)
      cv::GaussianBlur(plane, plane, {5, 5}, 1.5 * std::min(1.0, processing.noise_reduction));
  }
  if (processing.sharpening > 0) {
    cv::Mat smooth;
    cv::GaussianBlur(luminance, smooth, {0, 0}, processing.sharpening_radius_px);
    cv::addWeighted(luminance, 1 + processing.sharpening, smooth, -processing.sharpening, 0, luminance);
  }
  for (cv::Mat& plane : grey) plane += luminance;
}

}  // namespace

NativeColour::NativeColour(const std::array<double, 9>& camera_from_xyz) {
  Eigen::Matrix3d xyz_from_srgb;  // IEC 61966-2-1
  xyz_from_srgb << 0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505;
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> matrix(camera_from_xyz.data());
  const Eigen::Matrix3d camera_from_srgb = matrix * xyz_from_srgb;
  const Eigen::Vector3d white = camera_from_srgb.rowwise().sum();
  const Eigen::Matrix3d balanced = white.cwiseInverse().asDiagonal() * camera_from_srgb;
  balanced_from_srgb = balanced.cast<float>();
  srgb_from_balanced = balanced.inverse().cast<float>();
  balance = (white.maxCoeff() * white.cwiseInverse()).cast<float>();
}

cv::Mat develop(const SensorImage& image, const ChannelShift& shift, const SensorOptions& options,
                const SensorEffects& sensor, const ProcessingEffects& processing, std::uint64_t seed,
                std::uint64_t camera_seed) {
  options.validate();
  const NativeColour colour = sensor.colour_matrix ? NativeColour(*sensor.colour_matrix) : NativeColour();
  const Exposure exposure(image, shift, options, colour);
  Planes planes = raw_planes(exposure, image.light.size(), SensorNoise(options, seed), sensor, camera_seed);
  planes = balanced_planes(std::move(planes), colour, sensor.demosaicing);
  planes = tone_mapped(std::move(planes), colour, options, processing);
  if (processing.noise_reduction > 0 || processing.sharpening > 0) {
    reduce_noise_and_sharpen(planes, processing);
  }
  cv::Mat photograph;
  cv::merge(std::array<cv::Mat, 3>{planes[2], planes[1], planes[0]}.data(), 3, photograph);
  photograph.convertTo(photograph, CV_8UC3);
  return photograph;
}

}  // namespace hexcal
