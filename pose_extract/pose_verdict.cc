#include "pose_extract/pose_verdict.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "photogrammetry/adjustment/planar_pose.h"

namespace hexcal {
namespace {

// Rise of the sum of squares below which the flipped pose stays possible.
constexpr double kAmbiguousSigmas2 = 30;
// Residuals over what the photographs promise, beyond which something is wrong with the whole: real lenses
// and prints stay below 2.
constexpr double kSuspectSigma0 = 3;

// A pair counts as swapped when it fits so many times better that way: machines are wrong by centimetres, but
// neighbouring poses not in opposite directions.
constexpr double kSwappedFitsBetter = 3;
constexpr double kLeverMm = 100;  // what a radian of rotation counts for

double pose_gap_mm(const Pose& a, const Pose& b) {
  const Rigid3 between = inverse(home_from_lg(a)) * home_from_lg(b);
  return (a.position_mm - b.position_mm).norm() +
         kLeverMm * rotation_vector_from_quaternion(between.rotation).norm();
}

void add_words(std::string& words, const std::string& more) {
  if (!words.empty()) words += "; ";
  words += more;
}

// What the epoch's sightings amount to.
struct EpochEvidence {
  std::set<int> photos, markers;  // with used sightings of the moving body
  int moving_used = 0, moving_rejected = 0;
  int moving_unplaced = 0;  // that contradict each other, or are connected with no other pose
  int fixed_used = 0;
  const Sighting* only = nullptr;  // the moving sighting when there is one
};

EpochEvidence evidence_of(const CampaignResult& result, std::size_t epoch) {
  EpochEvidence evidence;
  for (const Sighting& sighting : result.adjusted.sightings) {
    if (sighting.marker < 0) continue;
    if (static_cast<std::size_t>(result.network.photos[static_cast<std::size_t>(sighting.photo)].epoch) !=
        epoch) {
      continue;
    }
    const bool used = sighting.status == SightingStatus::used;
    const bool moving =
        result.network.markers[static_cast<std::size_t>(sighting.marker)].body == Body::moving;
    if (used && !moving) ++evidence.fixed_used;
    if (!moving) continue;
    if (sighting.status == SightingStatus::outlier) ++evidence.moving_rejected;
    if (sighting.status == SightingStatus::unoriented) ++evidence.moving_unplaced;
    if (!used) continue;
    ++evidence.moving_used;
    evidence.photos.insert(sighting.photo);
    evidence.markers.insert(sighting.marker);
    evidence.only = evidence.moving_used == 1 ? &sighting : nullptr;
  }
  return evidence;
}

bool flipped_pose_fits(const CampaignResult& result, const Sighting& sighting) {
  const NetworkPhoto& photo = result.network.photos[static_cast<std::size_t>(sighting.photo)];
  const std::vector<PlanarPose> poses = planar_marker_poses(
      result.adjusted.geometry.cameras[static_cast<std::size_t>(photo.camera)], sighting.px,
      result.network.markers[static_cast<std::size_t>(sighting.marker)].size_mm);
  if (poses.size() < 2) return false;
  const double variance = std::max(1e-12, sighting.covariance_px2.trace() / 8) *
                          std::max(1.0, result.adjusted.sigma0 * result.adjusted.sigma0);
  return 8 * (poses[1].rms_px * poses[1].rms_px - poses[0].rms_px * poses[0].rms_px) <
         kAmbiguousSigmas2 * variance;
}

// Median over the epoch's moving markers of the largest angle between two lines of sight, degrees.
double intersection_angle(const CampaignResult& result, std::size_t epoch) {
  const NetworkGeometry& geometry = result.adjusted.geometry;
  std::map<int, std::vector<Eigen::Vector3d>> rays;
  for (const Sighting& sighting : result.adjusted.sightings) {
    if (sighting.status != SightingStatus::used) continue;
    const auto p = static_cast<std::size_t>(sighting.photo);
    const auto m = static_cast<std::size_t>(sighting.marker);
    if (static_cast<std::size_t>(result.network.photos[p].epoch) != epoch) continue;
    if (result.network.markers[m].body != Body::moving) continue;
    const Eigen::Vector3d at = geometry.fixed_from_moving[epoch] * geometry.body_from_marker[m].translation;
    rays[sighting.marker].push_back((at - inverse(geometry.camera_from_fixed[p]).translation).normalized());
  }
  std::vector<double> largest;
  for (const auto& [marker, lines] : rays) {
    double angle = 0;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      for (std::size_t j = i + 1; j < lines.size(); ++j) {
        angle = std::max(angle, std::atan2(lines[i].cross(lines[j]).norm(), lines[i].dot(lines[j])));
      }
    }
    largest.push_back(angle);
  }
  if (largest.empty()) return 0;
  std::sort(largest.begin(), largest.end());
  return largest[largest.size() / 2] * kDegPerRad;
}

// Status from what was photographed, before any pose is looked at.
PoseStatus status_of_photographs(const CampaignObservations& observations, const CampaignResult& result,
                                 std::size_t epoch, std::string& words) {
  int photographs = 0;
  int usable = 0;
  int duplicates = 0;
  for (std::size_t p = 0; p < result.photographs.size(); ++p) {
    if (static_cast<std::size_t>(result.network.photos[p].epoch) != epoch) continue;
    ++photographs;
    const MeasuredPhotograph& photograph = result.photographs[p];
    const bool set_aside =
        photograph.status == PhotoStatus::unreadable || photograph.status == PhotoStatus::wrong_camera ||
        photograph.status == PhotoStatus::duplicate || photograph.status == PhotoStatus::no_markers;
    if (!set_aside) ++usable;
    if (photograph.status == PhotoStatus::duplicate) ++duplicates;
    if (photograph.status != PhotoStatus::ok) {
      add_words(words, fmt::format("{}: {}", observations.photographs[p].seen.name, photograph.words));
    }
  }
  if (photographs == 0) {
    add_words(words, "its folder holds no photographs");
    return PoseStatus::no_photographs;
  }
  if (duplicates == photographs) return PoseStatus::same_photographs;
  return usable == 0 ? PoseStatus::no_usable_photographs : PoseStatus::ok;
}

void judge_pose(const Campaign& campaign, const ExtractOptions& options, const EpochEvidence& evidence,
                std::size_t epoch, const CampaignResult& result, MeasuredPose& pose) {
  const NetworkGeometry& geometry = result.adjusted.geometry;
  if (pose.status != PoseStatus::ok) return;
  if (evidence.moving_used == 0 && evidence.moving_rejected == 0 && !geometry.has_epoch[epoch]) {
    const bool connected = evidence.fixed_used > 0;
    if (connected && evidence.moving_unplaced > 0) {
      pose.status = PoseStatus::disconnected;
      add_words(pose.words,
                "its markers of the moving grip fit no other pose: photographs of several poses, "
                "markers that moved, or markers that no other pose shows");
      return;
    }
    pose.status = connected ? PoseStatus::no_moving_markers : PoseStatus::disconnected;
    add_words(pose.words, connected ? "no marker of the moving grip was measured"
                                    : "no fixed marker connects its photographs with the other poses");
    return;
  }
  if (evidence.moving_rejected > evidence.moving_used) {
    pose.status = PoseStatus::contradictory;
    add_words(pose.words,
              fmt::format("{} of {} sightings of moving markers contradict the rest: photographs of "
                          "another pose, or markers that moved",
                          evidence.moving_rejected, evidence.moving_rejected + evidence.moving_used));
    return;
  }
  if (!pose.pose) {
    pose.status = PoseStatus::no_datum;
    add_words(pose.words, result.UG.ok ? "LG: " + result.LG.reason : "UG: " + result.UG.reason);
    return;
  }
  if (evidence.only != nullptr && flipped_pose_fits(result, *evidence.only)) {
    pose.status = PoseStatus::ambiguous;
    add_words(pose.words, "one small marker in one photograph: its flipped pose fits as well");
    return;
  }
  const double sigma_mm = std::sqrt(pose.covariance.diagonal().head<3>().maxCoeff());
  if (!(sigma_mm <= options.max_sigma_mm)) {
    pose.status = PoseStatus::weak_geometry;
    add_words(pose.words,
              fmt::format("sigma {:.3g} mm, wanted at most {} mm", sigma_mm, options.max_sigma_mm));
    return;
  }
  if (evidence.photos.size() == 1) {
    add_words(pose.words, "one photograph only");
  } else if (pose.intersection_deg < options.min_intersection_deg) {
    add_words(pose.words, fmt::format("seen from nearly one direction ({:.1f} deg)", pose.intersection_deg));
  }
  if (evidence.moving_rejected > 0) {
    add_words(pose.words, fmt::format("{} sightings of moving markers left out", evidence.moving_rejected));
  }
  (void)campaign;
}

}  // namespace

