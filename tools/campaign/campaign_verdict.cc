#include "tools/campaign/campaign_verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kinematics/geometry/median.h"
#include "tools/io/number_text.h"

namespace hexcal {
namespace {

// What remains after compensation is the measurement's noise below the first of these times it, and something
// that the model lacks beyond the second.
constexpr double kAboutNoise = 2;
constexpr double kFarAboveNoise = 10;
// Orientation may grow by this before a better position is no gain.
constexpr double kOrientationAllowance = 1.1;

double position_sigma(const PoseRecord& record) { return record.sigma->head<3>().norm(); }
double orientation_sigma(const PoseRecord& record) { return record.sigma->tail<3>().norm(); }

template <typename Value>
double median_of(const std::vector<PoseRecord>& poses, Value value) {
  std::vector<double> values;
  for (const PoseRecord& record : poses) {
    // A pose that defines a frame has no sigma of its own and says nothing about the others'.
    if (record.sigma && position_sigma(record) > 0) values.push_back(value(record));
  }
  return median(std::move(values));
}

// "a, b, c and 4 more"
std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 6;
  std::string out;
  for (std::size_t i = 0; i < std::min(names.size(), kShown); ++i) {
    if (i > 0) out += i + 1 == names.size() ? " and " : ", ";
    out += names[i];
  }
  if (names.size() > kShown) out += fmt::format(" and {} more", names.size() - kShown);
  return out;
}

std::string pose_count(std::size_t count) { return fmt::format("{} pose{}", count, count == 1 ? "" : "s"); }

const CrossValidation* method_named(const CalibrationReport& calibration, const std::string& name) {
  for (const CrossValidation& method : calibration.comparison.methods) {
    if (method.name == name) return &method;
  }
  return nullptr;
}

// No compensation at all, over the same held-out poses as every method.
const CrossValidation* doing_nothing(const CalibrationReport& calibration) {
  for (const CrossValidation& method : calibration.comparison.methods) {
    if (method.method == CompensationMethod::nominal && method.failure.empty() && method.poses > 0)
      return &method;
  }
  return nullptr;
}

// Where not all coordinates were measured, by the errors predicted over all six.
bool beats(const CrossValidation& method, const CrossValidation& nothing) {
  const auto errors = [](const CrossValidation& m) {
    return m.predicted ? *m.predicted
                       : PredictedOverAll{m.errors.position_rms_mm, m.errors.orientation_rms_rad};
  };
  return method.method != CompensationMethod::nominal &&
         errors(method).position_mm < errors(nothing).position_mm &&
         errors(method).orientation_rad < kOrientationAllowance * errors(nothing).orientation_rad;
}

// What measuring alone says.
void judge_measurement(const CampaignEvidence& evidence, CampaignVerdict& verdict) {
  std::vector<std::string> suspects, failed, remarked;
  for (const PoseRecord& record : evidence.poses) {
    if (is_suspect(record.status)) {
      suspects.push_back(fmt::format("{} ({})", record.id, record.status));
    } else if (!record.pose) {
      failed.push_back(record.id);
    } else if (!record.remarks.empty()) {
      remarked.push_back(fmt::format("{} ({})", record.id, record.remarks));
    }
  }
  const std::size_t count = evidence.poses.size();
  if (evidence.quality) {
    verdict.findings = evidence.quality->findings;
  } else if (!failed.empty()) {
    verdict.findings.emplace_back(
        fmt::format("{} of {} could not be measured: {}", failed.size(), pose_count(count), listed(failed)),
        fmt::format("take the photographs of {} again and run `hexcal measure`", listed(failed)));
  }
  if (!suspects.empty()) {
    verdict.findings.emplace_back(
        fmt::format("{} measured, but something contradicts {}: {}", pose_count(suspects.size()),
                    suspects.size() == 1 ? "it" : "them", listed(suspects)),
        "find out what contradicts the suspect poses before the results are used: no compensation counts "
        "them",
        Severity::bad);
  }
  if (!remarked.empty()) {
    verdict.findings.emplace_back(
        fmt::format("{} measured with reservations: {}", pose_count(remarked.size()), listed(remarked)),
        "photograph the poses with reservations again where they matter: three sharp photographs from "
        "different sides");
  }
  std::vector<std::string> unused;
  for (const PhotoRecord& photograph : evidence.photographs) {
    if (photograph.status != "ok" && !is_suspect(photograph.status)) unused.push_back(photograph.photo);
  }
  if (!unused.empty()) {
    verdict.findings.emplace_back(fmt::format("{} of {} photographs were not used: {}", unused.size(),
                                              evidence.photographs.size(), listed(unused)),
                                  "", Severity::good);
  }
  verdict.headline = fmt::format(
      "{} of {} measured, typically to {} mm and {} deg (one standard deviation).", count - failed.size(),
      pose_count(count), significant_text(median_of(evidence.poses, position_sigma), 2),
      significant_text(median_of(evidence.poses, orientation_sigma) * kDegPerRad, 2));
}

std::string error_words(const ErrorStatistics& errors) {
  return fmt::format("{} mm and {} deg rms", significant_text(errors.position_rms_mm, 3),
                     significant_text(errors.orientation_rms_rad * kDegPerRad, 3));
}

std::string gain_headline(const std::string& name, const ErrorStatistics& before,
                          const ErrorStatistics& after) {
  return fmt::format(
      "Compensation by {} takes the position error from {} to {} mm rms ({} % less) and the orientation "
      "error from {} "
      "to {} deg rms ({} % less), judged on the same {} poses, each by a model that had not seen it.",
      name, significant_text(before.position_rms_mm, 3), significant_text(after.position_rms_mm, 3),
      less_by_text(before.position_rms_mm, after.position_rms_mm),
      significant_text(before.orientation_rms_rad * kDegPerRad, 3),
      significant_text(after.orientation_rms_rad * kDegPerRad, 3),
      less_by_text(before.orientation_rms_rad, after.orientation_rms_rad), after.poses);
}

// An identified machine whose residuals are what the measurement's noise promises.
bool fits_to_noise(const CalibrationReport& calibration) {
  return calibration.fitted.identified && calibration.fitted.identified->sigma0_of_measurement < 2;
}

void judge_remainder(const CalibrationReport& calibration, const CrossValidation& method, double noise_mm,
                     CampaignVerdict& verdict) {
  if (!(noise_mm > 0)) return;
  const double times = method.errors.position_rms_mm / noise_mm;
  if (times < kAboutNoise) {
    verdict.findings.emplace_back(
        "what remains is about the noise of the measurement itself: the machine may be better than can be "
        "seen here",
        "", Severity::good);
  } else if (times > kFarAboveNoise && fits_to_noise(calibration)) {
    verdict.findings.emplace_back(fmt::format("the model fits its poses to their noise, but {} poses are few "
                                              "for its {} numbers: at other poses "
                                              "{} times the noise remains",
                                              method.poses, method.complexity, significant_text(times, 2)),
                                  "measure more poses, see `hexcal plan`", Severity::good);
  } else if (times > kFarAboveNoise) {
    verdict.findings.emplace_back(fmt::format("what remains is {} times the noise of the measurement: the "
                                              "machine does something that its model "
                                              "lacks (play, bending, temperature), or a pose is wrong",
                                              significant_text(times, 2)),
                                  "", Severity::good);
  }
}

void judge_compensation(const CampaignEvidence& evidence, const CrossValidation& method,
                        CampaignVerdict& verdict) {
  const CalibrationReport& calibration = *evidence.calibration;
  if (calibration.doubt) {
    verdict.headline =
        "The measured poses and hexapod.yaml do not speak of one machine: no command is given.";
    verdict.findings.emplace_back(calibration.doubt->cause(), calibration.doubt->instruction, Severity::bad);
    return;
  }
  const double noise_mm = median_of(evidence.poses, position_sigma);
  if (const CrossValidation* nothing = doing_nothing(calibration)) {
    if (beats(method, *nothing)) {
      verdict.send = true;
      verdict.headline = gain_headline(method.name, nothing->errors, method.errors);
    } else {
      verdict.headline = fmt::format("No method makes this machine better than it is: {} over {} poses.",
                                     error_words(nothing->errors), nothing->errors.poses);
      const bool as_good_as_seen = noise_mm > 0 && nothing->errors.position_rms_mm < kAboutNoise * noise_mm;
      if (!as_good_as_seen) {
        verdict.findings.emplace_back("no method makes this machine better",
                                      "do not use the corrected commands", Severity::bad);
      }
    }
  }
  judge_remainder(calibration, method, noise_mm, verdict);
  if (calibration.fitted.identified && calibration.fitted.identified->drift) {
    verdict.findings.emplace_back(calibration.fitted.identified->drift->sentence(), kDriftInstruction);
  }
  if (!calibration.outliers.empty()) {
    verdict.findings.emplace_back(fmt::format("left out as near singular: {}", listed(calibration.outliers)),
                                  "", Severity::good);
  }
  if (!calibration.unexplained.empty()) {
    verdict.findings.emplace_back(
        fmt::format("no model explains {}: measured wrongly, or the machine did not stand there; left out",
                    listed(calibration.unexplained)),
        fmt::format("photograph {} again", listed(calibration.unexplained)));
  }
  std::vector<std::string> lost;
  for (const LegRecord& command : evidence.commands) {
    if (command.status != "ok") lost.push_back(command.id);
  }
  if (!lost.empty()) {
    verdict.findings.emplace_back(
        fmt::format("{} cannot be reached after compensation: {}", pose_count(lost.size()), listed(lost)),
        "choose other targets for them, or leave them out");
  }
  if (!calibration.identifiability) return;
  for (const LegDiagnosis& leg : calibration.identifiability->legs) {
    if (leg.wrong) verdict.findings.emplace_back("stands out: " + leg.sentence, "", Severity::good);
  }
}

void add_steps(const CampaignEvidence& evidence, CampaignVerdict& verdict) {
  std::ranges::stable_sort(verdict.findings,
                           [](const Finding& a, const Finding& b) { return a.severity > b.severity; });
  const auto add = [&verdict](const std::string& step) {
    if (!step.empty() && std::ranges::find(verdict.next_steps, step) == verdict.next_steps.end())
      verdict.next_steps.push_back(step);
  };
  for (const Finding& finding : verdict.findings) {
    verdict.severity = std::max(verdict.severity, finding.severity);
    add(finding.instruction);
  }
  verdict.send = verdict.send && verdict.severity != Severity::bad;
  if (evidence.calibration == nullptr) {
    add(evidence.no_compensation);
    return;
  }
  const auto& identifiability = evidence.calibration->identifiability;
  if (identifiability && !identifiability->advice.empty())
    add("to know the machine better: " + identifiability->advice);
  if (verdict.send) {
    add("send `results/actuators.csv` to the controller, photograph the same poses as a campaign of their "
        "own and "
        "compare: `hexcal report AGAIN --before THIS`");
  }
}

}  // namespace

CampaignVerdict judge_results(const CampaignEvidence& evidence) {
  CampaignVerdict verdict;
  if (evidence.poses.empty()) {
    verdict.severity = Severity::bad;
    verdict.headline = "Nothing has been measured yet.";
    verdict.next_steps = {
        "put the photographs of each pose into a folder of its own and run `hexcal measure`"};
    return verdict;
  }
  judge_measurement(evidence, verdict);
  if (evidence.calibration != nullptr) {
    if (const CrossValidation* method = method_named(*evidence.calibration, evidence.calibration->chosen))
      judge_compensation(evidence, *method, verdict);
  }
  add_steps(evidence, verdict);
  return verdict;
}

}  // namespace hexcal
