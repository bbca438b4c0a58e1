#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kinematics/geometry/median.h"
#include "tools/report/campaign_report.h"
#include "tools/report/markup.h"

namespace hexcal {
namespace {

// A pose whose sigma is so many times the campaign's median is weak.
constexpr double kWeakSigma = 3;

double position_sigma(const PoseRecord& record) { return record.sigma->head<3>().norm(); }
double orientation_sigma(const PoseRecord& record) { return record.sigma->tail<3>().norm(); }

// A pose that defines a frame has no sigma of its own and says nothing about the others'.
bool has_sigma(const PoseRecord& record) { return record.sigma && position_sigma(record) > 0; }

template <typename Value>
double median_of(const std::vector<PoseRecord>& poses, Value value) {
  std::vector<double> values;
  for (const PoseRecord& record : poses) {
    if (has_sigma(record)) values.push_back(value(record));
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

const CrossValidation* chosen_method(const CampaignReport& report) {
  if (!report.compensation) return nullptr;
  for (const CrossValidation& method : report.compensation->calibration.comparison.methods) {
    if (method.name == report.compensation->calibration.chosen) return &method;
  }
  return nullptr;
}

// What measuring alone says.
void judge_measurement(const CampaignReport& report, Verdict& verdict) {
  const std::vector<PoseJudgement> judgements = judge_poses(report.poses);
  std::vector<std::string> failed, suspects, weak;
  for (std::size_t i = 0; i < judgements.size(); ++i) {
    const std::string& id = report.poses[i].id;
    if (is_suspect(report.poses[i].status)) {
      suspects.push_back(fmt::format("{} ({})", id, report.poses[i].status));
    } else if (judgements[i].light == Light::bad) {
      failed.push_back(id);
    }
    if (judgements[i].light == Light::warning)
      weak.push_back(fmt::format("{} ({})", id, judgements[i].words));
  }
  const std::size_t count = report.poses.size();
  if (!failed.empty()) {
    verdict.findings.push_back(fmt::format("{} of {} could not be measured: {}. The table of poses says why.",
                                           failed.size(), pose_count(count), listed(failed)));
    verdict.next_steps.push_back(
        fmt::format("Retake the photographs of {} and run `hexcal measure` again.", listed(failed)));
  }
  if (!suspects.empty()) {
    verdict.findings.push_back(fmt::format("{} measured, but something contradicts {}: {}.",
                                           pose_count(suspects.size()), suspects.size() == 1 ? "it" : "them",
                                           listed(suspects)));
    verdict.next_steps.emplace_back(
        "Find out what contradicts the suspect poses before the results are used: no compensation counts "
        "them.");
  }
  if (!weak.empty()) {
    verdict.findings.push_back(
        fmt::format("{} measured with reservations: {}.", pose_count(weak.size()), listed(weak)));
    verdict.next_steps.emplace_back(
        "Photograph the poses with reservations again where they matter: three sharp photographs from "
        "different sides.");
  }
  verdict.light = failed.empty() && weak.empty() ? Light::good : Light::warning;
  if (!suspects.empty()) verdict.light = Light::bad;
  if (2 * failed.size() > count) verdict.light = Light::bad;
  verdict.headline = fmt::format(
      "{} of {} measured, typically to {} mm and {} deg (one standard deviation).", count - failed.size(),
      pose_count(count), significant_text(median_of(report.poses, position_sigma), 2),
      significant_text(median_of(report.poses, orientation_sigma) * kDegPerRad, 2));
}

void judge_network(const NetworkPart& network, Verdict& verdict) {
  if (network.sigma0 > 1.5) {
    verdict.findings.push_back(fmt::format(
        "Residuals are {} times what the corners' own standard deviations promise (sigma0): the camera file "
        "does not fit these photographs, or markers are not flat. The sigmas shown already include this.",
        significant_text(network.sigma0, 2)));
    verdict.light = std::max(verdict.light, Light::warning);
  }
  for (const std::string& warning : network.warnings) verdict.findings.push_back(sentence(warning));
  if (!network.warnings.empty()) verdict.light = std::max(verdict.light, Light::warning);
  std::vector<std::string> unused;
  for (const PhotographPart& photograph : network.photographs) {
    if (photograph.status != "ok" && !is_suspect(photograph.status)) unused.push_back(photograph.name);
  }
  if (!unused.empty()) {
    verdict.findings.push_back(fmt::format("{} of {} photographs were not used: {}.", unused.size(),
                                           network.photographs.size(), listed(unused)));
  }
}

// An identified machine whose residuals are what the measurement's noise promises.
bool fits_to_noise(const CalibrationReport& calibration) {
  return calibration.fitted.identified && calibration.fitted.identified->sigma0_of_measurement < 2;
}

void judge_compensation(const CampaignReport& report, const CrossValidation& method, Verdict& verdict) {
  const CalibrationReport& calibration = report.compensation->calibration;
  if (calibration.uncompensated) {
    const ErrorStatistics& before = *calibration.uncompensated;
    verdict.headline = fmt::format(
        "Compensation by {} takes the position error from {} to {} mm rms ({} % less) and the orientation "
        "error from {} "
        "to {} deg rms ({} % less), judged on poses that the model had not seen.",
        method.name, significant_text(before.position_rms_mm, 3),
        significant_text(method.errors.position_rms_mm, 3),
        less_by_text(before.position_rms_mm, method.errors.position_rms_mm),
        significant_text(before.orientation_rms_rad * kDegPerRad, 3),
        significant_text(method.errors.orientation_rms_rad * kDegPerRad, 3),
        less_by_text(before.orientation_rms_rad, method.errors.orientation_rms_rad));
    if (method.errors.position_rms_mm >= before.position_rms_mm) {
      verdict.light = Light::bad;
      verdict.findings.insert(verdict.findings.begin(),
                              "No method makes this machine better: do not use the commands.");
    }
  }
  const double noise_mm = median_of(report.poses, position_sigma);
  if (noise_mm > 0 && method.errors.position_rms_mm < 2 * noise_mm) {
    verdict.findings.push_back(
        "What remains is about the noise of the measurement itself: the machine may be better than can be "
        "seen here.");
  } else if (noise_mm > 0 && method.errors.position_rms_mm > 10 * noise_mm && fits_to_noise(calibration)) {
    verdict.findings.push_back(fmt::format(
        "The model fits its poses to their noise, but {} poses are few for its {} numbers: at poses that it "
        "has not seen {} times the noise remains. More poses would help, see `hexcal plan`.",
        method.poses, method.complexity, significant_text(method.errors.position_rms_mm / noise_mm, 2)));
  } else if (noise_mm > 0 && method.errors.position_rms_mm > 10 * noise_mm) {
    verdict.findings.push_back(
        fmt::format("What remains is {} times the noise of the measurement: the machine does something that "
                    "its model lacks "
                    "(play, bending, temperature), or a pose is wrong.",
                    significant_text(method.errors.position_rms_mm / noise_mm, 2)));
  }
  if (!calibration.outliers.empty()) {
    verdict.findings.push_back(fmt::format("Left out as near singular: {}.", listed(calibration.outliers)));
  }
  if (!calibration.unexplained.empty()) {
    verdict.findings.push_back(
        fmt::format("No model explains {}: measured wrongly, or the machine did not stand there. Left out.",
                    listed(calibration.unexplained)));
    verdict.next_steps.push_back(fmt::format("Photograph {} again.", listed(calibration.unexplained)));
    verdict.light = std::max(verdict.light, Light::warning);
  }
  if (calibration.identifiability) {
    for (const LegDiagnosis& leg : calibration.identifiability->legs) {
      if (leg.wrong) verdict.findings.push_back("Stands out: " + leg.sentence + ".");
    }
    if (!calibration.identifiability->advice.empty()) {
      verdict.next_steps.push_back(
          sentence("To know the machine better: " + calibration.identifiability->advice));
    }
  }
  std::vector<std::string> lost;
  for (const LegRecord& command : report.commands) {
    if (command.status != "ok") lost.push_back(command.id);
  }
  if (!lost.empty()) {
    verdict.findings.push_back(
        fmt::format("{} cannot be reached after compensation: {}.", pose_count(lost.size()), listed(lost)));
    verdict.light = std::max(verdict.light, Light::warning);
  }
}

}  // namespace

std::vector<PoseJudgement> judge_poses(const std::vector<PoseRecord>& poses) {
  const double typical_mm = median_of(poses, position_sigma);
  const double typical_rad = median_of(poses, orientation_sigma);
  std::vector<PoseJudgement> out;
  for (const PoseRecord& record : poses) {
    PoseJudgement judgement{Light::good, ""};
    if (!record.pose) {
      judgement = {Light::bad, status_text(record.status)};
    } else if (is_suspect(record.status)) {
      judgement = {Light::bad, status_text(record.status)};
    } else if (record.status != "ok") {
      judgement = {Light::warning, status_text(record.status)};
    } else if (record.sigma && !has_sigma(record)) {
      judgement = {Light::none, "defines the home"};
    } else if (record.images && *record.images == 1) {
      judgement = {Light::warning, "a single photograph: nothing checks it"};
    } else if (has_sigma(record)) {
      const double times =
          std::max(position_sigma(record) / typical_mm, orientation_sigma(record) / typical_rad);
      if (times > kWeakSigma)
        judgement = {Light::warning, fmt::format("sigma {:.0f} times the campaign's median", times)};
    }
    out.push_back(std::move(judgement));
  }
  return out;
}

Verdict campaign_verdict(const CampaignReport& report) {
  Verdict verdict;
  if (report.poses.empty()) {
    verdict.light = Light::bad;
    verdict.headline = "Nothing has been measured yet.";
    verdict.next_steps = {
        "Put the photographs of each pose into a folder of its own and run `hexcal measure`."};
    return verdict;
  }
  judge_measurement(report, verdict);
  if (report.network) judge_network(*report.network, verdict);
  if (const CrossValidation* method = chosen_method(report)) judge_compensation(report, *method, verdict);
  if (!report.compensation && !report.no_compensation.empty())
    verdict.next_steps.push_back(report.no_compensation);
  if (report.compensation && verdict.light != Light::bad) {
    verdict.next_steps.push_back(
        "Send `results/actuators.csv` to the controller, photograph the same poses as a campaign of their "
        "own "
        "and compare: `hexcal report AGAIN --before THIS`.");
  }
  return verdict;
}

}  // namespace hexcal