const char* photo_status_name(PhotoStatus status) {
  switch (status) {
    case PhotoStatus::ok:
      return "ok";
    case PhotoStatus::suspect:
      return "suspect";
    case PhotoStatus::unreadable:
      return "unreadable";
    case PhotoStatus::wrong_camera:
      return "wrong_camera";
    case PhotoStatus::duplicate:
      return "duplicate";
    case PhotoStatus::no_markers:
      return "no_markers";
    case PhotoStatus::disconnected:
      return "disconnected";
    case PhotoStatus::disagrees:
      return "disagrees";
  }
  return "unknown";
}

const char* pose_status_name(PoseStatus status) {
  switch (status) {
    case PoseStatus::ok:
      return "ok";
    case PoseStatus::suspect:
      return "suspect";
    case PoseStatus::no_photographs:
      return "no_photographs";
    case PoseStatus::no_usable_photographs:
      return "no_usable_photographs";
    case PoseStatus::same_photographs:
      return "same_photographs";
    case PoseStatus::no_moving_markers:
      return "no_moving_markers";
    case PoseStatus::disconnected:
      return "disconnected";
    case PoseStatus::ambiguous:
      return "ambiguous";
    case PoseStatus::weak_geometry:
      return "weak_geometry";
    case PoseStatus::contradictory:
      return "contradictory";
    case PoseStatus::no_datum:
      return "no_datum";
  }
  return "unknown";
}

