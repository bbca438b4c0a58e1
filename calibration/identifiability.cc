#include "calibration/identifiability.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/leg_residuals.h"
#include "calibration/normal_equations.h"

namespace hexcal {
namespace {

// Singular values of the Jacobian below this share of the largest count as zero (squared in its normal
// matrix).
constexpr double kRankShare = 1e-6;
constexpr double kFrameScale = 10.0;

using Solver = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;

// Index of the first layout parameter that each free parameter drives.
std::vector<int> leaders(const IdentifyResult& identified) {
  std::vector<int> leader(static_cast<std::size_t>(identified.selection.free_count), -1);
  for (int i = identified.layout.size() - 1; i >= 0; --i) {
    const int free = identified.selection.free_of[static_cast<std::size_t>(i)];
    if (free >= 0) leader[static_cast<std::size_t>(free)] = i;
  }
  return leader;
}

Eigen::VectorXd scales(const IdentifyResult& identified) {
  Eigen::VectorXd scale = identified.tolerances;
  for (Eigen::Index j = 0; j < scale.size(); ++j)
    if (!std::isfinite(scale[j])) scale[j] = kFrameScale;
  return scale;
}

int count_determined(const Eigen::MatrixXd& information, const Eigen::VectorXd& scale) {
  const Solver solver(scale.asDiagonal() * information * scale.asDiagonal(), Eigen::EigenvaluesOnly);
  return static_cast<int>((solver.eigenvalues().array() > 1.0).count());
}

struct PoseFamily {
  const char* words;
  std::vector<Vector6d> poses;
};

std::vector<PoseFamily> pose_families(double move_mm, double turn_rad) {
  const auto pair_of = [](std::initializer_list<std::pair<int, double>> moves) {
    std::vector<Vector6d> poses;
    for (const auto& [axis, size] : moves) {
      poses.emplace_back(size * Vector6d::Unit(axis));
      poses.emplace_back(-size * Vector6d::Unit(axis));
    }
    return poses;
  };
  return {{"tilted about x and y", pair_of({{3, turn_rad}, {4, turn_rad}})},
          {"turned about z (yaw)", pair_of({{5, turn_rad}})},
          {"moved along x and y", pair_of({{0, move_mm}, {1, move_mm}})},
          {"moved along z", pair_of({{2, move_mm}})}};
}

std::string advise(const PlatformGeometry& nominal, const IdentifyResult& identified,
                   const Eigen::VectorXd& scale, int determined) {
  const double length = characteristic_length_mm(nominal);
  std::string best_words;
  int best = determined;
  double turn_deg = 10;
  const ParameterSelection& selection = identified.selection;
  const PlatformGeometry& geometry = identified.machine.geometry;
  LegNoise noise{.leg_sigma_mm = identified.leg_sigma_mm};
  for (const PoseFamily& family : pose_families(0.15 * length, turn_deg * kRadPerDeg)) {
    std::vector<ReducedPose> reduced;
    ObservationSet observations;
    for (const Vector6d& v : family.poses) {
      // About home as the machine's frames have it.
      const Pose pose = geometry.pose_from_B_from_P(nominal.B_from_P(Pose::from_vector(v)));
      PoseObservation observation;
      Vector6d sigma;
      sigma << Eigen::Vector3d::Constant(identified.position_sigma_mm),
          Eigen::Vector3d::Constant(identified.orientation_sigma_rad);
      observation.covariance = sigma.cwiseAbs2().asDiagonal();
      observations.poses.push_back(observation);
      reduced.push_back(
          reduce_to_observed(linearize_legs(identified.machine, MachineModel{.geometry = geometry},
                                            identified.layout, identified.stroke_range, pose,
                                            machine_readings(identified.machine, pose), LegVector::Zero()),
                             observation.observed, selection));
    }
    const NormalEquations more =
        normal_equations(reduced, observations, std::vector<double>(reduced.size(), 1.0), noise);
    const int gained = count_determined(identified.data_information + more.information, scale);
    if (gained > best) {
      best = gained;
      best_words = family.words;
    }
  }
  const int weak = identified.selection.free_count - determined;
  if (weak == 0) return "";
  if (best_words.empty())
    return fmt::format(
        "{} combinations are known only by their tolerance; more poses of the same kind help "
        "slowly, larger moves and tilts help most",
        weak);
  return fmt::format(
      "{} combinations are known only by their tolerance; poses {} by +-{:.0f} {} would "
      "determine {} of them",
      weak, best_words, best_words.find("moved") == 0 ? 0.15 * length : turn_deg,
      best_words.find("moved") == 0 ? "mm" : "deg", best - determined);
}

std::vector<LegDiagnosis> diagnose_legs(const IdentifyResult& identified) {
  std::vector<LegDiagnosis> legs;
  std::vector<double> effects;
  for (int leg = 0; leg < 6; ++leg) {
    LegDiagnosis diagnosis;
    diagnosis.leg = leg + 1;
    const int at = ParameterLayout::kPerLeg * leg;
    const auto sigma_of = [&](int parameter) {
      const int free = identified.selection.free_of[static_cast<std::size_t>(parameter)];
      return free < 0 ? 0.0 : std::sqrt(identified.covariance(free, free));
    };
    const double scale = identified.corrections[at + 7];
    const double offset = identified.corrections[at + 6];
    const auto leg_index = static_cast<std::size_t>(leg);
    const double half_stroke_mm = 0.5 * (identified.stroke_range(leg, 1) - identified.stroke_range(leg, 0)) *
                                  identified.machine.geometry.actuators[leg_index].mm_per_unit;
    const double base = identified.corrections.segment<3>(at).norm();
    const double platform = identified.corrections.segment<3>(at + 3).norm();
    const auto joint_sigma = [&](int first) {
      return std::sqrt(std::pow(sigma_of(first), 2) + std::pow(sigma_of(first + 1), 2) +
                       std::pow(sigma_of(first + 2), 2));
    };
    struct Part {
      std::string words;
      double effect_mm;
      double significance;
    };
    const auto ratio = [](double value, double sigma) { return sigma > 0 ? std::abs(value) / sigma : 0.0; };
    std::vector<Part> parts{
        {fmt::format("scale {:+.2f} % +- {:.2f} %", 100 * scale, 100 * sigma_of(at + 7)),
         std::abs(scale * half_stroke_mm), ratio(scale, sigma_of(at + 7))},
        {fmt::format("offset {:+.3f} mm +- {:.3f} mm", offset, sigma_of(at + 6)), std::abs(offset),
         ratio(offset, sigma_of(at + 6))},
        {fmt::format("base joint {:.3f} mm off +- {:.3f} mm", base, joint_sigma(at)), base,
         ratio(base, joint_sigma(at))},
        {fmt::format("platform joint {:.3f} mm off +- {:.3f} mm", platform, joint_sigma(at + 3)), platform,
         ratio(platform, joint_sigma(at + 3))}};
    std::stable_sort(parts.begin(), parts.end(),
                     [](const Part& a, const Part& b) { return a.effect_mm > b.effect_mm; });
    std::string words;
    for (const Part& part : parts) {
      if (part.significance < 4) continue;
      diagnosis.largest_effect_mm = std::max(diagnosis.largest_effect_mm, part.effect_mm);
      words += (words.empty() ? "" : ", ") + part.words;
    }
    diagnosis.sentence = fmt::format("leg {}: {}", leg + 1, words.empty() ? "as nominal" : words);
    effects.push_back(diagnosis.largest_effect_mm);
    legs.push_back(diagnosis);
  }
  std::vector<double> sorted = effects;
  std::sort(sorted.begin(), sorted.end());
  const double typical = 0.5 * (sorted[2] + sorted[3]);
  for (LegDiagnosis& leg : legs) leg.wrong = leg.largest_effect_mm > 2 * typical && leg.largest_effect_mm > 0;
  return legs;
}

}  // namespace

Identifiability judge_identifiability(const PlatformGeometry& nominal, const IdentifyResult& identified) {
  Identifiability judged;
  const Eigen::MatrixXd& information = identified.data_information;
  const Eigen::Index n = information.rows();
  judged.free_parameters = static_cast<int>(n);
  const std::vector<int> leader = leaders(identified);
  for (Eigen::Index j = 0; j < n; ++j) {
    const int i = leader[static_cast<std::size_t>(j)];
    const double factor = parameter_unit_factor(identified.layout, i);
    judged.parameters.push_back({parameter_name(identified.layout, i), parameter_unit(identified.layout, i),
                                 factor * identified.corrections[i],
                                 factor * std::sqrt(identified.covariance(j, j)),
                                 factor * identified.tolerances[j]});
  }
  const Eigen::VectorXd length = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Solver unit_columns(length.asDiagonal() * information * length.asDiagonal(), Eigen::EigenvaluesOnly);
  const Eigen::VectorXd squares = unit_columns.eigenvalues();
  const double smallest = kRankShare * kRankShare * squares.maxCoeff();
  judged.rank = static_cast<int>((squares.array() > smallest).count());
  if (judged.rank > 0) judged.condition = std::sqrt(squares.maxCoeff() / squares[n - judged.rank]);

  const Eigen::VectorXd scale = scales(identified);
  const Solver by_tolerance(scale.asDiagonal() * information * scale.asDiagonal());
  for (Eigen::Index j = 0; j < n; ++j) {
    const double gain_squared = by_tolerance.eigenvalues()[j];
    if (gain_squared > 1) {
      ++judged.determined;
    } else if (judged.weak.size() < 10) {
      WeakDirection direction{std::sqrt(std::max(0.0, gain_squared)), {}};
      const Eigen::VectorXd shares = by_tolerance.eigenvectors().col(j).cwiseAbs();
      std::vector<Eigen::Index> order(static_cast<std::size_t>(n));
      for (Eigen::Index k = 0; k < n; ++k) order[static_cast<std::size_t>(k)] = k;
      std::stable_sort(order.begin(), order.end(),
                       [&](Eigen::Index a, Eigen::Index b) { return shares[a] > shares[b] + 1e-9; });
      for (std::size_t k = 0; k < std::min<std::size_t>(4, order.size()); ++k)
        direction.parameters.push_back(judged.parameters[static_cast<std::size_t>(order[k])].name);
      judged.weak.push_back(direction);
    }
  }
  judged.advice = advise(nominal, identified, scale, judged.determined);

  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = a + 1; b < n; ++b) {
      const double r =
          identified.covariance(a, b) / std::sqrt(identified.covariance(a, a) * identified.covariance(b, b));
      if (std::abs(r) > 0.95)
        judged.correlations.push_back({judged.parameters[static_cast<std::size_t>(a)].name,
                                       judged.parameters[static_cast<std::size_t>(b)].name, r});
    }
  }
  std::stable_sort(judged.correlations.begin(), judged.correlations.end(),
                   [](const CorrelatedPair& a, const CorrelatedPair& b) {
                     return std::abs(a.correlation) > std::abs(b.correlation);
                   });
  if (judged.correlations.size() > 10) judged.correlations.resize(10);
  judged.legs = diagnose_legs(identified);
  return judged;
}

}  // namespace hexcal
