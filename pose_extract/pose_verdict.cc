#include "pose_extract/pose_verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "kinematics/geometry/median.h"
#include "kinematics/geometry/pose_pole.h"
#include "photogrammetry/adjustment/planar_pose.h"
#include "pose_extract/misplaced_photographs.h"

namespace hexcal {
namespace {

// Rise of the sum of squares below which the flipped pose stays possible.
constexpr double kAmbiguousSigmas2 = 30;
// Photographs whose residuals are so many times the campaign's median, and poses whose sigma is, are named.
constexpr double kFarAboveMedian = 3;

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
    if (sighting.feature < 0) continue;
    if (static_cast<std::size_t>(result.network.photos[static_cast<std::size_t>(sighting.photo)].epoch) !=
        epoch) {
      continue;
    }
    const bool used = sighting.status == SightingStatus::used;
    const bool moving =
        result.network.features[static_cast<std::size_t>(sighting.feature)].body == kMovingBody;
    if (used && !moving) ++evidence.fixed_used;
    if (!moving) continue;
    if (sighting.status == SightingStatus::outlier) ++evidence.moving_rejected;
    if (sighting.status == SightingStatus::unoriented) ++evidence.moving_unplaced;
    if (!used) continue;
    ++evidence.moving_used;
    evidence.photos.insert(sighting.photo);
    evidence.markers.insert(sighting.feature);
    evidence.only = evidence.moving_used == 1 ? &sighting : nullptr;
  }
  return evidence;
}

bool flipped_pose_fits(const CampaignResult& result, const Sighting& sighting) {
  const NetworkPhoto& photo = result.network.photos[static_cast<std::size_t>(sighting.photo)];
  const std::vector<PlanarPose> poses =
      planar_marker_poses(result.adjusted.geometry.cameras[static_cast<std::size_t>(photo.camera)],
                          sighting.px, result.network.features[static_cast<std::size_t>(sighting.feature)]);
  if (poses.size() < 2) return false;
  const double variance = std::max(1e-12, sighting.covariance_px2.trace() / 8) *
                          std::max(1.0, result.adjusted.sigma0 * result.adjusted.sigma0);
  return 8 * (poses[1].rms_px * poses[1].rms_px - poses[0].rms_px * poses[0].rms_px) <
         kAmbiguousSigmas2 * variance;
}

// Largest angle between two photographs' lines of sight to the middle of the epoch's moving markers, degrees.
double intersection_angle(const CampaignResult& result, std::size_t epoch, const EpochEvidence& evidence) {
  if (evidence.markers.empty()) return 0;
  const NetworkGeometry& geometry = result.adjusted.geometry;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const int m : evidence.markers)
    middle += geometry.body_from_feature[static_cast<std::size_t>(m)].translation;
  middle = geometry.reference_from_body[kMovingBody][epoch] *
           (middle / static_cast<double>(evidence.markers.size()));
  std::vector<Eigen::Vector3d> lines;
  for (const int p : evidence.photos)
    lines.push_back(middle -
                    inverse(geometry.camera_from_reference[static_cast<std::size_t>(p)]).translation);
  double angle = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (std::size_t j = i + 1; j < lines.size(); ++j)
      angle = std::max(angle, std::atan2(lines[i].cross(lines[j]).norm(), lines[i].dot(lines[j])));
  }
  return angle * kDegPerRad;
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

