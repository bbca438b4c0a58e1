#include "camera_calib/robust_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "camera_calib/initial_camera.h"
#include "kinematics/geometry/chi_squared.h"

namespace hexcal {
namespace {

constexpr double kMedian2 = 1.386;  // medians of chi^2 with 2 and 8 degrees of freedom
constexpr double kMedian8 = 7.344;
constexpr double kLeastNoisePx = 0.01;  // what no measurement of a corner is called an outlier for

double feature_chi2(const FeatureObservation& feature, const FeatureObservation::Vector& residual,
                    double extra) {
  FeatureObservation::Matrix covariance = feature.covariance_px2;
  covariance.diagonal().array() += extra * extra;
  return residual.dot(covariance.llt().solve(residual));
}

struct Residual {
  const FeatureObservation* feature;
  const FeatureObservation::Vector* px;
};

std::vector<Residual> used_residuals(const SheetAdjustmentResult& result) {
  std::vector<Residual> out;
  for (std::size_t v = 0; v < result.state.views.size(); ++v) {
    const SheetView& view = result.state.views[v];
    for (std::size_t f = 0; f < view.features.size(); ++f) {
      if (view.rejected[f] == 0) out.push_back({&view.features[f], &result.residuals_px[v][f]});
    }
  }
  return out;
}

// Share of the expected spread: median of chi^2 over its expected median, or the mean with the redundancy.
double spread(const std::vector<Residual>& residuals, double extra, bool by_median, double redundancy_share) {
  std::vector<double> ratios;
  double sum = 0;
  double expected = 0;
  for (const Residual& r : residuals) {
    const double chi2 = feature_chi2(*r.feature, *r.px, extra);
    const auto degrees = static_cast<double>(r.px->size());
    ratios.push_back(chi2 / (degrees > 2 ? kMedian8 : kMedian2));
    sum += chi2;
    expected += degrees;
  }
  if (!by_median) return sum / (expected * redundancy_share);
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return *middle / redundancy_share;
}

double unexplained_sigma(const SheetAdjustmentResult& result, bool by_median) {
  const std::vector<Residual> residuals = used_residuals(result);
  if (residuals.empty()) return 0;
  double coordinates = 0;
  double largest = 0;
  for (const Residual& r : residuals) {
    coordinates += static_cast<double>(r.px->size());
    largest = std::max(largest, r.px->cwiseAbs().maxCoeff());
  }
  const double redundancy = std::max(0.05, 1.0 - result.unknowns / coordinates);
  if (spread(residuals, 0, by_median, redundancy) <= 1.0) return 0;
  double low = 0;
  double high = std::max(largest, 1e-6) * 4;
  for (int iteration = 0; iteration < 40; ++iteration) {
    const double middle = 0.5 * (low + high);
    (spread(residuals, middle, by_median, redundancy) > 1.0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

// Tests every feature anew, so that one rejected in an early round may return.
void test_features(SheetAdjustmentResult& result, double extra, double probability) {
  const double limit2 = chi2_quantile(2, probability);
  const double limit8 = chi2_quantile(8, probability);
  for (std::size_t v = 0; v < result.state.views.size(); ++v) {
    SheetView& view = result.state.views[v];
    for (std::size_t f = 0; f < view.features.size(); ++f) {
      const double chi2 = feature_chi2(view.features[f], result.residuals_px[v][f], extra);
      view.rejected[f] = chi2 > (view.features[f].points() == 4 ? limit8 : limit2) ? 1 : 0;
    }
  }
}

}  // namespace

SheetAdjustmentOptions CameraVariant::adjustment_options(double extra_sigma_px) const {
  SheetAdjustmentOptions options;
  options.board = board;
  options.free_parameters = free_parameters;
  options.extra_sigma_px = extra_sigma_px;
  options.with_covariance = false;
  return options;
}

RobustFitResult robust_fit(const std::vector<Sheet>& sheets, const CalibrationState& start,
                           const CameraVariant& variant, double start_sigma_px,
                           const RobustFitOptions& options) {
  RobustFitResult out;
  CalibrationState state = start;
  state.camera = converted_camera(start.camera, variant.lens);
  double sigma = start_sigma_px;
  for (int round = 0; round < options.rounds; ++round) {
    SheetAdjustmentOptions adjust = variant.adjustment_options(sigma);
    adjust.robust = options.reject && round == 0;
    out.adjustment = adjust_sheets(sheets, state, adjust);
    if (!out.adjustment.converged) return out;
    if (options.reject) {
      test_features(out.adjustment, unexplained_sigma(out.adjustment, true), options.outlier_probability);
    }
    sigma = unexplained_sigma(out.adjustment, false);
    state = out.adjustment.state;
  }
  SheetAdjustmentOptions last = variant.adjustment_options(sigma);
  last.with_covariance = options.with_covariance;
  out.adjustment = adjust_sheets(sheets, state, last);
  out.extra_sigma_px = sigma;
  return out;
}

CameraModel converted_camera(const CameraModel& camera, LensModel lens) {
  if (camera.lens == lens) return camera;
  CameraModel out(camera.width_px, camera.height_px, camera.fy_px(), lens);
  out.parameters.head<CameraModel::kNumPinhole>() = camera.parameters.head<CameraModel::kNumPinhole>();
  out.valid_radius = camera.valid_radius;
  if (camera.lens == LensModel::brown && lens == LensModel::rational) {
    out.parameters.segment<5>(CameraModel::kNumPinhole) = camera.parameters.tail<5>();
    return out;
  }
  // The models are linear in their terms at zero (the rational one to first order): a least-squares fit over
  // the frame, with columns scaled to unit length.
  constexpr int kSide = 15;
  const auto terms = out.parameters.size() - CameraModel::kNumPinhole;
  Eigen::MatrixXd a(2 * kSide * kSide, terms);
  Eigen::VectorXd b(2 * kSide * kSide);
  Eigen::Index row = 0;
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j, row += 2) {
      const Eigen::Vector2d px(i * (camera.width_px - 1.0) / (kSide - 1),
                               j * (camera.height_px - 1.0) / (kSide - 1));
      const auto n = camera.normalised_from_image(px);
      a.middleRows<2>(row).setZero();
      b.segment<2>(row).setZero();
      if (!n) continue;
      Eigen::Matrix2d by_point;
      CameraModel::ByParameters by_parameters;
      const Eigen::Vector2d plain = out.image_from_normalised(*n, &by_point, &by_parameters);
      a.middleRows<2>(row) = by_parameters.rightCols(terms);
      b.segment<2>(row) = camera.image_from_normalised(*n) - plain;
    }
  }
  const Eigen::VectorXd scale = a.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  Eigen::MatrixXd scaled = a * scale.asDiagonal();
  // A trace of regularisation: powers of a narrow field are nearly the same column.
  Eigen::MatrixXd normal = scaled.transpose() * scaled;
  normal.diagonal().array() += 1e-9;
  out.parameters.tail(terms) = scale.asDiagonal() * normal.ldlt().solve(scaled.transpose() * b);
  return out;
}

RobustFitResult first_fit(const std::vector<Sheet>& sheets, const CalibrationState& start) {
  CalibrationState state = start;
  SheetAdjustmentOptions options;
  options.with_covariance = false;
  options.robust = true;
  options.max_iterations = 30;
  const std::vector<std::vector<int>> stages{{0, 4}, {0, 2, 3, 4, 5}};
  double sigma = 0.005 * start.camera.width_px;
  for (const std::vector<int>& stage : stages) {
    options.free_parameters.assign(9, false);
    for (const int i : stage) options.free_parameters[static_cast<std::size_t>(i)] = true;
    options.extra_sigma_px = sigma;
    const SheetAdjustmentResult result = adjust_sheets(sheets, state, options);
    if (!result.converged) break;
    state = result.state;
    sigma = std::max(0.02, unexplained_sigma(result, true));
  }
  return robust_fit(sheets, state, {LensModel::brown, {}, BoardFreedom::ideal}, sigma,
                    {.with_covariance = false});
}

}  // namespace hexcal
