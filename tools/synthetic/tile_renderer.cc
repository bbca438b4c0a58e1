#include "tools/synthetic/tile_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tools/synthetic/random_source.h"

namespace hexcal {
namespace {

constexpr int kSub = 4;            // sub-pixels per pixel and axis
constexpr int kSamples = 256;      // of a pixel with an edge, 16 in each sub-pixel
constexpr int kRoughSamples = 16;  // where only the background has an edge
constexpr int kBlockPx = 8;
constexpr std::size_t kMaxSeen = 8;  // surfaces in one pixel
constexpr float kDarkness = 0.004F;  // where a ray meets nothing

struct NetPoint {
  std::uint8_t x, y;
};

// The first 256 points of Sobol's (0,2)-sequence in units of 1/256.
constexpr std::array<NetPoint, kSamples> sobol_net() {
  std::array<NetPoint, kSamples> net{};
  for (unsigned i = 0; i < kSamples; ++i) {
    unsigned x = 0;
    unsigned y = 0;
    unsigned direction = 128;
    for (unsigned bit = 0; bit < 8; ++bit, direction ^= direction >> 1) {
      if ((i >> bit & 1U) != 0) {
        x ^= 128U >> bit;
        y ^= direction;
      }
    }
    net[i] = {static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y)};
  }
  return net;
}
constexpr auto kNet = sobol_net();

}  // namespace

struct TileRenderer::Canvas {
  int x0, y0;                         // first pixel inside the margin
  int width, height;                  // inside the margin
  int columns, rows;                  // with the margin
  std::vector<Eigen::Vector2d> rays;  // of the pixels' corners, (columns + 1) x (rows + 1)
  std::vector<int> candidates;
  std::vector<float> light;
  std::vector<std::uint8_t> tint;
  struct Edge {
    int pixel;
    std::array<float, kSub * kSub> light;
  };
  std::vector<Edge> edges;

  [[nodiscard]] const Eigen::Vector2d& corner(int x, int y) const {
    return rays[static_cast<std::size_t>(y * (columns + 1) + x)];
  }
};

// Pixels x0 .. x1 - 1, y0 .. y1 - 1 of a canvas.
struct TileRenderer::Block {
  int x0, y0, x1, y1;
};

struct TileRenderer::Seen {
  int surface;
  Footprint footprint;
  Eigen::Vector4d depth_mm;  // at the corners, 0 where the surface is seen edge-on or from behind
  Eigen::Vector2d middle;    // in the drawing's frame
};

TileRenderer::TileRenderer(const Scene& scene, const RayLattice& lens, const Rigid3& camera_from_world,
                           const OpticsOptions& options, std::uint64_t seed)
    : lens_(lens), seed_(mixed_bits(seed ^ 0x5A3DULL)) {
  for (std::size_t i = 0; i < scene.surfaces.size(); ++i) {
    surfaces_.emplace_back(scene.surfaces[i], scene.lamp, camera_from_world, static_cast<int>(i));
  }
  const double sigma = std::max(options.blur_px * kSub, 1e-3);
  radius_ = static_cast<int>(std::ceil(4.5 * sigma));
  margin_px_ = (radius_ + kSub - 1) / kSub + 1;
  kernel_.assign(static_cast<std::size_t>(2 * radius_ + kSub), 0.0F);
  double sum = 0;
  for (int i = -radius_; i <= radius_; ++i) sum += std::exp(-0.5 * i * i / (sigma * sigma));
  for (int i = -radius_; i <= radius_; ++i) {
    const double weight = std::exp(-0.5 * i * i / (sigma * sigma)) / sum / kSub;
    for (int k = 0; k < kSub; ++k) {
      kernel_[static_cast<std::size_t>(i + radius_ + k)] += static_cast<float>(weight);
    }
  }
}

void TileRenderer::tile(int x0, int y0, SensorImage& image) const {
  Canvas canvas;
  canvas.x0 = x0;
  canvas.y0 = y0;
  canvas.width = std::min(kTilePx, image.light.cols - x0);
  canvas.height = std::min(kTilePx, image.light.rows - y0);
  canvas.columns = canvas.width + 2 * margin_px_;
  canvas.rows = canvas.height + 2 * margin_px_;
  const auto pixels = static_cast<std::size_t>(canvas.columns * canvas.rows);
  canvas.light.assign(pixels, 0.0F);
  canvas.tint.assign(pixels, 0);
  trace(canvas);
  shade(canvas);
  blur(canvas, image);
  if (!image.depth_mm.empty()) measure_depth(canvas, image);
}

