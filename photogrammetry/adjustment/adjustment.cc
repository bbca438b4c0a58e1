#include "photogrammetry/adjustment/adjustment.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/adjustment/adjustment_stages.h"
#include "photogrammetry/adjustment/adjustment_statistics.h"
#include "photogrammetry/adjustment/initial_network.h"
#include "photogrammetry/adjustment/outlier_test.h"

namespace hexcal {
namespace {

constexpr double kFreeShapeSigmas = 5.0;   // how clearly the F test must ask for free corners
constexpr double kEnoughRedundancy = 100;  // from here the variance factor may also shrink the covariances
constexpr double kInteriorProbability = 1e-4;
constexpr double kLeastShapeSigmaMm = 1e-5;

// Variance factor by iteration: the observations' covariances are scaled until they promise what is seen.
// Priors keep their own.
void fit_variance_factor(const AdjustmentJob& job, AdjustmentStage& stage) {
  for (int i = 0; i < 5; ++i) {
    if (stage.redundancy < 1) return;
    double factor = stage.squares / stage.redundancy;
    if (stage.redundancy < kEnoughRedundancy) factor = std::max(factor, 1.0 / stage.settings.data_variance);
    if (std::abs(factor - 1) < 0.005) break;
    stage.settings.data_variance = std::max(1e-12, stage.settings.data_variance * factor);
    solve(job, stage);
    analyse(job, stage);
  }
}

// Widens the prior of cameras whose interior orientation has clearly left it.
bool loosen_interior(const AdjustmentJob& job, AdjustmentStage& stage) {
  if (!stage.settings.interior_moves) return false;
  const Eigen::VectorXd z = interior_coordinates(stage.geometry, stage.layout);
  bool loosened = false;
  for (std::size_t c = 0; c < job.network.cameras.size(); ++c) {
    const auto rank = stage.layout.interior_basis[c].cols();
    if (rank == 0) continue;
    const double chi2 = z.segment(stage.layout.interior[c], rank).squaredNorm();
    if (chi2 <= chi2_quantile(static_cast<int>(rank), kInteriorProbability)) continue;
    stage.settings.interior_inflation[c] = std::max(1.0, std::sqrt(chi2 / static_cast<double>(rank))) * 3;
    loosened = true;
  }
  if (!loosened) return false;
  solve(job, stage);
  analyse(job, stage);
  return true;
}

// Sizes of the shapes' priors from the shapes themselves, by variance components (Foerstner 1979): the stated
// priors are upper limits. Shear and trapezoids stand for the stretches too, whose mean is the scale and
// cannot be seen.
void fit_shape_priors(const AdjustmentJob& job, AdjustmentStage& stage) {
  for (int i = 0; i < 4; ++i) {
    std::array<double, 2> squares{};
    std::array<double, 2> freedom{};
    const std::array<double, 2> sigma{stage.settings.squareness_sigma_mm, stage.settings.flatness_sigma_mm};
    for (std::size_t m = 0; m < stage.layout.marker_shape.size(); ++m) {
      const int first = stage.layout.marker_shape[m];
      for (int mode = 2; first >= 0 && mode < 6; ++mode) {
        const std::size_t kind = mode == 5 ? 1 : 0;
        squares[kind] += stage.geometry.shape_mm[m][mode] * stage.geometry.shape_mm[m][mode];
        freedom[kind] += 1 - stage.covariance(first + mode, first + mode) / (sigma[kind] * sigma[kind]);
      }
    }
    const auto fitted = [&](std::size_t kind, double limit) {
      if (freedom[kind] < 1) return sigma[kind];
      return std::clamp(std::sqrt(squares[kind] / freedom[kind]), kLeastShapeSigmaMm, limit);
    };
    stage.settings.squareness_sigma_mm = fitted(0, job.options.squareness_sigma_mm);
    stage.settings.flatness_sigma_mm = fitted(1, job.options.flatness_sigma_mm);
    solve(job, stage);
    analyse(job, stage);
    if (std::abs(stage.settings.squareness_sigma_mm / sigma[0] - 1) < 0.02 &&
        std::abs(stage.settings.flatness_sigma_mm / sigma[1] - 1) < 0.02) {
      break;
    }
  }
}

// F test of free corners against rigid squares on the same sightings; leaves the better in `stage`.
bool corners_ask_to_be_free(const AdjustmentJob& job, AdjustmentStage& stage) {
  AdjustmentStage free = stage;
  free.layout =
      make_bundle_layout(job.network, stage.geometry, stage.sightings, true, stage.layout.print_scale >= 0);
  solve(job, free);
  analyse(job, free);
  const double gained = stage.redundancy - free.redundancy;
  if (gained < 1 || free.redundancy < 1) return false;
  const double f = (stage.squares - free.squares) / gained / (free.squares / free.redundancy);
  if (f < 1 + kFreeShapeSigmas * std::sqrt(2 / gained)) return false;
  stage = std::move(free);
  return true;
}

}  // namespace

void AdjustmentOptions::validate() const {
  const auto positive = [](const char* name, double value) {
    if (!(value > 0))
      throw InputError(fmt::format("adjustment option {}: found {}, wanted more than 0", name, value));
  };
  positive("squareness_sigma_mm", squareness_sigma_mm);
  positive("flatness_sigma_mm", flatness_sigma_mm);
  positive("outlier_probability", outlier_probability);
  if (outlier_probability >= 0.5) {
    throw InputError(fmt::format("adjustment option outlier_probability: found {}, wanted below 0.5",
                                 outlier_probability));
  }
  if (!(print_scale_sigma >= 0)) {
    throw InputError(
        fmt::format("adjustment option print_scale_sigma: found {}, wanted 0 or more", print_scale_sigma));
  }
}

AdjustmentResult adjust_network(const Network& network, const AdjustmentOptions& options) {
  options.validate();
  const AdjustmentJob job{network, options};
  AdjustmentResult result;
  AdjustmentStage stage;
  stage.sightings = collect_sightings(network);
  stage.geometry = initial_network(network, stage.sightings);
  stage.settings.squareness_sigma_mm = options.squareness_sigma_mm;
  stage.settings.flatness_sigma_mm = options.flatness_sigma_mm;
  stage.settings.print_scale_sigma = options.print_scale_free ? 0 : options.print_scale_sigma;
  stage.settings.interior_moves = options.interior == AdjustmentOptions::Interior::refined;
  stage.settings.interior_inflation.assign(network.cameras.size(), 1.0);
  drop_unsupported(job, stage);
  result.geometry = stage.geometry;
  result.sightings = stage.sightings;
  if (std::none_of(stage.geometry.has_photo.begin(), stage.geometry.has_photo.end(),
                   [](char c) { return c != 0; })) {
    result.reason = "no photographs are connected by fixed markers that each is seen in at least two";
    return result;
  }
  const bool free_scale = options.print_scale_free || options.print_scale_sigma > 0;
  bool free_shape = options.shape == AdjustmentOptions::Shape::free;
  const auto new_layout = [&] {
    stage.layout = make_bundle_layout(network, stage.geometry, stage.sightings, free_shape, free_scale);
  };
  new_layout();
  const double robust_limit2 = solve_robustly(job, stage);
  reject_outliers(job, stage, robust_limit2);
  new_layout();
  solve(job, stage);
  analyse(job, stage);
  if (options.shape == AdjustmentOptions::Shape::automatic && corners_ask_to_be_free(job, stage)) {
    free_shape = true;
    // What only lacked a shape gets its second chance.
    for (Sighting& sighting : stage.sightings) {
      if (sighting.status != SightingStatus::outlier) continue;
      sighting.status = SightingStatus::used;
      sighting.corner_used.fill(true);
      (void)whiten(sighting);
    }
    new_layout();
    reject_outliers(job, stage, solve_robustly(job, stage));
    new_layout();
    solve(job, stage);
    analyse(job, stage);
  }
  fit_variance_factor(job, stage);
  if (free_shape) fit_shape_priors(job, stage);
  result.interior_chi2 =
      interior_coordinates(stage.geometry, stage.layout).squaredNorm();  // before it is loosened
  result.interior_loosened = loosen_interior(job, stage);
  if (result.interior_loosened) fit_variance_factor(job, stage);

  drop_unsupported(job, stage);
  result.shape_free = free_shape;
  result.iterations = stage.iterations;
  result.sigma0 = std::sqrt(stage.settings.data_variance);
  result.redundancy_total = stage.redundancy;
  result.interior_dof = stage.settings.interior_moves ? stage.layout.num_interior : 0;
  result.geometry = stage.geometry;
  result.sightings = stage.sightings;
  result.common_covariance = stage.covariance;
  result.layout = stage.layout;
  result.epochs.resize(stage.system->epochs.size());
  result.photo_covariances.resize(network.photos.size());
  for (std::size_t e = 0; e < result.epochs.size(); ++e) {
    export_covariances(stage.system->epochs[e], e, result);
  }
  summarise_residuals(network, test_stage(job, stage), result);
  if (!stage.converged) {
    result.status = AdjustmentStatus::not_converged;
    result.reason = fmt::format("the adjustment did not converge in {} iterations", stage.iterations);
  } else if (stage.redundancy < 1) {
    result.status = AdjustmentStatus::no_redundancy;
    result.reason = "there are no more observations than unknowns, so nothing checks the result";
  } else {
    result.status = AdjustmentStatus::ok;
    result.reason.clear();
  }
  return result;
}

}  // namespace hexcal
