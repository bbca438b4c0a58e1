#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/calibrate.h"
#include "camera_calib/calibrated_camera.h"
#include "tools/io/pose_table.h"
#include "tools/report/html_page.h"
#include "tools/report/paper_figures.h"
#include "tools/report/scene.h"

namespace hexcal {

/// The calibration of a campaign with what it was made from.
struct CompensationPart {
  PlatformGeometry nominal;
  ObservationSet observations;
  CalibrationReport calibration;
};

/// A marker found in a photograph.
struct MarkerOutline {
  int id = -1;
  std::array<Eigen::Vector2d, 4> corners_px;
  bool used = true;   ///< by the adjustment
  std::string words;  ///< why not used
};

struct CornerResidual {
  Eigen::Vector2d at_px, by_px;  ///< observed place; observed minus projected
  bool used = true;
};

/// What a photograph contributed.
struct PhotographPart {
  std::string pose_id;
  std::string name;
  std::string status;   ///< "ok", or why it was not used
  std::string remarks;  ///< what should be known of a photograph that is ok
  int markers = 0;
  int rejected = 0;
  double rms_px = 0;
  std::vector<CornerResidual> residuals;
  std::vector<MarkerOutline> outlines;
  Eigen::Vector2d size_px = Eigen::Vector2d::Zero();
  std::string thumbnail_jpeg;  ///< bytes of a small JPEG; empty: only the drawing is shown
};

/// A known distance between two markers, measured.
struct LengthPart {
  std::string name;
  std::optional<double> measured_mm;
  double sigma_mm = 0;  ///< of the measured length
  double stated_mm = 0;
};

/// The photogrammetric network.
struct NetworkPart {
  double sigma0 = 0;
  double rms_px = 0;
  double redundancy = 0;                                    ///< observations beyond those needed
  std::vector<std::pair<std::string, std::string>> datums;  ///< frame and how it was found
  std::vector<LengthPart> lengths;
  std::vector<PhotographPart> photographs;
  Scene3d scene;
};

struct CameraPart {
  std::string file;
  CalibratedCamera camera;
};

/// Everything that a campaign's report shows; parts that are not there leave their section out, with a
/// sentence of what would make them.
struct CampaignReport {
  std::string name;
  Verdict verdict;                  ///< decided elsewhere, shown first
  std::vector<PoseRecord> poses;    ///< results/poses.csv
  std::vector<PoseRecord> targets;  ///< targets.csv
  std::optional<CompensationPart> compensation;
  std::string no_compensation;      ///< why there is none
  std::vector<LegRecord> commands;  ///< results/actuators.csv
  std::optional<NetworkPart> network;
  std::string no_network;
  std::vector<CameraPart> cameras;
  std::vector<std::pair<std::string, std::string>> provenance;  ///< term and value
};

/// Traffic light of one measured pose, and the words of its row (empty when good).
struct PoseLight {
  Light light = Light::none;
  std::string words;
};
[[nodiscard]] PoseLight pose_light(const PoseRecord& record);

/// The paper's data from a campaign: targets against measured poses, cross-validated errors of each method
/// over the poses that it keeps in the workspace.
[[nodiscard]] PaperData paper_data(const CampaignReport& report);

[[nodiscard]] HtmlPage campaign_page(const CampaignReport& report);
/// Every figure of the page, for a paper.
[[nodiscard]] std::vector<Chart> campaign_charts(const CampaignReport& report);

}  // namespace hexcal