void TileRenderer::measure_depth(const Canvas& canvas, SensorImage& image) const {
  for (int y = 0; y < canvas.height; ++y) {
    float* to = image.depth_mm.ptr<float>(canvas.y0 + y) + canvas.x0;
    const std::uint8_t* tint = image.tint.ptr<std::uint8_t>(canvas.y0 + y) + canvas.x0;
    for (int x = 0; x < canvas.width; ++x) {
      const Eigen::Vector2d ray = 0.5 * (canvas.corner(x + margin_px_, y + margin_px_) +
                                         canvas.corner(x + margin_px_ + 1, y + margin_px_ + 1));
      to[x] = static_cast<float>(surfaces_[tint[x]].hit(ray.x(), ray.y()).depth_mm);
    }
  }
}

void TileRenderer::trace(Canvas& canvas) const {
  lens_.rays({canvas.x0 - margin_px_ - 0.5, canvas.y0 - margin_px_ - 0.5}, canvas.columns + 1,
             canvas.rows + 1, canvas.rays);
  Eigen::Vector2d low = canvas.rays.front();
  Eigen::Vector2d high = low;
  for (const Eigen::Vector2d& ray : canvas.rays) {
    low = low.cwiseMin(ray);
    high = high.cwiseMax(ray);
  }
  for (std::size_t i = 0; i < surfaces_.size(); ++i) {
    if (surfaces_[i].may_meet(low, high)) {
      canvas.candidates.push_back(static_cast<int>(i));
    }
  }
}

// What a rectangle of pixels can show, nearest first, without what is wholly hidden. `widen` allows for the
// lens: how far, relative to its size, the rectangle on a surface may exceed the hull of its corners.
void TileRenderer::classify(const Canvas& canvas, const Block& block, const std::vector<int>& candidates,
                            double widen, std::vector<Seen>& seen) const {
  const std::array<Eigen::Vector2d, 4> corners{
      canvas.corner(block.x0, block.y0), canvas.corner(block.x1, block.y0), canvas.corner(block.x1, block.y1),
      canvas.corner(block.x0, block.y1)};
  seen.clear();
  for (const int candidate : candidates) {
    const VisibleSurface& surface = surfaces_[static_cast<std::size_t>(candidate)];
    Eigen::Vector2d low;
    Eigen::Vector2d high;
    Seen next{candidate, {}, Eigen::Vector4d::Zero(), Eigen::Vector2d::Zero()};
    int missed = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const VisibleSurface::Hit hit = surface.hit(corners[k].x(), corners[k].y());
      missed += hit.depth_mm <= 0 ? 1 : 0;
      low = k == 0 ? hit.at : Eigen::Vector2d(low.cwiseMin(hit.at));
      high = k == 0 ? hit.at : Eigen::Vector2d(high.cwiseMax(hit.at));
      next.depth_mm[static_cast<Eigen::Index>(k)] = hit.depth_mm;
      next.middle += 0.25 * hit.at;
    }
    if (missed == 4) continue;
    const Eigen::Vector2d more = widen * (high - low);
    // A surface seen edge-on within the rectangle has no footprint there.
    next.footprint =
        missed > 0 ? Footprint{Cover::partly, 0} : surface.paint().footprint(low - more, high + more);
    if (next.footprint.cover == Cover::outside) continue;
    const auto place = std::find_if(seen.begin(), seen.end(),
                                    [&](const Seen& other) { return next.depth_mm[0] < other.depth_mm[0]; });
    seen.insert(place, next);
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i].footprint.cover == Cover::partly) continue;
    const Eigen::Vector4d cover = seen[i].depth_mm;
    const auto hidden = [&](const Seen& other) { return (other.depth_mm.array() > cover.array()).all(); };
    seen.erase(std::remove_if(seen.begin() + static_cast<std::ptrdiff_t>(i) + 1, seen.end(), hidden),
               seen.end());
    break;
  }
}

