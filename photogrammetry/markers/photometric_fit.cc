#include "photogrammetry/markers/photometric_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "photogrammetry/markers/fit_pixels.h"
#include "photogrammetry/markers/fit_statistics.h"
#include "photogrammetry/markers/image_model.h"
#include "photogrammetry/markers/pixel_equations.h"

namespace hexcal {
namespace {

constexpr double kMinBlur = 0.02;  // px^2; a sharper picture does not tell where between pixels an edge lies
constexpr double kStartBlur = 0.5;
constexpr int kCoarsePixels = 1000;
constexpr double kFineReachSigmas = 2.8;  // beyond, a pixel says nothing of the edge: 0.25 % of its step
constexpr double kNearSigmas = 1.3;       // within, it says most: 93 % of the edge's place
constexpr double kLargeSide = 300;        // px; from here on the illumination's curvature counts
constexpr double kSmallSide = 40;  // px; from here on the blur's anisotropy can be told from the geometry
constexpr double kStartMaskVariance = 2;  // px^2, of a sharpening mask: cameras' radii are 1 to 2 px
constexpr double kMaxMaskVariance = 16;
constexpr double kMaxSharpening = 4;

// Standard deviations of what is expected before the first look; an absent one is 0. Blur: a picture in focus
// has 0.3 to 2 px. Light: a third across half a marker. Curve: sRGB within what picture profiles change.
ImageVector prior_sigmas(double lens_sigma) {
  ImageVector sigma = ImageVector::Zero();
  sigma.segment<3>(kBlur) << 3, 0.2, 0.2;
  sigma.segment<5>(kLight) << 0.3, 0.3, 0.1, 0.1, 0.1;
  sigma.segment<2>(kTone).setConstant(0.5);
  sigma.segment<2>(kLens).setConstant(lens_sigma);
  sigma.segment<2>(kSharpening) << 1, 3;
  return sigma;
}

// One marker's fit: from the corners it is given through a coarse look to the fine one.
class MarkerFit {
 public:
  MarkerFit(const cv::Mat& grey, const PhotographModel& photograph, const FitRequest& request)
      : grey_(grey), photograph_(photograph), request_(request) {
    equations_.prior_sigmas = prior_sigmas(request.lens_sigma);
    equations_.affine = request.affine;
  }

  PhotometricFit run() {
    PhotometricFit fit;
    if (!prepare()) return fit;
    ImageModel model(request_, photograph_.tone.nominal(), equations_.start);
    activate(kHomography, request_.affine ? 6 : 8, true);
    activate(kBlur, 1, true);
    activate(kBlack, 2, true);
    activate(kLight, 2, true);
    if (request_.blur_px) {
      parameters_[kBlur] = std::max(*request_.blur_px * *request_.blur_px, kMinBlur);
    } else {
      select(3.6 * spread_px() + 1.5, kCoarsePixels);
      if (!set_levels(model) || !enough_pixels()) return fit;
      evaluate(model);
      if (!solve(model, 12, 5e-3)) return fit;
    }
    const double side_px = 2 * frame_.half_side;
    activate(kBlur + 1, 2, side_px >= kSmallSide);
    activate(kLight + 2, 3, side_px >= kLargeSide);
    activate(kTone, 2, request_.free_tone);
    activate(kLens, 2, request_.free_lens);
    activate(kSharpening, 2, request_.free_sharpening);
    if (request_.free_sharpening && parameters_[kSharpening + 1] == 0) {
      parameters_[kSharpening + 1] = equations_.start[kSharpening + 1] = kStartMaskVariance;
    }
    select(fine_reach_px(), request_.max_pixels);
    if (!enough_pixels() || (request_.blur_px && !set_levels(model))) return fit;
    evaluate(model);
    if (!request_.affine) equations_.drop_covered_cells(request_.pattern.cells());
    equations_.set_scale();
    if (!solve(model, 6, 3e-4)) return fit;
    complete_fit(equations_, parameters_, frame_, map_after_fit(), photograph_.tone.nominal(),
                 request_.affine ? 6 : 8, fit);
    return fit;
  }

