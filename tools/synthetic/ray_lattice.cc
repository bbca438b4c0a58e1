#include "tools/synthetic/ray_lattice.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

constexpr double kStepPx = 8;
constexpr double kMarginPx = 40;  // beyond the frame: blur and interpolation reach out of it

// Weights of Lagrange's cubic through nodes -1, 0, 1, 2 at s in [0, 1].
std::array<double, 4> cubic_weights(double s) {
  return {-s * (s - 1) * (s - 2) / 6, (s + 1) * (s - 1) * (s - 2) / 2, -(s + 1) * s * (s - 2) / 2,
          (s + 1) * s * (s - 1) / 6};
}

struct NodePosition {
  int first;  // index of the first of the four nodes
  std::array<double, 4> weights;
};

NodePosition node_position(double px, int count) {
  const double position = (px + kMarginPx) / kStepPx;
  const int first = std::clamp(static_cast<int>(std::floor(position)) - 1, 0, count - 4);
  return {first, cubic_weights(position - first - 1)};
}

}  // namespace

RayLattice::RayLattice(const CameraModel& camera)
    : camera_(camera),
      columns_(static_cast<int>((camera.width_px + 2 * kMarginPx) / kStepPx) + 3),
      rows_(static_cast<int>((camera.height_px + 2 * kMarginPx) / kStepPx) + 3),
      nodes_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {
  tbb::parallel_for(0, rows_, [&](int row) {
    for (int column = 0; column < columns_; ++column) {
      const Eigen::Vector2d px(column * kStepPx - kMarginPx, row * kStepPx - kMarginPx);
      const auto normalised = camera_.normalised_from_image(px);
      if (!normalised) {
        throw InputError(fmt::format("the lens has no inverse at pixel {:.0f}, {:.0f}", px.x(), px.y()));
      }
      nodes_[static_cast<std::size_t>(row * columns_ + column)] = *normalised;
    }
  });
}

void RayLattice::rays(const Eigen::Vector2d& first_px, int columns, int rows,
                      std::vector<Eigen::Vector2d>& rays) const {
  rays.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  std::vector<NodePosition> across;
  for (int i = 0; i < columns; ++i) across.push_back(node_position(first_px.x() + i, columns_));
  const int low = across.front().first;
  std::vector<Eigen::Vector2d> line(static_cast<std::size_t>(across.back().first + 4 - low));
  auto ray = rays.begin();
  for (int row = 0; row < rows; ++row) {
    const NodePosition down = node_position(first_px.y() + row, rows_);
    const Eigen::Vector2d* node = &nodes_[static_cast<std::size_t>(down.first * columns_ + low)];
    for (std::size_t i = 0; i < line.size(); ++i) {
      const auto& w = down.weights;
      line[i] = w[0] * node[i] + w[1] * node[i + static_cast<std::size_t>(columns_)] +
                w[2] * node[i + 2 * static_cast<std::size_t>(columns_)] +
                w[3] * node[i + 3 * static_cast<std::size_t>(columns_)];
    }
    for (const NodePosition& position : across) {
      const Eigen::Vector2d* near = &line[static_cast<std::size_t>(position.first - low)];
      const auto& w = position.weights;
      *ray++ = w[0] * near[0] + w[1] * near[1] + w[2] * near[2] + w[3] * near[3];
    }
  }
}

Eigen::Vector2d RayLattice::at(const Eigen::Vector2d& px) const {
  std::vector<Eigen::Vector2d> ray;
  rays(px, 1, 1, ray);
  return ray.front();
}

}  // namespace hexcal
