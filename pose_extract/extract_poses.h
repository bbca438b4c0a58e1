#pragma once

#include <optional>
#include <string>
#include <vector>

#include "camera_calib/calibrated_camera.h"
#include "kinematics/geometry/finding.h"
#include "photogrammetry/adjustment/adjustment.h"
#include "photogrammetry/markers/detect.h"
#include "pose_extract/campaign.h"
#include "pose_extract/datum_frame.h"
#include "pose_extract/marker_slips.h"
#include "pose_extract/pose_consistency.h"

// From marker observations to the poses of the lower grip: the whole measurement of a campaign, without
// pixels, files or printing. The stages, in order:
//   1. photographs that cannot count are set aside with words (unreadable, wrong camera setting, seen twice);
//   2. one bundle adjustment over the campaign (photogrammetry/adjustment/adjustment.h);
//   3. datum frames UG and LG on the two bodies (datum_frame.h);
//   4. each epoch's pose and covariance in home axes, and words for each pose that is not good.

namespace hexcal {

/// A photograph of the campaign after detection.
struct CampaignPhotograph {
  std::string pose;
  int camera = 0;  ///< index into CampaignObservations::cameras; -1: no camera file is for it
  PhotographObservations seen;
};

struct CampaignObservations {
  std::vector<CalibratedCamera> cameras;
  std::vector<std::string> poses;  ///< all ids in the order of the output
  std::vector<CampaignPhotograph> photographs;
};

struct ExtractOptions {
  AdjustmentOptions adjustment;
  /// With more poses than this, the markers are mapped from this many, spread over the campaign, and the
  /// others are measured one by one on that map (marker_map.h); 0: one adjustment of all.
  int map_poses = 0;
  /// A pose whose largest position sigma exceeds this is refused as weak.
  double max_sigma_mm = 1.0;
  /// Below this angle between the lines of sight a pose counts as seen from nearly one direction.
  double min_intersection_deg = 5.0;

  void validate() const;
};

enum class PhotoStatus {
  ok,
  suspect,       ///< used, but something contradicts it: the words say what
  unreadable,    ///< the file
  wrong_camera,  ///< another image size, body, lens or focal length than the camera file's
  duplicate,     ///< the same photograph twice
  no_markers,    ///< none of the campaign's
  disconnected,  ///< not connected with the others by fixed markers
  disagrees,     ///< most of its markers contradict the others
};

/// `ok` is a promise; a suspect pose has numbers and sigmas, and words for what contradicts it; all others
/// failed and have no numbers. Only `ok` poses enter a compensation unasked.
enum class PoseStatus {
  ok,
  suspect,
  no_photographs,
  no_usable_photographs,
  same_photographs,  ///< as another pose
  no_moving_markers,
  disconnected,
  ambiguous,      ///< a planar two-fold solution is open
  weak_geometry,  ///< sigma beyond max_sigma_mm
  contradictory,  ///< most markers rejected
  no_datum,       ///< UG or LG could not be found
};

/// True of photographs that entered the adjustment.
[[nodiscard]] constexpr bool is_used(PhotoStatus status) {
  return status == PhotoStatus::ok || status == PhotoStatus::suspect;
}
/// True of poses that have numbers.
[[nodiscard]] constexpr bool is_measured(PoseStatus status) {
  return status == PoseStatus::ok || status == PoseStatus::suspect;
}

[[nodiscard]] const char* photo_status_name(PhotoStatus status);
[[nodiscard]] const char* pose_status_name(PoseStatus status);

struct MeasuredPhotograph {
  PhotoStatus status = PhotoStatus::ok;
  std::string words;  ///< why not ok, or a warning
  std::optional<Rigid3> UG_from_camera;
  Matrix6d covariance = Matrix6d::Zero();  ///< perturbation of UG_from_camera (covariance.h)
  ResidualSummary residuals;
  /// The markers of one grip fit, those of the other do not: it does not show its pose; `shows_pose` names
  /// the one that it shows where there is such.
  bool contradicts_pose = false;
  std::optional<std::string> shows_pose;
};

/// Pose of LG relative to its home.
struct MeasuredPose {
  std::string id;
  PoseStatus status = PoseStatus::no_photographs;
  std::string words;  ///< why not ok, or warnings
  std::optional<Pose> pose;
  Matrix6d covariance = Matrix6d::Zero();  ///< of (x, y, z, roll, pitch, yaw), mm and rad
  int images = 0;                          ///< photographs used
  int markers = 0;                         ///< different markers of the moving body used
  double rms_px = 0;
  double intersection_deg =
      0;  ///< largest angle between its photographs' lines of sight to the moving markers
};

struct MeasuredLength {
  KnownLength known;
  bool measured = false;
  double length_mm = 0;
  double sigma_mm = 0;  ///< of the measured length
};

struct MeasuredPoint {
  MarkerPoint point;
  int body = kReferenceBody;
  Eigen::Vector3d xyz_mm = Eigen::Vector3d::Zero();  ///< in UG; moving ones in LG
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

struct CampaignResult {
  Network network;  ///< what was adjusted; photographs as in CampaignObservations
  AdjustmentResult adjusted;
  DatumFrame UG, LG;
  std::vector<std::size_t> order;   ///< epochs as they were photographed: by capture times, or as listed
  std::vector<MarkerSlip> slips;    ///< markers that did not keep their place on their body
  CampaignConsistency consistency;  ///< did the moving body stand still while a pose was photographed
  std::vector<MeasuredPose> poses;
  std::vector<MeasuredPhotograph> photographs;
  std::vector<MeasuredLength> bars, checks;
  std::vector<MeasuredPoint> points;
  std::vector<Finding> findings;  ///< about the campaign as a whole

  /// Covariance of the parameters (mm, rad) of two poses by index; zero if one has no pose.
  [[nodiscard]] Matrix6d pose_covariance(std::size_t a, std::size_t b) const;

  /// d(pose parameters)/d(errors of the adjustment, datum noise, home epoch's noise, own noise).
  struct PoseInfluence {
    Matrix6Xd by_error;
    Eigen::Matrix<double, 6, 7> by_ug = Eigen::Matrix<double, 6, 7>::Zero();
    Eigen::Matrix<double, 6, 7> by_lg = Eigen::Matrix<double, 6, 7>::Zero();
    Matrix6d by_home = Matrix6d::Zero();
    Matrix6d by_own = Matrix6d::Zero();
  };
  /// Covariance of an epoch's reference_from_body that no other estimate shares: noise, and motion between
  /// its photographs.
  [[nodiscard]] Matrix6d own_covariance(std::size_t epoch) const;
  std::vector<PoseInfluence> influences;  ///< per pose; empty matrices where there is none
  bool has_moving = false;                ///< the campaign has a moving body
  double gd_mm = 0;                       ///< of LG's rule
  int home_epoch = -1;                    ///< LG from home: the pose that defines it
};

/// The pose that LG's rule calls home: the one of this name, or else the one that is meant by it (home for
/// Home, one letter off). Throws InputError, with the way on, where there is none. Wants campaign.lg.
[[nodiscard]] std::string find_home(const Campaign& campaign, const std::vector<std::string>& poses);

/// The epochs in the order in which they were photographed: by their first capture time where all have one,
/// or else as they are listed.
[[nodiscard]] std::vector<std::size_t> photographing_order(const CampaignObservations& observations);

/// Never throws for bad photographs: see the statuses. Throws InputError when options are invalid or the home
/// pose is none of the poses.
[[nodiscard]] CampaignResult extract_poses(const Campaign& campaign, const CampaignObservations& observations,
                                           const ExtractOptions& options = {});

}  // namespace hexcal