 private:
  void activate(int first, int count, bool on) {
    std::fill_n(active_.begin() + first, count, on);
    equations_.active.clear();
    for (int i = 0; i < kImageParameters; ++i) {
      if (active_[static_cast<std::size_t>(i)]) equations_.active.push_back(i);
    }
  }

  bool prepare() {
    const auto plane = FitPlane::from_corners(photograph_.map, request_.corners_px);
    if (!plane) return false;
    frame_ = plane->frame;
    parameters_.setZero();
    parameters_.segment<8>(kHomography) = plane->homography;
    parameters_[kBlur] = kStartBlur;
    parameters_[kTone] = photograph_.tone.first();
    parameters_[kTone + 1] = photograph_.tone.second();
    parameters_[kSharpening] = photograph_.sharpening.amount;
    parameters_[kSharpening + 1] = photograph_.sharpening.variance_px2;
    equations_.start = parameters_;

    // The square, its surroundings as far as the pattern reaches, and the blur.
    Eigen::Vector2d low = request_.corners_px[0];
    Eigen::Vector2d high = low;
    for (const Eigen::Vector2d& corner : request_.corners_px) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
    const double beyond = std::max(request_.pattern.cells() / request_.square_cells - 1, 0.0) * 0.5 *
                          (high - low).maxCoeff() * 1.5;
    const double margin = beyond + 12;
    const cv::Rect wanted(static_cast<int>(std::floor(low.x() - margin)),
                          static_cast<int>(std::floor(low.y() - margin)),
                          static_cast<int>(std::ceil(high.x() - low.x() + 2 * margin)),
                          static_cast<int>(std::ceil(high.y() - low.y() + 2 * margin)));
    box_ = wanted & cv::Rect(0, 0, grey_.cols, grey_.rows);
    if (box_.width < 4 || box_.height < 4) return false;
    patch_ = PixelMapPatch::fit(photograph_.map, box_);
    return patch_.has_value();
  }

  void select(double reach_px, int max_pixels) {
    const PixelSelection selection{parameters_.segment<8>(kHomography), frame_, reach_px,
                                   kNearSigmas * spread_px(), max_pixels};
    FitPixels selected = select_pixels(grey_, photograph_, *patch_, request_, box_, selection);
    equations_.pixels = std::move(selected.pixels);
    clipped_ = selected.clipped;
    equations_.forget_scale();
  }

  double spread_px() const { return std::sqrt(parameters_[kBlur] + kPixelVariance); }

  // A sharpened edge has its halo beyond the blur.
  double fine_reach_px() const {
    const double mask = parameters_[kSharpening + 1];
    return kFineReachSigmas * std::sqrt(parameters_[kBlur] + kPixelVariance + 0.5 * mask) + 0.3;
  }

  // Black and white by linear least squares in linear light, from some of the pixels.
  bool set_levels(ImageModel& model) {
    model.set(parameters_);
    Eigen::Matrix2d n = Eigen::Matrix2d::Zero();
    Eigen::Vector2d rhs = Eigen::Vector2d::Zero();
    const std::vector<FitPixel>& pixels = equations_.pixels;
    const std::size_t step = pixels.size() / kCoarsePixels + 1;
    for (std::size_t i = 0; i < pixels.size(); i += step) {
      const double share = model.white_share(pixels[i]);
      const Eigen::Vector2d row(1 - share, share);
      n += row * row.transpose();
      rhs += row * photograph_.tone.decode(pixels[i].value);
    }
    if (pixels.size() < 20 || n.determinant() < 1e-6) return false;
    parameters_.segment<2>(kBlack) = n.inverse() * rhs;
    expect_beyond_clipping();
    return parameters_[kWhite] > parameters_[kBlack];
  }

  // Where white clips, nothing in the picture says how much light there was beyond; the slope of the edges
  // does, but it goes with the blur. What is expected: up to about twice as much, as when a photographer
  // exposes a stop too long.
  void expect_beyond_clipping() {
    constexpr double kLeastShare = 0.02;
    constexpr double kExpected = 1.2;
    constexpr double kSigma = 0.3;
    equations_.prior_sigmas[kWhite] = 0;
    if (clipped_ < kLeastShare * static_cast<double>(equations_.pixels.size())) return;
    const double bound = photograph_.tone.decode((photograph_.noise.white_clip() - 0.5) / full_scale(grey_));
    if (parameters_[kWhite] < 0.9 * bound) return;
    equations_.prior_sigmas[kWhite] = kSigma * bound;
    equations_.start[kWhite] = parameters_[kWhite] = std::max(parameters_[kWhite], kExpected * bound);
  }

