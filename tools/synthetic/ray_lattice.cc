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

void RayLattice::row(double x0_px, double y_px, int count, std::vector<double>& x,
                     std::vector<double>& y) const {
  x.resize(static_cast<std::size_t>(count));
  y.resize(static_cast<std::size_t>(count));
  const NodePosition vertical = node_position(y_px, rows_);
  const int first = node_position(x0_px, columns_).first;
  const int last = node_position(x0_px + count - 1, columns_).first + 3;
  std::vector<Eigen::Vector2d> line(static_cast<std::size_t>(last - first + 1), Eigen::Vector2d::Zero());
  for (int k = 0; k < 4; ++k) {
    const auto start = static_cast<std::size_t>((vertical.first + k) * columns_ + first);
    for (std::size_t i = 0; i < line.size(); ++i) {
      line[i] += vertical.weights[static_cast<std::size_t>(k)] * nodes_[start + i];
    }
  }
  for (int i = 0; i < count; ++i) {
    const NodePosition horizontal = node_position(x0_px + i, columns_);
    const Eigen::Vector2d* node = &line[static_cast<std::size_t>(horizontal.first - first)];
    const auto& w = horizontal.weights;
    const Eigen::Vector2d ray = w[0] * node[0] + w[1] * node[1] + w[2] * node[2] + w[3] * node[3];
    x[static_cast<std::size_t>(i)] = ray.x();
    y[static_cast<std::size_t>(i)] = ray.y();
  }
}

Eigen::Vector2d RayLattice::at(const Eigen::Vector2d& px) const {
  std::vector<double> x;
  std::vector<double> y;
  row(px.x(), px.y(), 1, x, y);
  return {x[0], y[0]};
}

}  // namespace hexcal
