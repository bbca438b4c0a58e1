#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "kinematics/geometry/chi_squared.h"
#include "pose_extract/pose_verdict.h"

namespace hexcal {
namespace {

constexpr double kManyElsewhere = 0.3;  // of a grip's markers in one pose

void suspect_all(CampaignResult& result, const std::string& words) {
  for (MeasuredPose& pose : result.poses) {
    if (pose.pose) suspect(pose, words);
  }
}

std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 6;
  if (names.size() <= kShown) return fmt::format("{}", fmt::join(names, ", "));
  return fmt::format("{} and {} more", fmt::join(names.begin(), names.begin() + kShown, ", "),
                     names.size() - kShown);
}

void judge_failed_poses(CampaignResult& result) {
  if (!result.has_moving) return;
  std::vector<std::string> failed;
  for (const MeasuredPose& pose : result.poses) {
    // Without a datum no photograph is to blame.
    if (!is_measured(pose.status) && pose.status != PoseStatus::no_datum) failed.push_back(pose.id);
  }
  if (failed.empty()) return;
  const bool most = 2 * failed.size() > result.poses.size();
  result.findings.emplace_back(
      fmt::format("{} of {} poses could not be measured", failed.size(), result.poses.size()),
      fmt::format("read why in their rows and take the photographs of {} again", listed(failed)),
      most ? Severity::bad : Severity::warning);
}

void judge_markers(CampaignResult& result) {
  const AdjustmentResult& adjusted = result.adjusted;
  // (marker, epoch): sightings used and rejected.
  std::map<std::pair<int, int>, std::pair<int, int>> counts;
  std::set<int> once;
  for (const Sighting& sighting : adjusted.sightings) {
    if (sighting.feature < 0) continue;
    const auto photo = static_cast<std::size_t>(sighting.photo);
    if (sighting.status == SightingStatus::seen_once)
      once.insert(result.network.features[static_cast<std::size_t>(sighting.feature)].id);
    // A photograph of another pose says nothing about the markers.
    if (result.photographs[photo].contradicts_pose) continue;
    auto& [used, rejected] = counts[{sighting.feature, result.network.photos[photo].epoch}];
    if (sighting.status == SightingStatus::used) ++used;
    if (sighting.status == SightingStatus::outlier) ++rejected;
  }
  std::map<int, std::vector<std::string>> moved;
  for (const auto& [key, count] : counts) {
    if (count.first == 0 && count.second >= 2)
      moved[key.first].push_back(result.poses[static_cast<std::size_t>(key.second)].id);
  }
  for (const auto& [marker, poses] : moved) {
    const int id = result.network.features[static_cast<std::size_t>(marker)].id;
    result.findings.emplace_back(
        fmt::format(
            "marker {} stands elsewhere in pose {}: it moved, or another marker has its id; left out there",
            id, fmt::join(poses, ", ")),
        fmt::format("look whether marker {} still sticks where it did", id));
  }
  if (!once.empty()) {
    result.findings.emplace_back(
        fmt::format("seen in one photograph only and not used: marker {}", fmt::join(once, ", ")), "",
        Severity::good);
  }
}

// Of the markers of a body that an epoch shows, those that stand elsewhere there; by epoch.
std::vector<std::pair<int, int>> elsewhere_and_seen(const CampaignResult& result, int body) {
  std::map<std::pair<std::size_t, int>, std::pair<int, int>> counts;  // (epoch, marker): used, rejected
  for (const Sighting& sighting : result.adjusted.sightings) {
    const auto photo = static_cast<std::size_t>(sighting.photo);
    if (sighting.feature < 0 || result.photographs[photo].contradicts_pose) continue;
    if (result.network.features[static_cast<std::size_t>(sighting.feature)].body != body) continue;
    auto& [used, rejected] =
        counts[{static_cast<std::size_t>(result.network.photos[photo].epoch), sighting.feature}];
    if (sighting.status == SightingStatus::used) ++used;
    if (sighting.status == SightingStatus::outlier) ++rejected;
  }
  std::vector<std::pair<int, int>> epochs(result.poses.size());
  for (const auto& [key, count] : counts) {
    if (count.first == 0 && count.second >= 2) ++epochs[key.first].first;
    if (count.first + count.second > 0) ++epochs[key.first].second;
  }
  return epochs;
}

// Poses in which so many markers of a body stand otherwise than in the others that these may be the wrong
// ones.
std::vector<char> judge_shifted_grips(int body, CampaignResult& result) {
  std::vector<char> shifted(result.poses.size(), 0);
  const auto epochs = elsewhere_and_seen(result, body);
  for (std::size_t e = 0; e < epochs.size(); ++e) {
    const auto& [elsewhere, seen] = epochs[e];
    if (elsewhere < 2 || elsewhere < kManyElsewhere * seen) continue;
    shifted[e] = 1;
    suspect(result.poses[e], fmt::format("{} of {} {} markers stand otherwise than in the other poses",
                                         elsewhere, seen, body == kReferenceBody ? "fixed" : "moving"));
  }
  return shifted;
}

// So many markers of a body moved that the others may be those that did.
void judge_moved_body(const MarkerSlip& last, CampaignResult& result) {
  const int body = result.network.features[static_cast<std::size_t>(last.feature)].body;
  const std::vector<char> shifted = judge_shifted_grips(body, result);
  // The first pose after which anything of the kind is seen.
  std::size_t first = result.order.size();
  double moved_mm = last.moved_mm;
  for (const MarkerSlip& slip : result.slips) {
    if (result.network.features[static_cast<std::size_t>(slip.feature)].body != body) continue;
    const auto at = std::find(result.order.begin(), result.order.end(), slip.after) - result.order.begin();
    first = std::min(first, static_cast<std::size_t>(at));
    moved_mm = std::max(moved_mm, slip.moved_mm);
  }
  for (std::size_t i = first; i-- > 1;) {
    if (shifted[result.order[i]]) first = i;
  }
  const std::string words = fmt::format(
      "the {} markers moved between {} and {} by {:.2g} mm", body == kReferenceBody ? "fixed" : "moving",
      result.poses[result.order[first - 1]].id, result.poses[result.order[first]].id, moved_mm);
  result.findings.emplace_back(
      words,
      fmt::format("fasten the markers and the grip, and take the poses from {} on again",
                  result.poses[result.order[first]].id),
      Severity::bad);
  for (std::size_t i = first; i < result.order.size(); ++i) {
    if (result.poses[result.order[i]].pose) suspect(result.poses[result.order[i]], words);
  }
}

void judge_slips(CampaignResult& result) {
  std::set<int> moved_bodies;
  for (const MarkerSlip& slip : result.slips) {
    if (!slip.many) continue;
    moved_bodies.insert(result.network.features[static_cast<std::size_t>(slip.feature)].body);
    judge_moved_body(slip, result);
  }
  for (const int body : {kReferenceBody, kMovingBody}) {
    if (moved_bodies.count(body) == 0) (void)judge_shifted_grips(body, result);
  }
  for (const MarkerSlip& slip : result.slips) {
    const NetworkFeature& marker = result.network.features[static_cast<std::size_t>(slip.feature)];
    if (moved_bodies.count(marker.body) != 0) continue;
    result.findings.emplace_back(
        fmt::format(
            "marker {} of the {} grip moved by {:.2g} mm between {} and {}; what it shows {} is left out",
            marker.id, marker.body == kReferenceBody ? "fixed" : "moving", slip.moved_mm,
            result.poses[slip.before].id, result.poses[slip.after].id,
            slip.after_is_kept ? "before" : "from then on"),
        fmt::format("fasten marker {}", marker.id));
  }
}

void judge_residuals(CampaignResult& result) {
  const double sigma0 = result.adjusted.sigma0;
  constexpr double kByChance = 1e-3;
  const AdjustmentResult& adjusted = result.adjusted;
  const bool confirmed = adjusted.interior_dof > 0 && !adjusted.interior_loosened &&
                         adjusted.interior_chi2 < chi2_quantile(adjusted.interior_dof, kByChance);
  if (sigma0 > (confirmed ? kSuspectSigma0OfAConfirmedCamera : kSuspectSigma0)) {
    result.findings.emplace_back(
        fmt::format(
            "residuals are {:.1f} times what the photographs promise: the camera file is not of this lens "
            "setting, or the markers are not flat and square; sigmas are enlarged by that and may still be "
            "too small",
            sigma0),
        "calibrate the camera at the lens setting of these photographs", Severity::bad);
    suspect_all(result, fmt::format("the campaign's residuals are {:.1f} times what they should be", sigma0));
  } else if (sigma0 > kNoisySigma0) {
    result.findings.emplace_back(fmt::format(
        "residuals are {:.1f} times what the corners' own sigmas promise: the camera file does not fit these "
        "photographs, or markers are not flat; the sigmas shown include it",
        sigma0));
  }
  if (result.adjusted.interior_loosened) {
    result.findings.emplace_back(
        fmt::format("the camera is not as it was calibrated: its interior orientation moved by {:.1f} sigma "
                    "and was refined freely",
                    std::sqrt(result.adjusted.interior_chi2 / std::max(1, result.adjusted.interior_dof))),
        "calibrate the camera again, at the zoom and focus of these photographs");
  }
}

void judge_length(const char* kind, const MeasuredLength& length, CampaignResult& result) {
  if (!length.measured) return;
  const double off = length.length_mm - length.known.length_mm;
  const double known_mm = length.known.sigma_mm > 0 ? length.known.sigma_mm : kUnstatedLengthSigmaMm;
  const double sigmas = std::abs(off) / std::hypot(length.sigma_mm, known_mm);
  if (!(sigmas > kScaleDisagreementSigmas)) return;
  const std::string name = fmt::format("{} {}-{}", kind, length.known.a.id, length.known.b.id);
  const bool contradicts = sigmas > kContradictionSigmas;
  result.findings.emplace_back(
      fmt::format(
          "{}: measured {:.4f} mm, stated {:.4f} mm, {:.1f} sigma apart: it disagrees with the scale used{}",
          name, length.length_mm, length.known.length_mm, sigmas,
          unit_words(length.known.length_mm / length.length_mm)),
      fmt::format("measure the distance from marker {} to {} again; if it stands, the markers' sizes in "
                  "campaign.yaml are wrong or one of the two moved",
                  length.known.a.id, length.known.b.id),
      contradicts ? Severity::bad : Severity::warning);
  if (contradicts) suspect_all(result, fmt::format("{} is {:+.3g} mm off ({:.1f} sigma)", name, off, sigmas));
}

void judge_datum(const char* name, const DatumFrame& frame, CampaignResult& result) {
  const bool missed = std::any_of(result.poses.begin(), result.poses.end(), [](const MeasuredPose& pose) {
    return pose.status == PoseStatus::no_datum;
  });
  if (missed && !frame.ok && frame.reason != DatumFrame().reason) {
    result.findings.emplace_back(fmt::format("{}: {}", name, frame.reason), frame.instruction, Severity::bad);
  }
  for (const std::string& note : frame.notes) result.findings.emplace_back(fmt::format("{}: {}", name, note));
  if (frame.contradiction.empty()) return;
  result.findings.emplace_back(fmt::format("{}: {}", name, frame.contradiction), frame.instruction,
                               Severity::bad);
  suspect_all(result, fmt::format("{}: {}", name, frame.contradiction));
}

}  // namespace

