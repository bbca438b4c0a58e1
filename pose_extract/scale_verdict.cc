#include <fmt/format.h>

#include <cmath>

#include "pose_extract/pose_verdict.h"

namespace hexcal {
namespace {

// No print is farther off; a unit, or a distance that was mistyped, is.
constexpr double kBeyondAnyPrint = 0.1;
constexpr double kTellsFactor = 4;  // how much better a source must know the scale to decide about another
constexpr double kAgreeingBars = 1.3;

// A length is `times` as large by one source as by the scale used; sigma of that.
struct ScaleClaim {
  double times = 1, sigma = 0;
  [[nodiscard]] double off() const { return std::abs(times - 1); }
};

double scale_sigma(const DatumFrame& frame) {
  return std::sqrt(frame.by_error.row(6).squaredNorm() + frame.own(6, 6));
}

std::optional<ScaleClaim> claim_of_length(const MeasuredLength& length) {
  if (!length.measured || !(length.length_mm > 0)) return std::nullopt;
  const double known_mm = length.known.sigma_mm > 0 ? length.known.sigma_mm : kUnstatedLengthSigmaMm;
  return ScaleClaim{length.known.length_mm / length.length_mm,
                    std::hypot(length.sigma_mm, known_mm) / length.length_mm};
}

std::optional<ScaleClaim> claim_of_nominal(const CampaignResult& result, const std::optional<FrameRule>& rule,
                                           int body) {
  if (!rule || rule->from != FrameRule::From::nominal) return std::nullopt;
  const DatumFrame scaled = frame_from_nominal(result.network, result.adjusted, body, rule->nominal, true);
  if (!scaled.ok) return std::nullopt;
  return ScaleClaim{scaled.scale, scale_sigma(scaled)};
}

// Another source that knows the scale used to be right where `doubted` says otherwise.
bool confirmed(const ScaleClaim& doubted, const std::vector<ScaleClaim>& others) {
  for (const ScaleClaim& other : others) {
    if (other.off() <= kScaleDisagreementSigmas * other.sigma && kTellsFactor * other.sigma < doubted.off())
      return true;
  }
  return false;
}

void contradict(CampaignResult& result, const std::string& words, const std::string& instruction) {
  result.findings.emplace_back(words, instruction, Severity::bad);
  for (MeasuredPose& pose : result.poses) {
    if (pose.pose) suspect(pose, words);
  }
}

// The stated sizes beside bars or nominal coordinates that gave the scale.
void judge_sizes(const ScaleClaim& print, const char* source, bool source_agrees_with_itself,
                 const std::vector<ScaleClaim>& others, CampaignResult& result) {
  if (print.off() <= kScaleDisagreementSigmas * print.sigma) return;
  const double paper = std::hypot(print.sigma, kPaperScaleSigma);
  const bool contradicts = print.off() > kContradictionSigmas * paper;
  const bool known = print.off() < kBeyondAnyPrint && (source_agrees_with_itself || confirmed(print, others));
  const std::string words = fmt::format(
      "the markers are printed {:.4f} % larger than their stated sizes (sigma {:.4f} %): the scale is that "
      "of the {}",
      (print.times - 1) * 100, print.sigma * 100, source);
  if (!contradicts || known) {
    result.findings.emplace_back(words);
    return;
  }
  contradict(
      result, fmt::format("{}, and nothing confirms it{}", words, unit_words(print.times)),
      fmt::format("measure a marker's edge and the {} again; where the print is scaled, write the edge "
                  "as measured in size_mm",
                  source));
}

}  // namespace

std::string unit_words(double times) {
  struct Unit {
    double factor;
    const char* name;
  };
  constexpr Unit units[] = {{25.4, "inch"}, {10, "cm"}, {1000, "m"}, {304.8, "feet"}};
  for (const Unit& unit : units) {
    if (std::abs(std::abs(std::log(times)) - std::log(unit.factor)) < 0.05)
      return fmt::format(" (a factor of {}: {} for mm?)", unit.factor, unit.name);
  }
  return "";
}

void judge_scale(const Campaign& campaign, CampaignResult& result) {
  std::vector<ScaleClaim> lengths;
  const bool by_bars = campaign.scale == ScaleFrom::bars;
  for (const auto* list : {&result.bars, &result.checks}) {
    if (by_bars && list == &result.bars) continue;
    for (const MeasuredLength& length : *list) {
      if (const auto claim = claim_of_length(length)) lengths.push_back(*claim);
    }
  }
  if (campaign.scale == ScaleFrom::nominal) {
    const bool by_ug = campaign.ug && campaign.ug->from == FrameRule::From::nominal;
    const DatumFrame& scaled = by_ug ? result.UG : result.LG;
    if (!scaled.ok) return;
    std::vector<ScaleClaim> others = lengths;
    if (by_ug) {
      if (auto other = claim_of_nominal(result, campaign.lg, kMovingBody)) {
        other->times /= scaled.scale;
        others.push_back(*other);
      }
    }
    judge_sizes({scaled.scale, scale_sigma(scaled)}, "nominal coordinates", false, others, result);
    return;
  }
  const auto of_ug = claim_of_nominal(result, campaign.ug, kReferenceBody);
  const auto of_lg = claim_of_nominal(result, campaign.lg, kMovingBody);
  if (const auto print = result.adjusted.print_scale(); by_bars && print) {
    std::vector<ScaleClaim> others = lengths;
    for (const auto& nominal : {of_ug, of_lg}) {
      if (nominal) others.push_back(*nominal);
    }
    const bool bars_agree = result.bars.size() > 1 && result.adjusted.length_inflation < kAgreeingBars;
    judge_sizes({1 + print->value, print->sigma()}, "bars", bars_agree, others, result);
  }
  for (const auto& [nominal, name] : {std::pair{of_ug, "UG"}, std::pair{of_lg, "LG"}}) {
    if (!nominal || nominal->off() <= kScaleDisagreementSigmas * nominal->sigma) continue;
    const std::string words = fmt::format(
        "{}'s nominal coordinates are {:.4f} % larger than measured (sigma {:.4f} %): they "
        "disagree with the scale used",
        name, (nominal->times - 1) * 100, nominal->sigma * 100);
    if (nominal->off() <= kContradictionSigmas * nominal->sigma || confirmed(*nominal, lengths)) {
      result.findings.emplace_back(words);
    } else {
      contradict(result, words,
                 "measure a marker's edge, correct size_mm where the print is scaled, or the coordinates");
    }
  }
}

}  // namespace hexcal