void suspect(MeasuredPose& pose, const std::string& words) {
  if (pose.status == PoseStatus::ok) pose.status = PoseStatus::suspect;
  add_words(pose.words, words);
}

void suspect(MeasuredPhotograph& photograph, const std::string& words) {
  if (photograph.status == PhotoStatus::ok) photograph.status = PhotoStatus::suspect;
  add_words(photograph.words, words);
}

void judge_photographs(const CampaignObservations& observations, CampaignResult& result) {
  std::vector<int> known(result.photographs.size(), 0);
  for (const Sighting& sighting : result.adjusted.sightings) {
    if (sighting.marker >= 0 && sighting.status != SightingStatus::not_measured) {
      ++known[static_cast<std::size_t>(sighting.photo)];
    }
  }
  for (std::size_t p = 0; p < result.photographs.size(); ++p) {
    MeasuredPhotograph& photograph = result.photographs[p];
    if (p < result.adjusted.photo_residuals.size()) photograph.residuals = result.adjusted.photo_residuals[p];
    if (!is_used(photograph.status)) continue;
    const std::vector<MarkerObservation>& markers = observations.photographs[p].seen.markers;
    if (known[p] == 0) {
      photograph.status = PhotoStatus::no_markers;
      std::string why = "none of the campaign's markers was measured";
      if (!markers.empty()) {
        const MarkerObservation& first = markers.front();
        why += fmt::format(" ({} seen; marker {}: {})", markers.size(), first.id,
                           marker_status_name(first.status));
      }
      add_words(photograph.words, why);
    } else if (!result.adjusted.geometry.has_photo[p]) {
      photograph.status =
          photograph.residuals.rejected > 0 ? PhotoStatus::disagrees : PhotoStatus::disconnected;
      add_words(photograph.words, photograph.residuals.rejected > 0
                                      ? "all its markers contradict the other photographs"
                                      : "no fixed marker connects it with the other photographs");
    } else if (photograph.residuals.rejected > photograph.residuals.markers) {
      photograph.status = PhotoStatus::disagrees;
      add_words(photograph.words, fmt::format("{} of {} markers contradict the other photographs",
                                              photograph.residuals.rejected,
                                              photograph.residuals.rejected + photograph.residuals.markers));
    }
  }
}

void judge_poses(const Campaign& campaign, const CampaignObservations& observations,
                 const ExtractOptions& options, CampaignResult& result) {
  for (std::size_t e = 0; e < result.poses.size(); ++e) {
    MeasuredPose& pose = result.poses[e];
    pose.status = status_of_photographs(observations, result, e, pose.words);
    const EpochEvidence evidence = evidence_of(result, e);
    pose.images = static_cast<int>(evidence.photos.size());
    pose.markers = static_cast<int>(evidence.markers.size());
    if (e < result.adjusted.epoch_residuals.size()) pose.rms_px = result.adjusted.epoch_residuals[e].rms_px;
    if (result.adjusted.status != AdjustmentStatus::nothing_connected &&
        result.adjusted.geometry.has_epoch[e]) {
      pose.intersection_deg = intersection_angle(result, e);
    }
    if (pose.status == PoseStatus::ok && result.adjusted.status == AdjustmentStatus::nothing_connected) {
      pose.status = PoseStatus::disconnected;
      add_words(pose.words, result.adjusted.reason);
    }
    judge_pose(campaign, options, evidence, e, result, pose);
    if (!is_measured(pose.status)) pose.pose.reset();
  }
}