void judge_campaign(const Campaign& campaign, CampaignResult& result) {
  judge_failed_poses(result);
  judge_markers(result);
  judge_slips(result);
  judge_residuals(result);
  // A single bar that gives the scale agrees with itself.
  if (campaign.scale != ScaleFrom::bars || result.bars.size() > 1) {
    for (MeasuredLength bar : result.bars) {
      // As the bars promise it, before the adjustment widened their sigmas because they contradict each
      // other.
      bar.sigma_mm /= result.adjusted.length_inflation;
      judge_length("bar", bar, result);
    }
  }
  for (const MeasuredLength& check : result.checks) judge_length("check", check, result);
  judge_scale(campaign, result);
  judge_datum("UG", result.UG, result);
  judge_datum("LG", result.LG, result);
}

Severity overall_verdict(const CampaignResult& result) {
  Severity worst = Severity::good;
  const auto meet = [&worst](Severity severity) { worst = std::max(worst, severity); };
  for (const Finding& finding : result.findings) meet(finding.severity);
  for (const MeasuredPose& pose : result.poses) {
    if (!result.has_moving || pose.status == PoseStatus::ok) continue;
    meet(pose.status == PoseStatus::suspect ? Severity::bad : Severity::warning);
  }
  for (const MeasuredPhotograph& photograph : result.photographs) {
    if (photograph.status != PhotoStatus::ok) meet(Severity::warning);
  }
  if (result.adjusted.status != AdjustmentStatus::ok) meet(Severity::bad);
  return worst;
}

}  // namespace hexcal
