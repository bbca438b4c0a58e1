#include "photogrammetry/markers/edge_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "kinematics/geometry/median.h"
#include "photogrammetry/markers/fit_plane.h"
#include "photogrammetry/markers/grey_sample.h"
#include "photogrammetry/markers/image_noise.h"

namespace hexcal {
namespace {

constexpr int kUnknowns = 9;  // homography, bleed
constexpr int kRounds = 2;    // of looking the edges up
constexpr int kIterations = 8;
constexpr double kProfileStepPx = 0.25;
constexpr double kLeastReachPx = 1.5;
constexpr double kMostReachPx = 4;
constexpr double kReachInCells = 0.7;
constexpr double kMiddleShare = 0.6;      // of a cell's side that is looked at: its ends see the next edge
constexpr double kMostPlaces = 6;         // on a cell's side
constexpr double kMinStep = 0.04;         // over full scale; a fainter step is no edge
constexpr double kNoiseStep = 0.006;      // over full scale; a fall by less does not end a rise
constexpr double kLeastScatterPx = 0.03;  // what interpolating between pixels costs (a share of its phase)
constexpr double kAlikePx = 0.01;         // of it that is left in a corner
constexpr double kTukey = 4.685;          // 95 % efficient for normal errors (Holland & Welsch 1977)
constexpr double kAgreePx = 0.5;  // an edge that is seen lies within this, or within the scatter's bound
constexpr std::size_t kLeastEdges = 12;

using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;

// A side of a cell between black and white.
struct CellSide {
  int axis;         // 0: a line x = const, 1: y = const
  int line;         // in cells
  int along;        // first cell along the line
  double to_white;  // +1: white lies on the side of larger coordinates
};

struct EdgePlace {
  Eigen::Vector2d px;  // where grey passes the middle
  std::size_t side;
  double step;
};

std::vector<CellSide> cell_sides(const BlurredPattern& pattern) {
  std::vector<CellSide> sides;
  const int cells = pattern.cells();
  for (const int axis : {0, 1}) {
    for (int line = 0; line <= cells; ++line) {
      for (int along = 0; along < cells; ++along) {
        const auto white = [&](double across) {
          return axis == 0 ? pattern.is_white(line + across, along + 0.5)
                           : pattern.is_white(along + 0.5, line + across);
        };
        const bool before = white(-0.5);
        const bool after = white(0.5);
        if (before != after) sides.push_back({axis, line, along, after ? 1.0 : -1.0});
      }
    }
  }
  return sides;
}

class EdgePlaces {
 public:
  EdgePlaces(const cv::Mat& grey, const PixelMap& map, double half_pattern, double half_square)
      : grey_(grey), map_(map), half_pattern_(half_pattern), half_square_(half_square) {}

  // Places along one side of a cell, as `plane` predicts it.
  void look_up(const FitPlane& plane, const CellSide& side, std::size_t index,
               std::vector<EdgePlace>& out) const {
    const auto pixel = [&](double along, double across) {
      Eigen::Vector2d cells;
      cells[side.axis] = side.line + across;
      cells[1 - side.axis] = side.along + along;
      return plane.pixel(map_, (cells - Eigen::Vector2d::Constant(half_pattern_)) / half_square_).px;
    };
    const Eigen::Vector2d from = pixel(0.5 * (1 - kMiddleShare), 0);
    const Eigen::Vector2d to = pixel(0.5 * (1 + kMiddleShare), 0);
    const double length = (to - from).norm();
    if (!(length > 0.3)) return;
    Eigen::Vector2d normal(-(to - from).y() / length, (to - from).x() / length);
    const Eigen::Vector2d across = side.to_white * (pixel(0.5, 0.5) - pixel(0.5, -0.5));
    if (normal.dot(across) < 0) normal = -normal;
    const double cell_px = normal.dot(across);
    const double reach = std::clamp(kReachInCells * cell_px, kLeastReachPx, kMostReachPx);
    const int places = static_cast<int>(std::clamp(length, 1.0, kMostPlaces));
    for (int i = 0; i < places; ++i) {
      const Eigen::Vector2d middle = from + (to - from) * ((i + 0.5) / places);
      if (const auto found = crossing(middle, normal, reach)) out.push_back({found->px, index, found->step});
    }
  }

