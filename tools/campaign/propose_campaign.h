#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pose_extract/campaign.h"
#include "tools/campaign/survey_photographs.h"

// From a folder of photographs to what its campaign.yaml should say: `hexcal init`.

namespace hexcal {

struct ProposalRequest {
  std::filesystem::path folder;
  std::string family;                                  ///< empty: found in the photographs
  std::vector<int> fixed, moving;                      ///< ids; both empty: told from what moves
  double marker_mm = 0;                                ///< edge of the markers on the grips; 0: not known yet
  MarkerSizes sizes;                                   ///< of single ids that differ from it
  std::string home;                                    ///< pose; empty: proposed
  std::optional<std::filesystem::path> camera, sheet;  ///< files; without, those in the folder
  int threads = 0;                                     ///< 0: all
};

/// A camera file that was made on the way.
struct NewCamera {
  std::vector<std::pair<std::string, std::string>> files;  ///< name relative to the folder, text
  std::string verdict;                                     ///< one line
};

struct CampaignProposal {
  int photographs = 0;        ///< of poses
  int sheet_photographs = 0;  ///< of the camera's sheet
  std::string family;
  std::vector<int> fixed, moving;
  std::string division;          ///< how fixed and moving were told apart, in words
  bool division_sure = false;    ///< false: somebody should look at it
  double marker_mm = 0;          ///< told, or printed by a markers.yaml in the folder; 0: must be asked
  MarkerSizes sizes;             ///< of ids that differ from it
  std::string images = "poses";  ///< as campaign.yaml has it
  std::vector<std::pair<std::string, std::string>> table;  ///< file, pose; empty: folders are poses
  std::vector<std::string> poses;
  std::string home;
  bool home_sure = false;
  double gd_edges = 0;  ///< moving to fixed markers at home, in edges of a marker; 0: not measured
  std::string camera = "camera.yaml";  ///< as campaign.yaml has it
  bool camera_there = false;           ///< the file exists or is in new_camera
  std::optional<NewCamera> new_camera;
  std::vector<Sheet> sheets;         ///< for the camera, found in the folder
  std::vector<std::string> remarks;  ///< photographs and markers that belong to nothing, and why
};

/// Looks at everything in the folder; writes nothing but the cache of measured photographs. Throws InputError
/// if the folder holds photographs and none shows a marker.
[[nodiscard]] CampaignProposal propose_campaign(const ProposalRequest& request, SurveyObserver& observer);

}  // namespace hexcal
