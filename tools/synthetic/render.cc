#include "tools/synthetic/render.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "kinematics/geometry/input_error.h"
#include "tools/synthetic/sensor_noise.h"
#include "tools/synthetic/tile_renderer.h"

namespace hexcal {
namespace {

constexpr int kToneSteps = 65536;

}  // namespace

void OpticsOptions::validate() const {
  if (!(blur_px >= 0 && blur_px <= 12)) {
    throw InputError(fmt::format("blur_px is {}, wanted 0 to 12", blur_px));
  }
  if (!(exposure > 0)) throw InputError(fmt::format("exposure is {}, wanted more than 0", exposure));
}

void SensorOptions::validate() const {
  if (!(full_well_electrons >= 0)) {
    throw InputError(fmt::format("full_well_electrons is {}, wanted 0 or more", full_well_electrons));
  }
  if (!(read_noise >= 0)) throw InputError(fmt::format("read_noise is {}, wanted 0 or more", read_noise));
}

SensorImage render(const Scene& scene, const RayLattice& lens, const Rigid3& camera_from_world,
                   const OpticsOptions& options, std::uint64_t seed) {
  options.validate();
  if (scene.surfaces.size() > 255) throw InputError("a scene has at most 255 surfaces");
  const CameraModel& camera = lens.camera();
  SensorImage image;
  image.light.create(camera.height_px, camera.width_px, CV_32FC1);
  image.tint.create(camera.height_px, camera.width_px, CV_8UC1);
  if (options.depth) image.depth_mm.create(image.light.size(), CV_32FC1);
  for (const Surface& surface : scene.surfaces) image.tints.push_back(surface.tint);
  if (image.tints.empty()) image.tints.push_back({1, 1, 1});
  const TileRenderer renderer(scene, lens, camera_from_world, options, seed);
  constexpr int kTile = TileRenderer::kTilePx;
  const int across = (camera.width_px + kTile - 1) / kTile;
  const int down = (camera.height_px + kTile - 1) / kTile;
  tbb::parallel_for(0, across * down,
                    [&](int i) { renderer.tile(i % across * kTile, i / across * kTile, image); });
  const double cx = 0.5 * (camera.width_px - 1);
  const double cy = 0.5 * (camera.height_px - 1);
  const double corner2 = cx * cx + cy * cy;
  tbb::parallel_for(0, camera.height_px, [&](int y) {
    float* row = image.light.ptr<float>(y);
    for (int x = 0; x < camera.width_px; ++x) {
      const double r2 = ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / corner2;
      const auto& k = options.vignetting;
      row[x] *= static_cast<float>(options.exposure * (1 + r2 * (k[0] + r2 * (k[1] + r2 * k[2]))));
    }
  });
  return image;
}

double toned(ToneCurveKind tone, double light) {
  const double v = std::clamp(light, 0.0, 1.0);
  const double srgb = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
  switch (tone) {
    case ToneCurveKind::srgb:
      return srgb;
    case ToneCurveKind::gamma22:
      return std::pow(v, 1 / 2.2);
    case ToneCurveKind::s_curve:
      // A camera's contrast on top of sRGB: steeper in the middle, flat at both ends.
      return srgb + 0.25 * srgb * (1 - srgb) * (2 * srgb - 1);
    case ToneCurveKind::linear:
      return v;
  }
  return v;
}

cv::Mat develop(const SensorImage& image, const SensorOptions& options, std::uint64_t seed) {
  options.validate();
  std::vector<std::uint8_t> tone(kToneSteps);
  for (int i = 0; i < kToneSteps; ++i) {
    tone[static_cast<std::size_t>(i)] =
        static_cast<std::uint8_t>(std::lround(255 * toned(options.tone, i / (kToneSteps - 1.0))));
  }
  const SensorNoise noise(options, seed);
  cv::Mat photograph(image.light.size(), CV_8UC3);
  tbb::parallel_for(0, image.light.rows, [&](int y) {
    const float* light = image.light.ptr<float>(y);
    const std::uint8_t* tint = image.tint.ptr<std::uint8_t>(y);
    std::uint8_t* to = photograph.ptr<std::uint8_t>(y);
    for (int x = 0; x < image.light.cols; ++x) {
      const std::uint64_t random = noise.random(x, y);
      const auto& colour = image.tints[tint[x]];
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const float v = light[x] * colour[channel] * options.white_balance[channel];
        const float noisy = noise.added(v, random, channel);
        const float step = std::clamp(noisy, 0.0F, 1.0F) * (kToneSteps - 1) + 0.5F;
        to[3 * x + 2 - static_cast<int>(channel)] = tone[static_cast<std::size_t>(step)];
      }
    }
  });
  return photograph;
}

}  // namespace hexcal
