#pragma once

#include <string>

#include "tests/report/sample_campaign.h"
#include "tests/report/sample_charts.h"
#include "tools/report/campaign_report.h"

namespace hexcal {

inline NetworkPart sample_network() {
  NetworkPart network;
  network.sigma0 = 1.1;
  network.rms_px = 0.01;
  network.redundancy = 120;
  network.datums = {{"UG", "40 points fit"}, {"LG", "defined by the home pose"}};
  network.lengths = {{"check 0 to 5", 182.41, 0.004, 182.405}, {"bar 1 to 2", {}, 0, 100}};
  network.scene = sample_scene();
  PhotographPart photograph;
  photograph.pose_id = "pose_1";
  photograph.name = "pose_1/DSC_<1>.jpg";
  photograph.status = "ok";
  photograph.markers = 2;
  photograph.rms_px = 0.01;
  photograph.size_px = {1504, 1000};
  photograph.thumbnail_jpeg = "\xFF\xD8\xFF and no more";
  for (int m = 0; m < 3; ++m) {
    const Eigen::Vector2d corner(300.0 + 250 * m, 400);
    const std::array<Eigen::Vector2d, 4> corners{corner, corner + Eigen::Vector2d(100, 0),
                                                 corner + Eigen::Vector2d(100, 100),
                                                 corner + Eigen::Vector2d(0, 100)};
    const bool used = m != 2;
    photograph.outlines.push_back({101 + m, corners, used, used ? "" : "contradicts the rest"});
    for (int c = 0; c < 4; ++c)
      photograph.residuals.push_back(
          {corners[static_cast<std::size_t>(c)], {0.01 * (c - 1), 0.006 * m}, used});
  }
  photograph.rejected = 1;
  photograph.remarks = "1 marker left out";
  network.photographs.push_back(photograph);
  PhotographPart dark;
  dark.pose_id = "pose_3";
  dark.name = "pose_3/DSC_2.jpg";
  dark.status = "no_markers: the room was dark";
  dark.size_px = photograph.size_px;
  network.photographs.push_back(dark);
  PhotographPart clean = photograph;
  clean.name = "pose_1/DSC_3.jpg";
  clean.rejected = 0;
  clean.remarks.clear();
  clean.outlines.pop_back();
  clean.residuals.resize(8);
  network.photographs.push_back(clean);
  return network;
}

/// A campaign with a pose that failed, a weak one, two photographs with faults and names that would break
/// careless markup.
inline const CampaignReport& sample_report() {
  static const CampaignReport report = [] {
    SampleCampaign campaign = sample_campaign(10);
    campaign.measured[2].pose.reset();
    campaign.measured[2].sigma.reset();
    campaign.measured[2].status = "no <markers> & no light";
    *campaign.measured[5].sigma *= 5;
    campaign.measured[5].remarks = "sigma 5 times the campaign's median";
    CampaignReport out;
    out.name = "<Tiger> & Co";
    out.verdict = {Light::warning, "Nearly all went well.", {"Marker 103 moved."}, {"Look at it."}};
    out.poses = campaign.measured;
    out.targets = campaign.targets;
    CompensationPart part;
    part.nominal = sample_hexapod();
    for (std::size_t i = 0; i < campaign.measured.size(); ++i) {
      if (!campaign.measured[i].pose) continue;
      PoseObservation observation;
      observation.id = campaign.targets[i].id;
      observation.target = campaign.targets[i].pose;
      observation.measured = *campaign.measured[i].pose;
      observation.covariance = campaign.measured[i].sigma->cwiseAbs2().asDiagonal();
      observation.readings = readings_from_lengths(
          part.nominal, leg_lengths(part.nominal, part.nominal.B_from_P(*observation.target)));
      part.observations.poses.push_back(observation);
    }
    CalibrateOptions options;
    options.method = "option3";
    options.comparison.leave_one_out_up_to = 0;
    options.comparison.folds = 2;
    part.calibration = calibrate(part.nominal, part.observations, options);
    out.compensation = part;
    out.network = sample_network();
    out.provenance = {{"program", "hexcal"}};
    return out;
  }();
  return report;
}

}  // namespace hexcal
