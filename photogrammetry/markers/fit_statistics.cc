#include "photogrammetry/markers/fit_statistics.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace hexcal {
namespace {

constexpr double kAgreeing = 5;  // standard deviations within which a pixel shows what the pattern has there

// Fit quality, and the score's covariance summed by blocks (White 1980, clustered): residuals of
// neighbouring pixels are not independent after JPEG or where the model misfits.
void measure_residuals(const PixelEquations& equations, const ImageVector& parameters, ToneCurve nominal,
                       const Eigen::MatrixXd& covariance, int geometry, PhotometricFit& fit) {
  const std::vector<FitPixel>& pixels = equations.pixels;
  const auto count = static_cast<Eigen::Index>(equations.active.size());
  const Eigen::MatrixXd geometry_rows = covariance.topRows(geometry);
  const Eigen::MatrixXd information = covariance.topLeftCorner(geometry, geometry).inverse();
  double clustered = 0;
  double blocks = 0;
  ImageVector score;  // of the block at hand: pixels come block by block
  int block = -1;
  const auto end_block = [&] {
    if (block < 0) return;
    const Eigen::VectorXd shift = geometry_rows * score.head(count);
    clustered += shift.dot(information * shift);
    blocks += 1;
  };
  double sum = 0;
  double squares = 0;
  double used = 0;
  int agreeing = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const FitPixel& pixel = pixels[i];
    const double residual = equations.residuals()[i];
    if (pixel.kept && std::abs(residual) < kAgreeing * equations.scale()) ++agreeing;
    if (!equations.tells(i)) continue;
    const double robust = equations.weight(i);
    sum += robust * residual * residual;
    squares += robust * std::pow(residual / pixel.weight, 2);
    used += 1;
    if (pixel.block != block) {
      end_block();
      block = pixel.block;
      score.setZero();
    }
    score.head(count) += residual * robust * Eigen::Map<const Eigen::VectorXd>(equations.row(i), count);
  }
  end_block();
  const double free = std::max(used - static_cast<double>(equations.active.size()), 1.0);
  fit.pixels = static_cast<int>(used);
  fit.chi2_per_dof = sum / free;
  const ToneResponse tone(nominal, parameters[kTone], parameters[kTone + 1]);
  const double contrast = tone.encode(parameters[kWhite]).value - tone.encode(parameters[kBlack]).value;
  fit.misfit = std::sqrt(squares / std::max(used, 1.0)) / std::max(contrast, 1e-9);
  fit.visible = agreeing / std::max(1.0, static_cast<double>(pixels.size()));
  const auto clipped =
      std::count_if(pixels.begin(), pixels.end(), [](const FitPixel& pixel) { return pixel.censored != 0; });
  fit.saturated = static_cast<double>(clipped) / std::max(1.0, static_cast<double>(pixels.size()));
  const double unbiased = blocks > geometry + 1 ? blocks / (blocks - geometry) : 1;
  fit.covariance_factor = std::max(clustered / geometry * unbiased, 1e-12);
}

// Schur complement of everything but the shared parameters.
void share_information(const PixelEquations& equations, const ImageVector& parameters,
                       const PixelEquations::Normals& at, PhotometricFit& fit) {
  fit.shared_information.setZero();
  fit.shared = parameters.segment<kNumShared>(kShared);
  const auto count = static_cast<Eigen::Index>(equations.active.size());
  const auto first_shared =
      std::count_if(equations.active.begin(), equations.active.end(), [](int i) { return i < kShared; });
  const auto own = static_cast<Eigen::Index>(first_shared);
  const Eigen::Index shared = count - own;
  if (shared == 0) return;
  Eigen::MatrixXd inner = at.n.topLeftCorner(own, own);
  inner.diagonal().array() += 1e-9 * inner.diagonal().maxCoeff();
  const Eigen::MatrixXd cross = at.n.block(0, own, own, shared);
  const Eigen::MatrixXd rest =
      at.n.block(own, own, shared, shared) - cross.transpose() * inner.ldlt().solve(cross);
  for (Eigen::Index a = 0; a < shared; ++a) {
    for (Eigen::Index b = 0; b < shared; ++b) {
      fit.shared_information(equations.active[static_cast<std::size_t>(own + a)] - kShared,
                             equations.active[static_cast<std::size_t>(own + b)] - kShared) = rest(a, b);
    }
  }
}