void judge_campaign(const Campaign& campaign, CampaignResult& result) {
  const AdjustmentResult& adjusted = result.adjusted;
  // (marker, epoch): sightings used and rejected.
  std::map<std::pair<int, int>, std::pair<int, int>> counts;
  for (const Sighting& sighting : adjusted.sightings) {
    if (sighting.marker < 0) continue;
    auto& [used, rejected] =
        counts[{sighting.marker, result.network.photos[static_cast<std::size_t>(sighting.photo)].epoch}];
    if (sighting.status == SightingStatus::used) ++used;
    if (sighting.status == SightingStatus::outlier) ++rejected;
  }
  std::map<int, std::vector<std::string>> moved;
  for (const auto& [key, count] : counts) {
    if (count.first == 0 && count.second >= 2) {
      moved[key.first].push_back(result.poses[static_cast<std::size_t>(key.second)].id);
    }
  }
  for (const auto& [marker, poses] : moved) {
    result.warnings.push_back(fmt::format(
        "marker {} stands elsewhere in pose {}: it moved, or another marker has its id; left out there",
        result.network.markers[static_cast<std::size_t>(marker)].id, fmt::join(poses, ", ")));
  }
  std::set<int> once;
  for (const Sighting& sighting : adjusted.sightings) {
    if (sighting.status == SightingStatus::seen_once) {
      once.insert(result.network.markers[static_cast<std::size_t>(sighting.marker)].id);
    }
  }
  if (!once.empty()) {
    result.warnings.push_back(
        fmt::format("seen in one photograph only and not used: marker {}", fmt::join(once, ", ")));
  }
  if (adjusted.sigma0 > kSuspectSigma0) {
    result.warnings.push_back(fmt::format(
        "residuals are {:.1f} times what the photographs promise: the camera file is not of this lens "
        "setting, or "
        "the markers are not flat and square; sigmas are enlarged by that and may still be too small",
        adjusted.sigma0));
    for (MeasuredPose& pose : result.poses) {
      if (pose.pose) add_words(pose.words, "the campaign's residuals are too large: see the warnings");
    }
  }
  if (adjusted.interior_loosened) {
    result.warnings.push_back(
        fmt::format("the camera is not as it was calibrated: its interior orientation moved by {:.1f} sigma "
                    "and was refined freely",
                    std::sqrt(adjusted.interior_chi2 / std::max(1, adjusted.interior_dof))));
  }
  for (const MeasuredLength& bar : result.bars) {
    // A single bar that gives the scale agrees with itself.
    if (!bar.measured || (campaign.scale == ScaleFrom::bars && result.bars.size() < 2)) continue;
    const double off = bar.length_mm - bar.known.length_mm;
    const double sigma = std::hypot(bar.sigma_mm, bar.known.sigma_mm);
    if (std::abs(off) > kScaleDisagreementSigmas * sigma) {
      result.warnings.push_back(fmt::format(
          "bar {}-{}: measured {:.4f} mm, stated {:.4f} mm, {:.1f} sigma apart: it disagrees with the scale "
          "used",
          bar.known.a.id, bar.known.b.id, bar.length_mm, bar.known.length_mm, std::abs(off) / sigma));
    }
  }
  for (const DatumFrame* frame : {&result.UG, &result.LG}) {
    for (const std::string& note : frame->notes) {
      result.warnings.push_back(fmt::format("{}: {}", frame == &result.UG ? "UG" : "LG", note));
    }
  }
}

void judge_swapped_folders(const std::vector<std::optional<Pose>>& targets, CampaignResult& result) {
  std::vector<MeasuredPose>& poses = result.poses;
  const auto known = [&](std::size_t i) { return poses[i].pose && targets[i]; };
  const auto gap = [&](std::size_t measured, std::size_t target) {
    return pose_gap_mm(*poses[measured].pose, *targets[target]);
  };
  for (std::size_t i = 0; i < poses.size(); ++i) {
    for (std::size_t j = i + 1; j < poses.size(); ++j) {
      if (!known(i) || !known(j)) continue;
      if (kSwappedFitsBetter * (gap(i, j) + gap(j, i)) >= gap(i, i) + gap(j, j)) continue;
      result.warnings.push_back(fmt::format(
          "{} and {} look swapped: each lies where the other was commanded to", poses[i].id, poses[j].id));
      suspect(poses[i], fmt::format("swapped with {}?", poses[j].id));
      suspect(poses[j], fmt::format("swapped with {}?", poses[i].id));
    }
  }
}

}  // namespace hexcal
