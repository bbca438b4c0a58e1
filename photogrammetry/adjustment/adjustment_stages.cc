#include "photogrammetry/adjustment/adjustment_stages.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "kinematics/geometry/chi_squared.h"
#include "kinematics/geometry/median.h"

namespace hexcal {
namespace {

constexpr int kMaxIterations = 50;
constexpr int kRobustRounds = 6;
constexpr int kOutlierRounds = 8;
constexpr double kRobustWidth = 4.0;     // robust limit over the robust standard deviation of a sighting
constexpr double kReadmission = 0.8;     // a rejected sighting returns below this share of the limit
constexpr double kUndetermined = 1e-13;  // of unit-diagonal normal equations: beyond what rounding leaves

// Median of chi^2, asked for every sighting: from a table.
double chi2_median(int dof) {
  static const std::array<double, 9> medians = [] {
    std::array<double, 9> values{};
    for (int d = 1; d < 9; ++d) values[static_cast<std::size_t>(d)] = chi2_quantile(d, 0.5);
    return values;
  }();
  return medians[static_cast<std::size_t>(dof)];
}

// Inverse of normal equations. Combinations of parameters that nothing determines get a very large variance
// instead of one of any size and sign that rounding makes.
Eigen::MatrixXd symmetric_inverse(const Eigen::MatrixXd& m) {
  if (m.rows() == 0) return m;  // a single marker carries the frame and leaves nothing to be determined
  const Eigen::VectorXd scale = m.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * m * scale.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(scaled);
  Eigen::MatrixXd inverse;
  if (ldlt.info() == Eigen::Success && ldlt.isPositive() && ldlt.vectorD().minCoeff() > kUndetermined) {
    inverse = ldlt.solve(Eigen::MatrixXd::Identity(m.rows(), m.cols()));
  } else {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
    inverse = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(kUndetermined).cwiseInverse().asDiagonal() *
              eigen.eigenvectors().transpose();
  }
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
double prior_information(const AdjustmentJob& job, const AdjustmentStage& stage) {
  const BundleLayout& layout = stage.layout;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(layout.size, layout.size);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(layout.size);
  add_priors(job.network, stage.geometry, layout, stage.settings, normal, right);
  const Eigen::Index k = stage.settings.interior_moves ? 0 : layout.num_interior;
  const Eigen::Index n = layout.size - k;
  return normal.bottomRightCorner(n, n).cwiseProduct(stage.covariance.bottomRightCorner(n, n)).sum();
}

// What is held needs no columns until the solution is analysed.
BundleSolution solution_from(const AdjustmentJob& job, const AdjustmentStage& stage,
                             const BundleSettings& settings, double robust_limit, int max_iterations) {
  return solve_bundle_adjustment(job.network, stage.geometry, stage.sightings,
                                 settings.common_moves ? stage.layout : without_columns(stage.layout),
                                 settings, robust_limit, max_iterations);
}

// Sums of squares of the sightings where the stage stands.
std::vector<double> present_squares(const AdjustmentJob& job, const AdjustmentStage& stage) {
  return solution_from(job, stage, stage.settings, 0, 0).squares;
}

void solve(const AdjustmentJob& job, AdjustmentStage& stage, double robust_limit,
           const BundleSettings& settings) {
  BundleSolution solution = solution_from(job, stage, settings, robust_limit, kMaxIterations);
  if (!stage.settings.common_moves) solution.system.reset();
  stage.geometry = std::move(solution.geometry);
  stage.converged = solution.converged;
  stage.iterations += solution.iterations;
  stage.system = std::move(solution.system);
  stage.squares = 0;
  for (const double q : solution.squares) stage.squares += std::max(0.0, q);
}

// While outliers are sought, a tenth of a standard deviation is near enough.
void solve_roughly(const AdjustmentJob& job, AdjustmentStage& stage, double robust_limit) {
  BundleSettings settings = stage.settings;
  settings.converged = 0.01;
  solve(job, stage, robust_limit, settings);
}

// A rejected feature of four points of which three fit comes back without the fourth.
bool readmit_without_one(const AdjustmentJob& job, const AdjustmentStage& stage, Sighting& sighting,
                         double limit_of_6) {
  Sighting best;
  double least = limit_of_6;
  for (std::size_t c = 0; c < kMaxFeaturePoints; ++c) {
    Sighting trial = sighting;
    trial.point_used.fill(true);
    trial.point_used[c] = false;
    if (!whiten(trial)) continue;
    const std::vector<Sighting> one{trial};
    const double statistic = test_sightings(job.network, stage.geometry, one, stage.layout, stage.settings,
                                            *stage.system, stage.covariance)[0]
                                 .statistic;
    if (statistic >= least) continue;
    least = statistic;
    best = trial;
  }
  if (best.feature < 0) return false;
  sighting = best;
  return true;
}

}  // namespace

void solve(const AdjustmentJob& job, AdjustmentStage& stage) { solve(job, stage, 0, stage.settings); }

void analyse(const AdjustmentJob& job, AdjustmentStage& stage) {
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
  double unknowns = 0;
  if (stage.settings.common_moves) {
    stage.covariance = common_covariance(*stage.system, stage.layout, stage.settings);
    unknowns = stage.layout.size - (stage.settings.interior_moves ? 0 : stage.layout.num_interior);
  }
  for (const EpochElimination& epoch : stage.system->epochs) {
    unknowns += 6.0 * static_cast<double>(epoch.stations.size() + epoch.bodies.size());
  }
  stage.redundancy = rows - unknowns;
  if (stage.settings.common_moves) stage.redundancy += prior_information(job, stage);
}

std::vector<SightingTest> test_stage(const AdjustmentJob& job, const AdjustmentStage& stage) {
  return test_sightings(job.network, stage.geometry, stage.sightings, stage.layout, stage.settings,
                        *stage.system, stage.covariance);
}

double solve_robustly(const AdjustmentJob& job, AdjustmentStage& stage) {
  double limit2 = 0;
  for (int round = 0; round < kRobustRounds; ++round) {
    const std::vector<double> squares = present_squares(job, stage);
    std::vector<double> ratios;
    for (std::size_t s = 0; s < squares.size(); ++s) {
      if (squares[s] >= 0) ratios.push_back(squares[s] / chi2_median(stage.sightings[s].rows));
    }
    const double next = kRobustWidth * kRobustWidth * 8 * std::max(1.0, median(ratios));
    if (round > 0 && next > 0.5 * limit2) break;
    limit2 = next;
    solve_roughly(job, stage, std::sqrt(limit2));
  }
  return limit2;
}

void drop_unsupported(const AdjustmentJob& job, AdjustmentStage& stage) {
  const Network& network = job.network;
  NetworkGeometry& geometry = stage.geometry;
  std::vector<char> photos(network.photos.size(), 0);
  std::vector<char> features(network.features.size(), 0);
  std::vector<std::vector<char>> poses(static_cast<std::size_t>(network.num_bodies),
                                       std::vector<char>(static_cast<std::size_t>(network.num_epochs), 0));
  for (const Sighting& sighting : stage.sightings) {
    if (sighting.status != SightingStatus::used) continue;
    const auto p = static_cast<std::size_t>(sighting.photo);
    const auto f = static_cast<std::size_t>(sighting.feature);
    photos[p] = features[f] = 1;
    poses[static_cast<std::size_t>(network.features[f].body)]
         [static_cast<std::size_t>(network.photos[p].epoch)] = 1;
  }
  for (std::size_t p = 0; p < photos.size(); ++p) geometry.has_photo[p] &= photos[p];
  for (std::size_t f = 0; f < features.size(); ++f) geometry.has_feature[f] &= features[f];
  for (std::size_t b = kReferenceBody + 1; b < poses.size(); ++b) {
    for (std::size_t e = 0; e < poses[b].size(); ++e) geometry.has_pose[b][e] &= poses[b][e];
  }
}

void reject_outliers(const AdjustmentJob& job, AdjustmentStage& stage, double robust_limit2) {
  const std::vector<double> squares = present_squares(job, stage);
  for (std::size_t s = 0; s < stage.sightings.size(); ++s) {
    if (squares[s] > robust_limit2) stage.sightings[s].status = SightingStatus::outlier;
  }
  std::map<int, double> limits;  // by rows
  for (const Sighting& sighting : stage.sightings) limits[sighting.rows] = 0;
  limits[6] = 0;
  for (auto& [rows, limit] : limits) limit = chi2_quantile(rows, job.options.outlier_probability);
  const auto limit_of = [&](int rows) { return limits.at(rows); };
  for (int round = 0; round < kOutlierRounds; ++round) {
    solve_roughly(job, stage, 0);
    analyse(job, stage);
    const std::vector<SightingTest> tests = test_stage(job, stage);
    std::vector<double> used;
    double worst = 0;
    for (std::size_t s = 0; s < tests.size(); ++s) {
      if (stage.sightings[s].status != SightingStatus::used) continue;
      used.push_back(tests[s].statistic / chi2_median(stage.sightings[s].rows));
      worst = std::max(worst, tests[s].statistic);
    }
    // Covariances that promise too much must not make outliers of everything.
    const double factor = std::max(1.0, median(used));
    bool changed = false;
    for (std::size_t s = 0; s < tests.size(); ++s) {
      Sighting& sighting = stage.sightings[s];
      const double limit = factor * limit_of(sighting.rows);
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
                   readmit_without_one(job, stage, sighting, kReadmission * factor * limit_of(6))) {
          sighting.status = SightingStatus::used;
          changed = true;
        }
      }
    }
    if (!changed) break;
  }
}

}  // namespace hexcal
