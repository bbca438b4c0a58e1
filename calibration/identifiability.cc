#include "calibration/identifiability.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
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

// The free parameters but for the common curve: with the legs' own curves it says the same thing twice.
std::vector<Eigen::Index> without_common_curve(const IdentifyResult& identified,
                                               const std::vector<int>& leader) {
  std::vector<Eigen::Index> kept;
  for (std::size_t j = 0; j < leader.size(); ++j)
    if (parameter_kind(identified.layout, leader[j]) != ParameterKind::common_curve)
      kept.push_back(static_cast<Eigen::Index>(j));
  return kept;
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
                   const std::vector<Eigen::Index>& kept, const Eigen::VectorXd& scale, int determined) {
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
    const Eigen::MatrixXd together = identified.data_information + more.information;
    const int gained = count_determined(together(kept, kept), scale);
    if (gained > best) {
      best = gained;
      best_words = family.words;
    }
  }
  const int weak = static_cast<int>(kept.size()) - determined;
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

// One kind of number of one leg: what it is off by, in words and as a displacement of the leg.
struct LegPart {
  std::string words;
  double value = 0;
  double sigma = 0;
  double effect_mm = 0;
  bool significant() const { return sigma > 0 && std::abs(value) > 4 * sigma; }
};

// Scale, offset, base joint, platform joint.
std::array<LegPart, 4> leg_parts(const IdentifyResult& identified, int leg) {
  const int at = ParameterLayout::kPerLeg * leg;
  const auto sigma_of = [&](int parameter) {
    const int free = identified.selection.free_of[static_cast<std::size_t>(parameter)];
    return free < 0 ? 0.0 : std::sqrt(identified.covariance(free, free));
  };
  const auto joint = [&](const char* name, int first) {
    const double off = identified.corrections.segment<3>(first).norm();
    const double sigma = std::hypot(sigma_of(first), sigma_of(first + 1), sigma_of(first + 2));
    return LegPart{fmt::format("{} {:.3f} mm off +- {:.3f} mm", name, off, sigma), off, sigma, off};
  };
  const double scale = identified.corrections[at + 7];
  const double offset = identified.corrections[at + 6];
  const double half_stroke_mm =
      0.5 * (identified.stroke_range(leg, 1) - identified.stroke_range(leg, 0)) *
      identified.machine.geometry.actuators[static_cast<std::size_t>(leg)].mm_per_unit;
  return {LegPart{fmt::format("scale {:+.2f} % +- {:.2f} %", 100 * scale, 100 * sigma_of(at + 7)), scale,
                  sigma_of(at + 7), std::abs(scale * half_stroke_mm)},
          LegPart{fmt::format("offset {:+.3f} mm +- {:.3f} mm", offset, sigma_of(at + 6)), offset,
                  sigma_of(at + 6), std::abs(offset)},
          joint("base joint", at), joint("platform joint", at + 3)};
}

