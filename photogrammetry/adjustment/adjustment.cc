#include "photogrammetry/adjustment/adjustment.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/median.h"
#include "photogrammetry/adjustment/adjustment_statistics.h"
#include "photogrammetry/adjustment/bundle_solver.h"
#include "photogrammetry/adjustment/initial_network.h"
#include "photogrammetry/adjustment/outlier_test.h"

namespace hexcal {
namespace {

constexpr int kMaxIterations = 50;
constexpr int kRobustRounds = 6;
constexpr int kOutlierRounds = 8;
constexpr double kMedianChi2Of8 = 7.344;
constexpr double kRobustWidth = 4.0;       // robust limit over the robust standard deviation of a sighting
constexpr double kReadmission = 0.8;       // a rejected sighting returns below this share of the limit
constexpr double kFreeShapeSigmas = 5.0;   // how clearly the F test must ask for free corners
constexpr double kEnoughRedundancy = 100;  // from here the variance factor may also shrink the covariances
constexpr double kInteriorProbability = 1e-4;
constexpr double kLeastShapeSigmaMm = 1e-5;

// What stays the same during one adjustment.
struct Job {
  const Network& network;
  const AdjustmentOptions& options;
};

// State of the adjustment as it goes through its stages.
struct Stage {
  NetworkGeometry geometry;
  std::vector<Sighting> sightings;
  BundleLayout layout;
  BundleSettings settings;
  std::optional<BundleSystem> system;  // undamped, at the solution; empty until it is analysed
  Eigen::MatrixXd covariance;          // of the common parameters
  double redundancy = 0;               // of the observations alone
  double squares = 0;                  // of the observations, over the data variance
  bool converged = false;
  int iterations = 0;
};

Eigen::MatrixXd symmetric_inverse(const Eigen::MatrixXd& m) {
  const Eigen::VectorXd scale = m.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * m * scale.asDiagonal();
  const Eigen::MatrixXd inverse = scaled.ldlt().solve(Eigen::MatrixXd::Identity(m.rows(), m.cols()));
  return scale.asDiagonal() * (0.5 * (inverse + inverse.transpose())) * scale.asDiagonal();
}

// Covariance of the common parameters. With a fixed interior orientation the other parameters follow its
// error by -S22^-1 S21, and its covariance is the calibration's.
Eigen::MatrixXd common_covariance(const BundleSystem& system, const BundleLayout& layout,
                                  const BundleSettings& settings) {
  const Eigen::Index k = layout.num_interior;
  const Eigen::Index n = layout.size - k;
  if (settings.interior_moves || k == 0) return symmetric_inverse(system.normal);
  Eigen::MatrixXd prior = Eigen::MatrixXd::Zero(k, k);
  for (std::size_t c = 0; c < layout.interior.size(); ++c) {
    for (int i = layout.interior[c]; i < layout.interior[c] + layout.interior_basis[c].cols(); ++i) {
      prior(i, i) = settings.interior_inflation[c] * settings.interior_inflation[c];
    }
  }
  const Eigen::MatrixXd own = symmetric_inverse(system.normal.bottomRightCorner(n, n));
  const Eigen::MatrixXd follow = -own * system.normal.bottomLeftCorner(n, k);
  Eigen::MatrixXd covariance(layout.size, layout.size);
  covariance << prior, prior * follow.transpose(), follow * prior, own + follow * prior * follow.transpose();
  return covariance;
}

// Degrees of freedom that priors give: trace of (prior information * covariance).
double prior_information(const Job& job, const Stage& stage) {
  const BundleLayout& layout = stage.layout;
  BundleSettings settings = stage.settings;
  // The prior's normal matrix alone: a system without any sighting.
  const std::vector<double> none(stage.sightings.size(), 0.0);
  const BundleSystem priors =
      assemble_bundle(job.network, stage.geometry, stage.sightings, none, layout, settings, 0);
  const Eigen::Index k = settings.interior_moves ? 0 : layout.num_interior;
  const Eigen::Index n = layout.size - k;
  return priors.normal.bottomRightCorner(n, n).cwiseProduct(stage.covariance.bottomRightCorner(n, n)).sum();
}

void solve(const Job& job, Stage& stage, double robust_limit, const BundleSettings& settings) {
  BundleSolution solution = solve_bundle_adjustment(job.network, stage.geometry, stage.sightings,
                                                    stage.layout, settings, robust_limit, kMaxIterations);
  stage.geometry = std::move(solution.geometry);
  stage.converged = solution.converged;
  stage.iterations += solution.iterations;
  stage.system = std::move(solution.system);
  stage.squares = 0;
  for (const double q : solution.squares) stage.squares += std::max(0.0, q);
}

void solve(const Job& job, Stage& stage) { solve(job, stage, 0, stage.settings); }

// While outliers are sought, a tenth of a standard deviation is near enough.
void solve_roughly(const Job& job, Stage& stage, double robust_limit) {
  BundleSettings settings = stage.settings;
  settings.converged = 0.01;
  solve(job, stage, robust_limit, settings);
}

// System, covariance and redundancy at the present solution.
void analyse(const Job& job, Stage& stage) {
  std::vector<double> weights(stage.sightings.size(), 0);
  double rows = 0;
  for (std::size_t s = 0; s < weights.size(); ++s) {
    if (stage.sightings[s].status != SightingStatus::used) continue;
    weights[s] = 1;
    rows += stage.sightings[s].rows;
  }
  if (!stage.system) {
    stage.system = assemble_bundle(job.network, stage.geometry, stage.sightings, weights, stage.layout,
                                   stage.settings, 0);
  }
  stage.covariance = common_covariance(*stage.system, stage.layout, stage.settings);
  double unknowns = stage.layout.size - (stage.settings.interior_moves ? 0 : stage.layout.num_interior);
  for (const EpochElimination& epoch : stage.system->epochs) {
    unknowns += 6.0 * static_cast<double>(epoch.photos.size()) + (epoch.has_pose ? 6 : 0);
  }
  stage.redundancy = rows - unknowns + prior_information(job, stage);
}

// Graduated robust adjustment: the limit follows the median of the sightings' squares until both settle.
double solve_robustly(const Job& job, Stage& stage) {
  double limit2 = 0;
  for (int round = 0; round < kRobustRounds; ++round) {
    const BundleSolution at = solve_bundle_adjustment(job.network, stage.geometry, stage.sightings,
                                                      stage.layout, stage.settings, 0, 0);
    std::vector<double> squares;
    for (const double q : at.squares) {
      if (q >= 0) squares.push_back(q);
    }
    const double next = kRobustWidth * kRobustWidth * 8 * std::max(1.0, median(squares) / kMedianChi2Of8);
    if (round > 0 && next > 0.5 * limit2) break;
    limit2 = next;
    solve_roughly(job, stage, std::sqrt(limit2));
  }
  return limit2;
}

// Drops photographs, epochs and markers that no used sighting supports any more.
void drop_unsupported(const Job& job, Stage& stage) {
  const Network& network = job.network;
  std::vector<int> photos(network.photos.size(), 0);
  std::vector<int> epochs(static_cast<std::size_t>(network.num_epochs), 0);
  std::vector<int> markers(network.markers.size(), 0);
  for (const Sighting& sighting : stage.sightings) {
    if (sighting.status != SightingStatus::used) continue;
    const auto p = static_cast<std::size_t>(sighting.photo);
    const auto m = static_cast<std::size_t>(sighting.marker);
    ++photos[p];
    ++markers[m];
    if (network.markers[m].body == Body::moving) ++epochs[static_cast<std::size_t>(network.photos[p].epoch)];
  }
  for (std::size_t p = 0; p < photos.size(); ++p) stage.geometry.has_photo[p] &= photos[p] > 0;
  for (std::size_t e = 0; e < epochs.size(); ++e) stage.geometry.has_epoch[e] &= epochs[e] > 0;
  for (std::size_t m = 0; m < markers.size(); ++m) stage.geometry.has_marker[m] &= markers[m] > 0;
}

// A rejected marker of which three corners fit comes back without the fourth.
bool readmit_by_corners(const Job& job, const Stage& stage, Sighting& sighting, double limit_of_6) {
  Sighting best;
  double least = limit_of_6;
  for (std::size_t c = 0; c < 4; ++c) {
    Sighting trial = sighting;
    trial.corner_used.fill(true);
    trial.corner_used[c] = false;
    if (!whiten(trial)) continue;
    const std::vector<Sighting> one{trial};
    const double statistic = test_sightings(job.network, stage.geometry, one, stage.layout, stage.settings,
                                            *stage.system, stage.covariance)[0]
                                 .statistic;
    if (statistic >= least) continue;
    least = statistic;
    best = trial;
  }
  if (best.marker < 0) return false;
  sighting = best;
  return true;
}

// Iterated test of every sighting against the rest, after a robust start.
void reject_outliers(const Job& job, Stage& stage, double robust_limit2) {
  const BundleSolution at = solve_bundle_adjustment(job.network, stage.geometry, stage.sightings,
                                                    stage.layout, stage.settings, 0, 0);
  for (std::size_t s = 0; s < stage.sightings.size(); ++s) {
    if (at.squares[s] > robust_limit2) stage.sightings[s].status = SightingStatus::outlier;
  }
  const double base8 = chi2_quantile(8, job.options.outlier_probability);
  const double base6 = chi2_quantile(6, job.options.outlier_probability);
  for (int round = 0; round < kOutlierRounds; ++round) {
    solve_roughly(job, stage, 0);
    analyse(job, stage);
    const std::vector<SightingTest> tests =
        test_sightings(job.network, stage.geometry, stage.sightings, stage.layout, stage.settings,
                       *stage.system, stage.covariance);
    std::vector<double> used;
    double worst = 0;
    for (std::size_t s = 0; s < tests.size(); ++s) {
      if (stage.sightings[s].status != SightingStatus::used) continue;
      used.push_back(tests[s].statistic * 8 / stage.sightings[s].rows);
      worst = std::max(worst, tests[s].statistic);
    }
    // Covariances that promise too much must not make outliers of everything.
    const double factor = std::max(1.0, median(used) / kMedianChi2Of8);
    bool changed = false;
    for (std::size_t s = 0; s < tests.size(); ++s) {
      Sighting& sighting = stage.sightings[s];
      const double limit = factor * (sighting.rows == 8 ? base8 : base6);
      if (sighting.status == SightingStatus::used) {
        // The worst first: others may only suffer from them.
        if (tests[s].statistic <= limit || tests[s].statistic < 0.2 * worst) continue;
        sighting.status = SightingStatus::outlier;
        changed = true;
      } else if (sighting.status == SightingStatus::outlier && round + 2 < kOutlierRounds) {
        if (tests[s].statistic < kReadmission * limit) {
          sighting.status = SightingStatus::used;
          changed = true;
        } else if (sighting.rows == 8 &&
                   readmit_by_corners(job, stage, sighting, kReadmission * factor * base6)) {
          sighting.status = SightingStatus::used;
          changed = true;
        }
      }
    }
    if (!changed) break;
  }
}

// Variance factor by iteration: the observations' covariances are scaled until they promise what is seen.
// Priors keep their own.
void fit_variance_factor(const Job& job, Stage& stage) {
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
bool loosen_interior(const Job& job, Stage& stage) {
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
void fit_shape_priors(const Job& job, Stage& stage) {
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
bool corners_ask_to_be_free(const Job& job, Stage& stage) {
  Stage free = stage;
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
  if (print_scale_sigma < 0) {
    throw InputError(
        fmt::format("adjustment option print_scale_sigma: found {}, wanted 0 or more", print_scale_sigma));
  }
}

AdjustmentResult adjust_network(const Network& network, const AdjustmentOptions& options) {
  options.validate();
  const Job job{network, options};
  AdjustmentResult result;
  Stage stage;
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
  export_covariances(network, *stage.system, result);
  summarise_residuals(network,
                      test_sightings(network, stage.geometry, stage.sightings, stage.layout, stage.settings,
                                     *stage.system, stage.covariance),
                      result);
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
