#pragma once

#include <fmt/format.h>

#include "pose_extract/extract_poses.h"
#include "tests/support/observation_scene.h"

namespace hexcal {

/// An ObservationScene as a campaign: UG from nominal coordinates (the fixed body's true frame is UG), LG
/// from home.
struct CampaignScene {
  ObservationScene scene;
  Campaign campaign;
  CampaignObservations observations;
};

/// All findings, a line each.
inline std::string findings_text(const CampaignResult& result) {
  std::string text;
  for (const Finding& finding : result.findings) text += finding_text(finding) + "\n";
  return text;
}

/// An observation of a square as a detector gives it.
inline MarkerObservation marker_of(const Observation& seen) {
  MarkerObservation marker;
  marker.id = seen.id;
  marker.status = MarkerStatus::ok;
  for (int c = 0; c < 4; ++c) marker.corners_px[static_cast<std::size_t>(c)] = seen.px.segment<2>(2 * c);
  marker.covariance_px2 = seen.covariance_px2;
  marker.side_px = (marker.corners_px[1] - marker.corners_px[0]).norm();
  return marker;
}

inline CampaignScene make_campaign_scene(const ObservationSceneOptions& options) {
  CampaignScene made;
  made.scene = make_observation_scene(options);
  Campaign& campaign = made.campaign;
  campaign.file = "campaign.yaml";
  campaign.family = "tag36h11";
  FrameRule ug;
  for (std::size_t m = 0; m < made.scene.network.features.size(); ++m) {
    const NetworkFeature& marker = made.scene.network.features[m];
    (marker.body == kReferenceBody ? campaign.fixed : campaign.moving)[marker.id] = square_edge_mm(marker);
    if (marker.body != kReferenceBody) continue;
    for (int c = 0; c < 4; ++c) {
      ug.nominal.push_back(
          {{marker.id, c}, made.scene.body_from_marker[m] * made.scene.printed_points(m).col(c), 0.001});
    }
  }
  campaign.ug = ug;
  FrameRule lg;
  lg.from = FrameRule::From::home;
  lg.home_pose = "home";
  lg.gd_mm = 50;
  campaign.lg = lg;

  CalibratedCamera camera;
  camera.model = made.scene.network.cameras[0].model;
  camera.covariance = made.scene.network.cameras[0].covariance;
  camera.setting.width_px = camera.model.width_px;
  camera.setting.height_px = camera.model.height_px;
  camera.setting.focal_length_mm = 35;
  made.observations.cameras.push_back(camera);
  for (int e = 0; e < options.num_epochs; ++e) {
    made.observations.poses.push_back(e == 0 ? "home" : fmt::format("p{:02d}", e));
  }
  for (std::size_t p = 0; p < made.scene.network.photos.size(); ++p) {
    const NetworkPhoto& photo = made.scene.network.photos[p];
    CampaignPhotograph photograph;
    photograph.pose = made.observations.poses[static_cast<std::size_t>(photo.epoch)];
    photograph.seen.name = fmt::format("{}/IMG_{:04d}.JPG", photograph.pose, p);
    photograph.seen.sha256 = fmt::format("{:064d}", p);
    photograph.seen.status = PhotographStatus::ok;
    photograph.seen.info.width_px = camera.model.width_px;
    photograph.seen.info.height_px = camera.model.height_px;
    photograph.seen.info.focal_length_mm = 35;
    for (const Observation& seen : photo.observations) photograph.seen.markers.push_back(marker_of(seen));
    made.observations.photographs.push_back(photograph);
  }
  return made;
}

/// True pose of an epoch relative to home.
inline Pose true_pose(const CampaignScene& made, std::size_t epoch) {
  return pose_from_ug_from_lg(made.scene.fixed_from_moving[epoch] * inverse(made.scene.fixed_from_moving[0]) *
                                  ug_from_lg(Pose(), made.campaign.lg->gd_mm),
                              made.campaign.lg->gd_mm);
}

/// Largest position error in mm over the poses that are ok.
inline double worst_error_mm(const CampaignScene& made, const CampaignResult& result) {
  double worst = 0;
  for (std::size_t e = 0; e < result.poses.size(); ++e) {
    if (!result.poses[e].pose) continue;
    worst = std::max(worst, pose_error(*result.poses[e].pose, true_pose(made, e)).head<3>().norm());
  }
  return worst;
}

}  // namespace hexcal
