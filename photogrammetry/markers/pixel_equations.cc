#include "photogrammetry/markers/pixel_equations.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace hexcal {
namespace {

// In standard deviations. Residuals beyond are linear: 3 keeps 99.7 % of normal ones, which here are many.
constexpr double kHuber = 3.0;
constexpr double kNoLimit = 1e9;

}  // namespace

void PixelEquations::forget_scale() { scale_ = kNoLimit; }

void PixelEquations::set_scale() {
  std::vector<double> sizes;
  sizes.reserve(residuals_.size());
  for (std::size_t i = 0; i < residuals_.size(); ++i) {
    if (tells(i)) sizes.push_back(std::abs(residuals_[i]));
  }
  scale_ = 1;
  if (sizes.empty()) return;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  scale_ = std::max(1.0, 1.4826 * *middle);
}

double PixelEquations::weight(std::size_t pixel) const {
  const double size = std::abs(residuals_[pixel]) / scale_;
  return size <= kHuber ? 1 : kHuber / size;
}

double PixelEquations::cost(const ImageVector& parameters) const {
  double sum = 0;
  for (const int i : active) {
    if (prior_sigmas[i] == 0) continue;
    const double z = (parameters[i] - start[i]) / prior_sigmas[i];
    sum += z * z;
  }
  for (std::size_t i = 0; i < residuals_.size(); ++i) {
    if (!pixels[i].kept) continue;
    const double r = residuals_[i];
    const double z = std::abs(r) / scale_;
    sum += z <= kHuber ? r * r : scale_ * scale_ * kHuber * (2 * z - kHuber);
  }
  return sum;
}

PixelEquations::Normals PixelEquations::normals() const {
  Normals result{Matrix::Zero(), ImageVector::Zero()};
  const std::size_t count = active.size();
  // Four pixels at a time: the sums are loaded and stored once for them.
  constexpr std::size_t kTogether = 4;
  static constexpr std::array<double, kImageParameters> kNone{};
  std::array<const double*, kTogether> j{};
  std::array<double, kTogether> weight{};
  std::array<double, kTogether> residual{};
  std::size_t waiting = 0;
  const auto add = [&] {
    for (std::size_t k = 0; k < count; ++k) {
      double* const column = result.n.data() + k * kImageParameters;
      const double f0 = weight[0] * j[0][k];
      const double f1 = weight[1] * j[1][k];
      const double f2 = weight[2] * j[2][k];
      const double f3 = weight[3] * j[3][k];
      for (std::size_t i = 0; i <= k; ++i) {
        column[i] += f0 * j[0][i] + f1 * j[1][i] + f2 * j[2][i] + f3 * j[3][i];
      }
      result.rhs[static_cast<int>(k)] +=
          f0 * residual[0] + f1 * residual[1] + f2 * residual[2] + f3 * residual[3];
    }
    waiting = 0;
  };
  for (std::size_t at = 0; at < pixels.size(); ++at) {
    if (!pixels[at].kept) continue;
    j[waiting] = rows_.data() + at * count;
    weight[waiting] = this->weight(at);
    residual[waiting] = residuals_[at];
    if (++waiting == kTogether) add();
  }
  if (waiting > 0) {
    for (; waiting < kTogether; ++waiting) {
      j[waiting] = kNone.data();
      weight[waiting] = residual[waiting] = 0;
    }
    add();
  }
  result.n.triangularView<Eigen::StrictlyLower>() = result.n.transpose();
  return result;
}

void PixelEquations::add_priors(const ImageVector& parameters, Normals& normals) const {
  for (std::size_t k = 0; k < active.size(); ++k) {
    const int i = active[k];
    if (prior_sigmas[i] == 0) continue;
    const double information = 1 / (prior_sigmas[i] * prior_sigmas[i]);
    normals.n(static_cast<int>(k), static_cast<int>(k)) += information;
    normals.rhs[static_cast<int>(k)] += information * (start[i] - parameters[i]);
  }
  for (int axis = 0; affine && axis < 2; ++axis) {
    Eigen::Vector3d along = parameters.segment<3>(3 * axis);
    along.normalize();
    const double stiff = std::max(normals.n.diagonal().head<6>().maxCoeff(), 1.0);
    normals.n.block<3, 3>(3 * axis, 3 * axis).triangularView<Eigen::Upper>() +=
        stiff * along * along.transpose();
  }
  normals.n.triangularView<Eigen::StrictlyLower>() = normals.n.transpose();
}

void PixelEquations::drop_covered_cells(int cells_a_side) {
  struct Cell {
    double sum = 0;
    int count = 0;
  };
  constexpr double kMaxTerm = 100;
  constexpr double kMaxMean = 12;
  constexpr int kMinPixels = 6;
  const auto side = static_cast<std::size_t>(cells_a_side + 2);
  std::vector<Cell> cells(side * side);
  set_scale();
  const double scale = scale_;
  for (std::size_t i = 0; i < residuals_.size(); ++i) {
    const double r = residuals_[i] / scale;
    Cell& cell = cells[static_cast<std::size_t>(pixels[i].cell)];
    cell.sum += std::min(r * r, kMaxTerm);
    ++cell.count;
  }
  for (FitPixel& pixel : pixels) {
    const Cell& cell = cells[static_cast<std::size_t>(pixel.cell)];
    pixel.kept = cell.count < kMinPixels || cell.sum < kMaxMean * cell.count;
  }
}

}  // namespace hexcal