  void apply(const Eigen::VectorXd& step) {
    for (std::size_t k = 0; k < equations_.active.size(); ++k) {
      parameters_[equations_.active[k]] += step[static_cast<Eigen::Index>(k)];
    }
    parameters_[kBlur] = std::max(parameters_[kBlur], kMinBlur);
    // The point spread's ellipse stays one.
    const double limit = 0.8 * parameters_[kBlur] + 0.5 * kPixelVariance;
    for (int i = kBlur + 1; i < kBlur + 3; ++i) parameters_[i] = std::clamp(parameters_[i], -limit, limit);
    if (!request_.free_sharpening) return;
    parameters_[kSharpening] = std::clamp(parameters_[kSharpening], 0.0, kMaxSharpening);
    parameters_[kSharpening + 1] = std::clamp(parameters_[kSharpening + 1], 0.2, kMaxMaskVariance);
  }

  bool enough_pixels() const { return equations_.pixels.size() >= 2 * equations_.active.size(); }

  void evaluate(ImageModel& model) {
    model.set(parameters_);
    equations_.evaluate(model);
  }

  // Levenberg-Marquardt (Marquardt 1963) from the last evaluation until the square moves less than
  // `tolerance_px`; leaves everything evaluated at its end. Weights are robust from the second step on, or
  // from the first if the scale is known.
  bool solve(ImageModel& model, int max_iterations, double tolerance_px) {
    const auto count = static_cast<Eigen::Index>(equations_.active.size());
    const auto normals = [&] {
      PixelEquations::Normals at = equations_.normals();
      equations_.add_priors(parameters_, at);
      return at;
    };
    double damping = 1e-6;
    PixelEquations::Normals at = normals();
    for (int iteration = 0; iteration < max_iterations; ++iteration) {
      equations_.set_scale();
      const double cost = equations_.cost(parameters_);
      const ImageVector before = parameters_;
      Eigen::MatrixXd n = at.n.topLeftCorner(count, count);
      n.diagonal() *= 1 + damping;
      const Eigen::VectorXd step = n.ldlt().solve(at.rhs.head(count));
      if (!step.allFinite()) return false;
      apply(step);
      evaluate(model);
      const double moved = step.head(request_.affine ? 6 : 8).cwiseAbs().maxCoeff() * frame_.half_side;
      if (moved < tolerance_px) break;
      if (equations_.cost(parameters_) <= cost * (1 + 1e-9)) {
        damping = std::max(damping * 0.1, 1e-9);
        at = normals();
      } else {
        parameters_ = before;
        evaluate(model);
        damping = std::max(damping * 30, 1e-4);
        if (damping > 1e6) break;
      }
    }
    return parameters_.allFinite() && parameters_[kWhite] > parameters_[kBlack];
  }

  PixelMap map_after_fit() const {
    if (!request_.free_lens) return photograph_.map;
    const LensStandIn lens = photograph_.map.stand_in();
    return {grey_.cols, grey_.rows,
            LensStandIn{lens.k1 + parameters_[kLens], lens.k2 + parameters_[kLens + 1]}};
  }

  const cv::Mat& grey_;
  const PhotographModel& photograph_;
  const FitRequest& request_;
  FitFrame frame_;
  cv::Rect box_;
  std::optional<PixelMapPatch> patch_;
  PixelEquations equations_;
  ImageVector parameters_ = ImageVector::Zero();
  std::array<bool, kImageParameters> active_{};
  int clipped_ = 0;
};

}  // namespace

PhotometricFit fit_pattern(const cv::Mat& grey, const PhotographModel& photograph,
                           const FitRequest& request) {
  return MarkerFit(grey, photograph, request).run();
}

}  // namespace hexcal