// Blocks that show one plain piece of one surface are filled; in others each pixel is looked at.
void TileRenderer::shade(Canvas& canvas) const {
  std::vector<Seen> seen;
  std::vector<int> near;
  for (int y0 = 0; y0 < canvas.rows; y0 += kBlockPx) {
    for (int x0 = 0; x0 < canvas.columns; x0 += kBlockPx) {
      const Block block{x0, y0, std::min(x0 + kBlockPx, canvas.columns),
                        std::min(y0 + kBlockPx, canvas.rows)};
      classify(canvas, block, canvas.candidates, 0.03, seen);
      near.clear();
      for (const Seen& one : seen) near.push_back(one.surface);
      const bool plain = seen.size() == 1 && seen[0].footprint.cover == Cover::uniform;
      const float albedo = plain ? seen[0].footprint.albedo : 0;
      for (int y = y0; y < block.y1; ++y) {
        for (int x = x0; x < block.x1; ++x) {
          if (plain) {
            const VisibleSurface& surface = surfaces_[static_cast<std::size_t>(near[0])];
            const Eigen::Vector2d ray = 0.5 * (canvas.corner(x, y) + canvas.corner(x + 1, y + 1));
            fill(canvas, x, y, surface, albedo, surface.hit(ray.x(), ray.y()).at);
          } else {
            shade_pixel(canvas, x, y, near, seen);
          }
        }
      }
    }
  }
}

void TileRenderer::fill(Canvas& canvas, int x, int y, const VisibleSurface& surface, float albedo,
                        const Eigen::Vector2d& at) const {
  const auto pixel = static_cast<std::size_t>(y * canvas.columns + x);
  canvas.light[pixel] = albedo * surface.irradiance(at) * surface.grain(at) + surface.sheen(at);
  canvas.tint[pixel] = static_cast<std::uint8_t>(surface.index());
}

void TileRenderer::shade_pixel(Canvas& canvas, int x, int y, const std::vector<int>& candidates,
                               std::vector<Seen>& seen) const {
  classify(canvas, {x, y, x + 1, y + 1}, candidates, 0, seen);
  if (seen.empty()) {
    canvas.light[static_cast<std::size_t>(y * canvas.columns + x)] = kDarkness;
  } else if (seen.size() == 1 && seen[0].footprint.cover == Cover::uniform) {
    fill(canvas, x, y, surfaces_[static_cast<std::size_t>(seen[0].surface)], seen[0].footprint.albedo,
         seen[0].middle);
  } else {
    if (seen.size() > kMaxSeen) seen.resize(kMaxSeen);
    sample_pixel(canvas, x, y, seen);
  }
}

void TileRenderer::sample_pixel(Canvas& canvas, int x, int y, const std::vector<Seen>& seen) const {
  const auto pixel = static_cast<std::size_t>(y * canvas.columns + x);
  const Eigen::Vector2d a = canvas.corner(x, y);
  const Eigen::Vector2d b = canvas.corner(x + 1, y);
  const Eigen::Vector2d c = canvas.corner(x, y + 1);
  const Eigen::Vector2d d = canvas.corner(x + 1, y + 1);
  // The light of a surface hardly changes within a pixel: once per surface, at the middle.
  const Eigen::Vector2d middle = 0.25 * (a + b + c + d);
  std::array<float, kMaxSeen> factor{};
  std::array<float, kMaxSeen> sheen{};
  bool exact = false;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const VisibleSurface& surface = surfaces_[static_cast<std::size_t>(seen[i].surface)];
    const VisibleSurface::Hit hit = surface.hit(middle.x(), middle.y());
    factor[i] = surface.irradiance(hit.at) * surface.grain(hit.at);
    sheen[i] = surface.sheen(hit.at);
    exact = exact || !surface.background();
  }
  const int samples = exact ? kSamples : kRoughSamples;
  // The same sample positions whichever tile asks for the pixel.
  const auto key =
      static_cast<std::uint64_t>((canvas.y0 - margin_px_ + y) * 65536 + canvas.x0 - margin_px_ + x);
  const std::uint64_t scramble = mixed_bits(seed_ ^ key);
  const auto flip_x = static_cast<std::uint8_t>(scramble);
  const auto flip_y = static_cast<std::uint8_t>(scramble >> 8);
  const double shift_x = static_cast<double>(scramble >> 16 & 255U) / 256;
  const double shift_y = static_cast<double>(scramble >> 24 & 255U) / 256;
  Canvas::Edge edge{static_cast<int>(pixel), {}};
  std::array<float, kMaxSeen> count_of{};
  float total = 0;
  for (int i = 0; i < samples; ++i) {
    const unsigned px = kNet[static_cast<std::size_t>(i)].x ^ flip_x;
    const unsigned py = kNet[static_cast<std::size_t>(i)].y ^ flip_y;
    const double u = (px + shift_x) / 256;
    const double v = (py + shift_y) / 256;
    const Eigen::Vector2d ray = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
    double nearest = 1e30;
    float light = kDarkness;
    std::size_t front = 0;
    for (std::size_t k = 0; k < seen.size(); ++k) {
      const VisibleSurface& surface = surfaces_[static_cast<std::size_t>(seen[k].surface)];
      const VisibleSurface::Hit hit = surface.hit(ray.x(), ray.y());
      if (hit.depth_mm <= 0 || hit.depth_mm >= nearest || !surface.paint().inside(hit.at)) continue;
      nearest = hit.depth_mm;
      light = surface.paint().albedo(hit.at) * factor[k] + sheen[k];
      front = k;
    }
    count_of[front] += 1;
    total += light;
    edge.light[(py >> 6) * kSub + (px >> 6)] += light;
  }
  const float per_sub_pixel = static_cast<float>(kSub * kSub) / static_cast<float>(samples);
  for (float& light : edge.light) light *= per_sub_pixel;
  canvas.light[pixel] = total / static_cast<float>(samples);
  const auto most = std::max_element(count_of.begin(), count_of.end()) - count_of.begin();
  canvas.tint[pixel] = static_cast<std::uint8_t>(seen[static_cast<std::size_t>(most)].surface);
  canvas.edges.push_back(edge);
}