// Points of the square and how they move with the homography and with a lens that was fitted too: the two
// are told apart badly, so that one without the other would make the corners look far worse than they are.
class PlacedPoints {
 public:
  PlacedPoints(const PixelMap& map, const FitPlane& plane, const std::vector<int>& active, int geometry)
      : map_(map), plane_(plane), geometry_(geometry) {
    for (std::size_t k = 0; k < active.size(); ++k) {
      if (active[k] == kLens) first_lens_ = static_cast<Eigen::Index>(k);
    }
  }

  [[nodiscard]] Eigen::MatrixXd by_parameters(const Eigen::Vector2d& px,
                                              const Eigen::Matrix<double, 2, 8>& by_homography,
                                              Eigen::Index count) const {
    Eigen::MatrixXd by = Eigen::MatrixXd::Zero(2, count);
    by.leftCols(geometry_) = by_homography.leftCols(geometry_);
    if (first_lens_ < 0) return by;
    // At a fixed ideal point the pixel moves against what the lens adds to it.
    const auto ideal = map_.ideal_from_pixel(px);
    if (!ideal) return by;
    Eigen::Matrix2d by_ideal;
    static_cast<void>(map_.pixel_from_ideal(*ideal, &by_ideal));
    by.middleCols(first_lens_, 2) = -by_ideal * map_.by_stand_in(px);
    return by;
  }

  void place(const Eigen::MatrixXd& covariance, PhotometricFit& fit) const {
    const FitPlane::Corners corners = plane_.corners(map_);
    fit.corners_px = corners.px;
    Eigen::MatrixXd by(8, covariance.rows());
    for (int i = 0; i < 4; ++i) {
      by.middleRows(2 * i, 2) = by_parameters(corners.px[static_cast<std::size_t>(i)],
                                              corners.by_homography.middleRows<2>(2 * i), covariance.rows());
    }
    fit.covariance_px2 = by * covariance * by.transpose();
    const FitPlane::Pixel centre = plane_.pixel(map_, Eigen::Vector2d::Zero());
    const Eigen::MatrixXd centre_by = by_parameters(centre.px, centre.by_homography, covariance.rows());
    fit.centre_px = centre.px;
    fit.centre_covariance_px2 = centre_by * covariance * centre_by.transpose();
  }

 private:
  const PixelMap& map_;
  const FitPlane& plane_;
  int geometry_;
  Eigen::Index first_lens_ = -1;
};

}  // namespace

void complete_fit(const PixelEquations& equations, const ImageVector& parameters, const FitFrame& frame,
                  const PixelMap& map, ToneCurve nominal, int geometry, PhotometricFit& fit) {
  const PixelEquations::Normals at = equations.normals();
  PixelEquations::Normals with_priors = at;
  equations.add_priors(parameters, with_priors);
  const auto count = static_cast<Eigen::Index>(equations.active.size());
  const Eigen::MatrixXd n = with_priors.n.topLeftCorner(count, count);
  const Eigen::LDLT<Eigen::MatrixXd> decomposition(n);
  if (decomposition.info() != Eigen::Success || !decomposition.isPositive()) return;
  const Eigen::MatrixXd covariance = decomposition.solve(Eigen::MatrixXd::Identity(count, count));
  measure_residuals(equations, parameters, nominal, covariance, geometry, fit);
  const FitPlane plane{frame, parameters.segment<8>(kHomography)};
  PlacedPoints(map, plane, equations.active, geometry).place(covariance, fit);
  fit.blur_px = std::sqrt(parameters[kBlur]);
  fit.black = parameters[kBlack];
  fit.white = parameters[kWhite];
  share_information(equations, parameters, at, fit);
  fit.converged = fit.covariance_px2.allFinite();
}

}  // namespace hexcal
