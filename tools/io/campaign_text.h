#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pose_extract/campaign.h"

namespace hexcal {

/// What a new campaign.yaml says; paths as they are to stand in it.
struct CampaignDraft {
  std::string camera = "camera.yaml";
  bool hexapod = false, targets = false, legs = false;  ///< hexapod.yaml, targets.csv, legs.csv are there
  std::string images = "poses";
  bool images_table = false;  ///< images.csv says which photograph shows which pose
  std::string family;
  MarkerSizes fixed, moving;              ///< moving empty: a plain photogrammetry project
  std::string division;                   ///< how they were told apart: a comment
  bool nominal = false;                   ///< UG from markers_nominal.csv, else from the markers themselves
  std::optional<Rigid3> markers_from_UG;  ///< of UG from the markers, where the targets tell
  std::string home;
  double gd_mm = 0;
};

/// The text of a campaign.yaml with a comment on each line, for people to edit; read_campaign reads it.
/// `head` is the provenance line.
[[nodiscard]] std::string campaign_text(const std::string& head, const CampaignDraft& draft);

/// `UG: {from: markers, ...}` as it stands in a campaign.yaml.
[[nodiscard]] std::string markers_frame_text(const std::optional<Rigid3>& markers_from_UG);

/// "0-9, 12" of ids in ascending order.
[[nodiscard]] std::string id_ranges_text(const std::vector<int>& ids);

}  // namespace hexcal