 private:
  struct Crossing {
    Eigen::Vector2d px;
    double step;
  };
  // From dark to bright along the normal: the passage through the middle that is nearest to the prediction.
  std::optional<Crossing> crossing(const Eigen::Vector2d& middle, const Eigen::Vector2d& normal,
                                   double reach) const {
    constexpr std::size_t kMost = static_cast<std::size_t>(2 * kMostReachPx / kProfileStepPx) + 2;
    std::array<double, kMost> profile;
    const auto steps = static_cast<std::size_t>(2 * reach / kProfileStepPx) + 1;
    for (std::size_t k = 0; k < steps; ++k) {
      const auto value =
          grey_sample(grey_, middle + normal * (static_cast<double>(k) * kProfileStepPx - reach));
      if (!value) return std::nullopt;
      profile[k] = *value;
    }
    const double scale = full_scale(grey_);
    std::optional<Crossing> best;
    double nearest = reach;
    // Rises, noise aside, with the least value before and the greatest after.
    for (std::size_t k = 1; k < steps; ++k) {
      if (!(profile[k] > profile[k - 1])) continue;
      std::size_t first = k - 1;
      while (first > 0 && profile[first - 1] <= profile[first] + kNoiseStep * scale) --first;
      std::size_t last = k;
      while (last + 1 < steps && profile[last + 1] >= profile[last] - kNoiseStep * scale) ++last;
      const double low = *std::min_element(profile.begin() + static_cast<std::ptrdiff_t>(first),
                                           profile.begin() + static_cast<std::ptrdiff_t>(k));
      const double high = *std::max_element(profile.begin() + static_cast<std::ptrdiff_t>(k),
                                            profile.begin() + static_cast<std::ptrdiff_t>(last) + 1);
      const double half = 0.5 * (low + high);
      if (high - low > kMinStep * scale) {
        std::size_t at = first + 1;
        while (!(profile[at - 1] < half && profile[at] >= half)) ++at;
        const double share = (half - profile[at - 1]) / (profile[at] - profile[at - 1]);
        const double where = (static_cast<double>(at - 1) + share) * kProfileStepPx - reach;
        if (std::abs(where) < nearest) {
          nearest = std::abs(where);
          best = Crossing{middle + normal * where, (high - low) / scale};
        }
      }
      k = last;
    }
    return best;
  }

  const cv::Mat& grey_;
  const PixelMap& map_;
  double half_pattern_, half_square_;
};

struct EdgeResidual {
  double px;     // from the fit's edge to the place, along the axis
  Unknowns row;  // its derivatives
  bool finite = false;
};

EdgeResidual residual_of(const EdgePlace& place, const CellSide& side, const FitPlane& plane,
                         const PixelMap& map, double half_pattern, double half_square, double bleed) {
  EdgeResidual out;
  const auto ideal = map.ideal_from_pixel(place.px);
  if (!ideal) return out;
  Eigen::Matrix2d px_by_ideal;
  static_cast<void>(map.pixel_from_ideal(*ideal, &px_by_ideal));
  const Eigen::Vector2d n = (*ideal - plane.frame.middle) / plane.frame.half_side;
  const SquarePoint square = square_point(plane.homography, n);
  const Eigen::RowVector2d by_px =
      square.by_point.row(side.axis) * px_by_ideal.inverse() / plane.frame.half_side;
  const double per_px = by_px.norm();
  if (!(per_px > 0) || !(square.scale > 0)) return out;
  const double edge = (side.line - half_pattern) / half_square;
  out.px = (square.t[side.axis] - edge) / per_px + side.to_white * bleed;
  out.row.head<8>() = square_by_homography(square, n).row(side.axis).transpose() / per_px;
  out.row[8] = side.to_white;
  out.finite = std::isfinite(out.px) && out.row.allFinite();
  return out;
}

double tukey(double z) {
  if (std::abs(z) >= kTukey) return 0;
  const double u = z / kTukey;
  return (1 - u * u) * (1 - u * u);
}

}  // namespace

EdgeFit fit_edges(const cv::Mat& grey, const PixelMap& map, const BlurredPattern& pattern,
                  double square_cells, const std::array<Eigen::Vector2d, 4>& corners_px) {
  EdgeFit fit;
  fit.corners_px = corners_px;
  auto plane = FitPlane::from_corners(map, corners_px);
  if (!plane) return fit;
  const double half_pattern = 0.5 * pattern.cells();
  const double half_square = 0.5 * square_cells;
  const EdgePlaces edges(grey, map, half_pattern, half_square);
  const std::vector<CellSide> sides = cell_sides(pattern);
  std::vector<EdgePlace> places;
  std::vector<EdgeResidual> residuals;
  double bleed = 0;
  double scatter = kLeastScatterPx;
  const auto evaluate = [&] {
    std::vector<double> sizes;
    for (std::size_t i = 0; i < places.size(); ++i) {
      residuals[i] =
          residual_of(places[i], sides[places[i].side], *plane, map, half_pattern, half_square, bleed);
      if (residuals[i].finite) sizes.push_back(std::abs(residuals[i].px));
    }
    if (sizes.empty()) return false;
    scatter = std::max(1.4826 * median(sizes), kLeastScatterPx);
    return true;
  };
  Normal n;
  for (int round = 0; round < kRounds; ++round) {
    places.clear();
    for (std::size_t s = 0; s < sides.size(); ++s) edges.look_up(*plane, sides[s], s, places);
    if (places.size() < 2 * kLeastEdges) return fit;
    residuals.resize(places.size());
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      if (!evaluate()) return fit;
      n.setZero();
      Unknowns rhs = Unknowns::Zero();
      for (const EdgeResidual& residual : residuals) {
        if (!residual.finite) continue;
        const double weight = tukey(residual.px / scatter);
        n += weight * residual.row * residual.row.transpose();
        rhs -= weight * residual.px * residual.row;
      }
      // A pattern whose edges do not tell bleed from size keeps none.
      n(8, 8) += 1e-3 * static_cast<double>(places.size());
      const Unknowns step = n.ldlt().solve(rhs);
      if (!step.allFinite()) return fit;
      plane->homography += step.head<8>();
      bleed += step[8];
      if (step.head<8>().cwiseAbs().maxCoeff() * plane->frame.half_side < 1e-3) break;
    }
  }
  if (!evaluate()) return fit;