// A number is wrong when it is significant and far larger than the same one of the other legs: all legs of a
// machine as built are off by something.
std::vector<LegDiagnosis> diagnose_legs(const IdentifyResult& identified) {
  constexpr double kFarAboveOthers = 5;
  std::array<std::array<LegPart, 4>, 6> parts;
  for (std::size_t leg = 0; leg < 6; ++leg) parts[leg] = leg_parts(identified, static_cast<int>(leg));
  std::vector<LegDiagnosis> legs;
  for (std::size_t leg = 0; leg < 6; ++leg) {
    LegDiagnosis diagnosis;
    diagnosis.leg = static_cast<int>(leg) + 1;
    std::vector<std::pair<double, std::string>> words;  // largest effect first
    for (std::size_t kind = 0; kind < parts[leg].size(); ++kind) {
      const LegPart& part = parts[leg][kind];
      if (!part.significant()) continue;
      std::vector<double> others;
      for (std::size_t other = 0; other < 6; ++other)
        if (other != leg) others.push_back(std::abs(parts[other][kind].value));
      std::nth_element(others.begin(), others.begin() + 2, others.end());
      const bool wrong = std::abs(part.value) > kFarAboveOthers * others[2];
      diagnosis.wrong = diagnosis.wrong || wrong;
      diagnosis.largest_effect_mm = std::max(diagnosis.largest_effect_mm, part.effect_mm);
      words.emplace_back(wrong ? -1e9 : -part.effect_mm, part.words);  // what is wrong stands first
    }
    std::stable_sort(words.begin(), words.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::string joined;
    for (const auto& [order, text] : words) joined += (joined.empty() ? "" : ", ") + text;
    diagnosis.sentence = fmt::format("leg {}: {}", leg + 1, joined.empty() ? "as nominal" : joined);
    legs.push_back(diagnosis);
  }
  return legs;
}

std::vector<std::string> describe_extensions(const IdentifyResult& identified) {
  const ParameterLayout& layout = identified.layout;
  const auto sigma_of = [&](int parameter) {
    const int free = identified.selection.free_of[static_cast<std::size_t>(parameter)];
    return free < 0 ? 0.0 : std::sqrt(identified.covariance(free, free));
  };
  std::vector<std::string> sentences;
  if (layout.curve_terms > 0) {
    std::string sizes;
    for (const StrokeCurve& curve : identified.machine.stroke_curves) {
      constexpr int kSteps = 50;
      double most = 0;
      for (int i = 0; i <= kSteps; ++i)
        most = std::max(most, std::abs(curve.value_mm(curve.low + i * (curve.high - curve.low) / kSteps)));
      sizes += fmt::format("{:.3f} ", most);
    }
    sentences.push_back(fmt::format("stroke curves of the legs up to {}mm", sizes));
  }
  if (sigma_of(layout.sag()) > 0)
    sentences.push_back(
        fmt::format("legs give by {:.3f} mm +- {:.3f} mm under a pull of the moving mass's weight",
                    identified.machine.sag[0], sigma_of(layout.sag())));
  if (sigma_of(layout.backlash()) > 0) {
    std::string sizes;
    double squares = 0;
    for (int leg = 0; leg < 6; ++leg) {
      sizes += fmt::format("{:.3f} ", identified.machine.backlash_mm[leg]);
      squares += std::pow(sigma_of(layout.backlash() + leg), 2);
    }
    sentences.push_back(fmt::format("backlash of the legs {}mm +- {:.3f} mm", sizes, std::sqrt(squares / 6)));
  }
  return sentences;
}

}  // namespace

Identifiability judge_identifiability(const PlatformGeometry& nominal, const IdentifyResult& identified) {
  Identifiability judged;
  const std::vector<int> leader = leaders(identified);
  for (Eigen::Index j = 0; j < identified.covariance.rows(); ++j) {
    const int i = leader[static_cast<std::size_t>(j)];
    const double factor = parameter_unit_factor(identified.layout, i);
    judged.parameters.push_back({parameter_name(identified.layout, i), parameter_unit(identified.layout, i),
                                 factor * identified.corrections[i],
                                 factor * std::sqrt(identified.covariance(j, j)),
                                 factor * identified.tolerances[j]});
  }
  const std::vector<Eigen::Index> kept = without_common_curve(identified, leader);
  const Eigen::MatrixXd information = identified.data_information(kept, kept);
  const Eigen::Index n = information.rows();
  judged.free_parameters = static_cast<int>(n);
  const Eigen::VectorXd scale = scales(identified)(kept);
  // Of a number that moves nothing that was measured only rounding is left, which must not be scaled up.
  Eigen::VectorXd length = Eigen::VectorXd::Zero(n);
  for (Eigen::Index j = 0; j < n; ++j)
    if (information(j, j) * scale[j] * scale[j] > 1e-12) length[j] = 1.0 / std::sqrt(information(j, j));
  const Solver unit_columns(length.asDiagonal() * information * length.asDiagonal(), Eigen::EigenvaluesOnly);
  const Eigen::VectorXd squares = unit_columns.eigenvalues();
  const double smallest = kRankShare * kRankShare * squares.maxCoeff();
  judged.rank = static_cast<int>((squares.array() > smallest).count());
  if (judged.rank > 0) judged.condition = std::sqrt(squares.maxCoeff() / squares[n - judged.rank]);

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
        direction.parameters.push_back(
            judged.parameters[static_cast<std::size_t>(kept[static_cast<std::size_t>(order[k])])].name);
      judged.weak.push_back(direction);
    }
  }
  judged.advice = advise(nominal, identified, kept, scale, judged.determined);

  for (Eigen::Index a = 0; a < identified.covariance.rows(); ++a) {
    for (Eigen::Index b = a + 1; b < identified.covariance.rows(); ++b) {
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
  judged.beyond_geometry = describe_extensions(identified);
  return judged;
}

}  // namespace hexcal