// Point spread and pixel area over the sub-pixels, first down the columns, then along the rows.
void TileRenderer::blur(Canvas& canvas, SensorImage& image) const {
  const auto source = [&](int x, int y) {
    return static_cast<std::size_t>((y + margin_px_) * canvas.columns + x + margin_px_);
  };
  for (int y = 0; y < canvas.height; ++y) {
    std::copy_n(&canvas.light[source(0, y)], canvas.width, image.light.ptr<float>(canvas.y0 + y) + canvas.x0);
    std::copy_n(&canvas.tint[source(0, y)], canvas.width,
                image.tint.ptr<std::uint8_t>(canvas.y0 + y) + canvas.x0);
  }
  if (canvas.edges.empty()) return;  // what is smooth stays what it is
  const int wide = canvas.columns * kSub;
  std::vector<float> fine(static_cast<std::size_t>(wide * canvas.rows * kSub));
  for (int y = 0; y < canvas.rows * kSub; ++y) {
    float* to = &fine[static_cast<std::size_t>(y * wide)];
    const float* from = &canvas.light[static_cast<std::size_t>(y / kSub * canvas.columns)];
    for (int x = 0; x < canvas.columns; ++x) std::fill_n(to + x * kSub, kSub, from[x]);
  }
  for (const Canvas::Edge& edge : canvas.edges) {
    const int x = edge.pixel % canvas.columns;
    const int y = edge.pixel / canvas.columns;
    for (int k = 0; k < kSub; ++k) {
      std::copy_n(&edge.light[static_cast<std::size_t>(k * kSub)], kSub,
                  &fine[static_cast<std::size_t>((y * kSub + k) * wide + x * kSub)]);
    }
  }
  std::vector<float> column(static_cast<std::size_t>(wide));
  const int taps = static_cast<int>(kernel_.size());
  for (int y = 0; y < canvas.height; ++y) {
    std::fill(column.begin(), column.end(), 0.0F);
    const int first_row = (y + margin_px_) * kSub - radius_;
    for (int k = 0; k < taps; ++k) {
      const float weight = kernel_[static_cast<std::size_t>(k)];
      const float* from = &fine[static_cast<std::size_t>((first_row + k) * wide)];
      for (int x = 0; x < wide; ++x) column[static_cast<std::size_t>(x)] += weight * from[x];
    }
    float* to = image.light.ptr<float>(canvas.y0 + y) + canvas.x0;
    for (int x = 0; x < canvas.width; ++x) {
      const float* from = &column[static_cast<std::size_t>((x + margin_px_) * kSub - radius_)];
      float sum = 0;
      for (int k = 0; k < taps; ++k) sum += kernel_[static_cast<std::size_t>(k)] * from[k];
      to[x] = sum;
    }
  }
}

}  // namespace hexcal