  // What edges disagree by, each cell's side a cluster.
  struct Side {
    Unknowns score = Unknowns::Zero();
    double weight = 0;
    int seen = 0, agreeing = 0;
  };
  std::vector<Side> by_side(sides.size());
  n.setZero();
  std::vector<double> steps;
  const double limit = std::max(kAgreePx, kTukey * scatter);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const EdgeResidual& residual = residuals[i];
    if (!residual.finite) continue;
    Side& side = by_side[places[i].side];
    const double weight = tukey(residual.px / scatter);
    n += weight * residual.row * residual.row.transpose();
    side.score += weight * residual.px * residual.row;
    side.weight += weight;
    ++side.seen;
    if (std::abs(residual.px) < limit) ++side.agreeing;
    steps.push_back(places[i].step);
  }
  n(8, 8) += 1e-3 * static_cast<double>(places.size());
  Normal spread = Normal::Zero();
  std::size_t used = 0;
  std::size_t agreeing = 0;
  for (const Side& side : by_side) {
    spread += side.score * side.score.transpose();
    if (side.weight > 0) ++used;
    if (side.agreeing > 0 && 2 * side.agreeing >= side.seen) ++agreeing;
  }
  if (used < kLeastEdges + kUnknowns) return fit;
  const Eigen::LDLT<Normal> decomposition(n);
  if (decomposition.info() != Eigen::Success || !decomposition.isPositive()) return fit;
  const Normal inverse = decomposition.solve(Normal::Identity());
  const double unbiased = static_cast<double>(used) / static_cast<double>(used - kUnknowns);
  const Normal covariance = unbiased * inverse * spread * inverse;
  const FitPlane::Corners corners = plane->corners(map);
  fit.corners_px = corners.px;
  // Interpolation between pixels is off alike for all places of an edge that lies along their rows.
  fit.covariance_px2 =
      corners.by_homography * covariance.topLeftCorner<8, 8>() * corners.by_homography.transpose();
  fit.covariance_px2.diagonal().array() += kAlikePx * kAlikePx;
  fit.visible = static_cast<double>(agreeing) / static_cast<double>(sides.size());
  fit.scatter_px = scatter;
  fit.bleed_px = bleed;
  fit.contrast = median(steps);
  fit.converged = fit.covariance_px2.allFinite() && FitPlane::from_corners(map, fit.corners_px).has_value();
  return fit;
}

}  // namespace hexcal