void judge_pose(const ExtractOptions& options, const EpochEvidence& evidence, std::size_t epoch,
                const CampaignResult& result, MeasuredPose& pose) {
  const NetworkGeometry& geometry = result.adjusted.geometry;
  if (pose.status != PoseStatus::ok) return;
  if (evidence.moving_used == 0 && evidence.moving_rejected == 0 && !geometry.has_pose[kMovingBody][epoch]) {
    const bool connected = evidence.fixed_used > 0;
    if (connected && evidence.moving_unplaced > 0) {
      pose.status = PoseStatus::disconnected;
      add_words(pose.words,
                "its markers of the moving grip fit no other pose: photographs of several poses, "
                "markers that moved or have another size_mm, or markers that no other pose shows");
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
  if (!roll_and_yaw_are_known(*pose.pose, pose.covariance)) {
    const double pitch = pose.pose->rpy_rad.y();
    suspect(pose,
            fmt::format("pitch {:.4f} deg: roll and yaw turn about one axis there, only their {} is known",
                        pitch * kDegPerRad, pitch > 0 ? "difference" : "sum"));
  }
  // Whose photographs contradict each other: a majority may be as wrong as one.
  for (std::size_t p = 0; p < result.photographs.size(); ++p) {
    const MeasuredPhotograph& photograph = result.photographs[p];
    if (static_cast<std::size_t>(result.network.photos[p].epoch) != epoch || !photograph.contradicts_pose)
      continue;
    if (!photograph.shows_pose) {
      suspect(pose, "its photographs contradict each other, and which are right is not known");
    } else if (evidence.photos.size() < 2) {
      suspect(pose, "a single photograph is left of it");
    }
  }
  if (evidence.photos.size() == 1) {
    add_words(pose.words, "one photograph only");
  } else if (pose.intersection_deg < options.min_intersection_deg) {
    add_words(pose.words, fmt::format("seen from nearly one direction ({:.1f} deg)", pose.intersection_deg));
  }
  if (evidence.moving_rejected > 0) {
    add_words(pose.words, fmt::format("{} sightings of moving markers left out", evidence.moving_rejected));
  }
}

}  // namespace

void add_words(std::string& words, const std::string& more) {
  if (!words.empty()) words += "; ";
  words += more;
}

void suspect(MeasuredPose& pose, const std::string& words) {
  if (pose.status == PoseStatus::ok) pose.status = PoseStatus::suspect;
  add_words(pose.words, words);
}

void suspect(MeasuredPhotograph& photograph, const std::string& words) {
  if (photograph.status == PhotoStatus::ok) photograph.status = PhotoStatus::suspect;
  add_words(photograph.words, words);
}

namespace {

// Photographs whose markers of one body were all rejected while those of the other fit: they show another
// pose.
void judge_misplaced(const CampaignObservations& observations, CampaignResult& result) {
  for (const MisplacedPhotograph& misplaced : misplaced_photographs(result)) {
    MeasuredPhotograph& photograph = result.photographs[misplaced.photo];
    if (!is_used(photograph.status)) continue;
    photograph.contradicts_pose = true;
    const std::string& own = observations.photographs[misplaced.photo].pose;
    const std::string& name = observations.photographs[misplaced.photo].seen.name;
    if (misplaced.epoch) {
      photograph.shows_pose = observations.poses[*misplaced.epoch];
      suspect(photograph, fmt::format("it shows pose {}", *photograph.shows_pose));
      result.findings.emplace_back(
          fmt::format("photograph {} shows pose {}, not {}", name, *photograph.shows_pose, own),
          fmt::format("move it to the folder of {}", *photograph.shows_pose), Severity::bad);
    } else {
      suspect(photograph, "its grips stand otherwise than in the other photographs of its pose");
      result.findings.emplace_back(
          fmt::format("photograph {} contradicts the others of pose {}, and fits no other pose", name, own),
          fmt::format("look whether all photographs of {} are of one pose, or take them again", own),
          Severity::bad);
    }
  }
}

// What should be known of photographs that were used.
void remark_photographs(CampaignResult& result) {
  std::vector<double> rms_px;
  for (const MeasuredPhotograph& photograph : result.photographs) {
    if (is_used(photograph.status) && photograph.residuals.markers > 0)
      rms_px.push_back(photograph.residuals.rms_px);
  }
  const double typical_px = rms_px.empty() ? 0 : median(std::move(rms_px));
  for (std::size_t p = 0; p < result.photographs.size(); ++p) {
    MeasuredPhotograph& photograph = result.photographs[p];
    if (!is_used(photograph.status)) continue;
    const int rejected = photograph.residuals.rejected;
    if (rejected > 0)
      add_words(photograph.words, fmt::format("{} marker{} left out", rejected, rejected == 1 ? "" : "s"));
    if (typical_px > 0 && photograph.residuals.rms_px > kFarAboveMedian * typical_px)
      add_words(photograph.words, fmt::format("residuals {:.0f} times the campaign's median",
                                              photograph.residuals.rms_px / typical_px));
  }
}

// Poses far weaker than the others.
void remark_weak_poses(std::vector<MeasuredPose>& poses) {
  const auto sigma_of = [](const MeasuredPose& pose, bool position) {
    const Vector6d variance = pose.covariance.diagonal().cwiseMax(0.0);
    return std::sqrt(position ? variance.head<3>().sum() : variance.tail<3>().sum());
  };
  std::vector<double> mm, rad;
  for (const MeasuredPose& pose : poses) {
    // A pose that defines a frame has no sigma of its own and says nothing about the others'.
    if (!pose.pose || !(sigma_of(pose, true) > 0)) continue;
    mm.push_back(sigma_of(pose, true));
    rad.push_back(sigma_of(pose, false));
  }
  if (mm.empty()) return;
  const double typical_mm = median(std::move(mm));
  const double typical_rad = median(std::move(rad));
  for (MeasuredPose& pose : poses) {
    if (!pose.pose) continue;
    const double times = std::max(sigma_of(pose, true) / typical_mm, sigma_of(pose, false) / typical_rad);
    if (times > kFarAboveMedian)
      add_words(pose.words, fmt::format("sigma {:.0f} times the campaign's median", times));
  }
}

}  // namespace

namespace {

// The body that did not stand still while the pose was photographed; its sigma holds the motion.
void judge_motion(const EpochConsistency& consistency, MeasuredPose& pose) {
  if (!is_measured(pose.status)) return;
  if (consistency.moved) {
    suspect(pose, fmt::format("it moved by {:.2g} mm, {:.2g} deg between its photographs",
                              consistency.moved_mm, consistency.moved_rad * kDegPerRad));
  } else if (consistency.stands_out) {
    add_words(pose.words,
              fmt::format("its photographs disagree by {:.1f} times their noise; the sigma holds it",
                          std::sqrt(consistency.chi2 / consistency.dof)));
  }
}

}  // namespace

void judge_photographs(const CampaignObservations& observations, CampaignResult& result) {
  judge_misplaced(observations, result);
  std::vector<int> known(result.photographs.size(), 0);
  for (const Sighting& sighting : result.adjusted.sightings) {
    if (sighting.feature >= 0 && sighting.status != SightingStatus::not_measured) {
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
    } else if (!photograph.contradicts_pose && photograph.residuals.rejected > photograph.residuals.markers) {
      photograph.status = PhotoStatus::disagrees;
      add_words(photograph.words, fmt::format("{} of {} markers contradict the other photographs",
                                              photograph.residuals.rejected,
                                              photograph.residuals.rejected + photograph.residuals.markers));
    }
  }
  remark_photographs(result);
}

void judge_poses(const CampaignObservations& observations, const ExtractOptions& options,
                 CampaignResult& result) {
  for (std::size_t e = 0; e < result.poses.size(); ++e) {
    MeasuredPose& pose = result.poses[e];
    pose.status = status_of_photographs(observations, result, e, pose.words);
    const EpochEvidence evidence = evidence_of(result, e);
    pose.images = static_cast<int>(evidence.photos.size());
    pose.markers = static_cast<int>(evidence.markers.size());
    if (e < result.adjusted.epoch_residuals.size()) pose.rms_px = result.adjusted.epoch_residuals[e].rms_px;
    if (result.adjusted.status != AdjustmentStatus::nothing_connected &&
        result.adjusted.geometry.has_pose[kMovingBody][e]) {
      pose.intersection_deg = intersection_angle(result, e, evidence);
    }
    if (pose.status == PoseStatus::ok && result.adjusted.status == AdjustmentStatus::nothing_connected) {
      pose.status = PoseStatus::disconnected;
      add_words(pose.words, result.adjusted.reason);
    }
    judge_pose(options, evidence, e, result, pose);
    if (e < result.consistency.epochs.size()) judge_motion(result.consistency.epochs[e], pose);
    if (!is_measured(pose.status)) pose.pose.reset();
  }
  remark_weak_poses(result.poses);
}

}  // namespace hexcal
