#include "photogrammetry/adjustment/adjustment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "kinematics/geometry/chi_squared.h"
#include "kinematics/geometry/input_error.h"
#include "photogrammetry/adjustment/adjustment_errors.h"
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
constexpr double kLeastSizeSigma = 1e-6;   // relative
constexpr double kEnoughToFitASpread = 3;  // degrees of freedom; below, the stated spread stands

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

struct FittedSigma {
  double* sigma;
  double least, most;
};

// Spread of the shapes from the shapes themselves, by variance components (Foerstner 1979; Foerstner and
// Wrobel 2016, ch. 4): sum of squares over what the data determine of it, per kind of mode. The stated
// squareness and flatness are upper limits. Sizes have no limit: what a user states of them may be wrong by
// any amount, and they are what the scale rests on. Other modes cannot stand for them: a printer's squares
// are square even where its scale, or the number that was typed, is wrong.
void fit_shape_priors(const AdjustmentJob& job, AdjustmentStage& stage) {
  BundleSettings& settings = stage.settings;
  const std::map<ShapeKind, FittedSigma> fitted{
      {ShapeKind::size, {&settings.size_sigma, kLeastSizeSigma, 1.0}},
      {ShapeKind::squareness,
       {&settings.squareness_sigma_mm, kLeastShapeSigmaMm, job.options.squareness_sigma_mm}},
      {ShapeKind::flatness,
       {&settings.flatness_sigma_mm, kLeastShapeSigmaMm, job.options.flatness_sigma_mm}}};
  for (int i = 0; i < 8; ++i) {
    std::map<ShapeKind, double> squares;
    std::map<ShapeKind, double> freedom;
    for (std::size_t k = 0; k < stage.layout.shape.size(); ++k) {
      const int column = stage.layout.shape[k];
      if (column < 0) continue;
      const ShapeParameter& shape = job.network.shapes[k];
      const double sigma = settings.shape_sigma(shape);
      squares[shape.kind] += std::pow(stage.geometry.shape[static_cast<Eigen::Index>(k)] / sigma, 2);
      freedom[shape.kind] += 1 - stage.covariance(column, column) / (sigma * sigma);
    }
    bool settled = true;
    for (const auto& [kind, fit] : fitted) {
      if (freedom[kind] < kEnoughToFitASpread) continue;
      const double before = *fit.sigma;
      *fit.sigma = std::clamp(before * std::sqrt(squares[kind] / freedom[kind]), fit.least, fit.most);
      settled = settled && std::abs(*fit.sigma / before - 1) < 0.02;
    }
    if (settled) break;
    solve(job, stage);
    analyse(job, stage);
  }
}

// Known lengths that contradict each other get sigmas that cover it, all by the same factor (Birge 1932).
void fit_length_sigmas(const AdjustmentJob& job, AdjustmentStage& stage) {
  for (int i = 0; i < 5; ++i) {
    const LengthCheck check =
        check_lengths(job.network, stage.geometry, stage.layout, stage.settings, stage.covariance);
    if (check.redundancy < 0.5) return;
    const double factor = std::max(1.0, std::sqrt(check.squares / check.redundancy));
    if (std::abs(factor / stage.settings.length_inflation - 1) < 0.005) return;
    stage.settings.length_inflation = factor;
    solve(job, stage);
    analyse(job, stage);
  }
}

// F test of free corners against rigid squares on the same sightings; leaves the better in `stage`.
bool corners_ask_to_be_free(const AdjustmentJob& job, AdjustmentStage& stage) {
  AdjustmentStage free = stage;
  free.layout = make_bundle_layout(job.network, stage.geometry, stage.sightings, true, false);
  solve(job, free);
  analyse(job, free);
  const double gained = stage.redundancy - free.redundancy;
  if (gained < 1 || free.redundancy < 1) return false;
  const double f = (stage.squares - free.squares) / gained / (free.squares / free.redundancy);
  if (f < 1 + kFreeShapeSigmas * std::sqrt(2 / gained)) return false;
  stage = std::move(free);
  return true;
}

// Where the fit of the sizes' spread starts: they may be off as an edge may, or as far as the stated scale.
double first_size_sigma(const Network& network, const AdjustmentOptions& options) {
  double least_mm_per_size = 1;
  for (const ShapeParameter& shape : network.shapes) {
    if (shape.kind == ShapeKind::squareness) least_mm_per_size = std::min(least_mm_per_size, shape.sigma);
  }
  return std::max(options.squareness_sigma_mm * least_mm_per_size, options.print_scale_sigma);
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
  stage.settings.size_sigma = first_size_sigma(network, options);
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
  // Photographs do not see the scale, so that what contradicts the rest is found without it: a wrong scale
  // bar must not make outliers of the features at its ends.
  bool free_shape = options.shape == AdjustmentOptions::Shape::free;
  const auto new_layout = [&](bool free_scale) {
    stage.layout = make_bundle_layout(network, stage.geometry, stage.sightings, free_shape, free_scale);
  };
  new_layout(false);
  const double robust_limit2 = solve_robustly(job, stage);
  reject_outliers(job, stage, robust_limit2);
  new_layout(false);
  solve(job, stage);
  analyse(job, stage);
  if (options.shape == AdjustmentOptions::Shape::automatic && corners_ask_to_be_free(job, stage)) {
    free_shape = true;
    // What only lacked a shape gets its second chance.
    for (Sighting& sighting : stage.sightings) {
      if (sighting.status != SightingStatus::outlier) continue;
      sighting.status = SightingStatus::used;
      (void)use_all_points(sighting);
    }
    new_layout(false);
    reject_outliers(job, stage, solve_robustly(job, stage));
    new_layout(false);
    solve(job, stage);
    analyse(job, stage);
  }
  drop_unsupported(job, stage);
  if (options.print_scale_free ? has_known_length(network, stage.geometry) : options.print_scale_sigma > 0) {
    new_layout(true);
    solve(job, stage);
    analyse(job, stage);
  }
  fit_variance_factor(job, stage);
  if (free_shape) fit_shape_priors(job, stage);
  fit_length_sigmas(job, stage);
  result.interior_chi2 =
      interior_coordinates(stage.geometry, stage.layout).squaredNorm();  // before it is loosened
  result.interior_loosened = loosen_interior(job, stage);
  if (result.interior_loosened) fit_variance_factor(job, stage);

  drop_unsupported(job, stage);
  result.shape_free = free_shape;
  result.size_sigma = free_shape ? stage.settings.size_sigma : 0;
  result.length_inflation = stage.settings.length_inflation;
  result.iterations = stage.iterations;
  result.sigma0 = std::sqrt(stage.settings.data_variance);
  result.redundancy_total = stage.redundancy;
  result.interior_dof = stage.settings.interior_moves ? stage.layout.num_interior : 0;
  result.geometry = stage.geometry;
  result.sightings = stage.sightings;
  ResultErrors errors = make_result_errors(network, stage.layout, stage.covariance);
  for (std::size_t e = 0; e < stage.system->epochs.size(); ++e) {
    add_epoch_errors(stage.system->epochs[e], e, errors);
  }
  result.errors = std::make_shared<const ResultErrors>(std::move(errors));
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
