#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "camera_calib/sheet.h"
#include "photogrammetry/markers/detect.h"
#include "pose_extract/image_folders.h"

// What lies in a folder before a campaign.yaml says what it should be: photographs, each read once and not
// measured.

namespace hexcal {

/// Told how far a survey is: words and a count, then once per photograph, from any thread.
class SurveyObserver {
 public:
  virtual ~SurveyObserver() = default;
  virtual void begin(const std::string& words, std::size_t count) { (void)words, (void)count; }
  virtual void advance() {}
};

struct SurveyedPhotograph {
  CampaignImage image;  ///< name relative to the folder; pose is its own folder's name
  PhotographInfo info;
  std::string fault;  ///< why it cannot be read; empty if it can
  bool of_sheet = false;
  std::vector<MarkerObservation> markers;  ///< of the family that was chosen; not measured
};

struct PhotographSurvey {
  std::vector<SurveyedPhotograph> photographs;  ///< in natural order of folders and names
  std::vector<SkippedFile> skipped;
  std::vector<std::string> poses;  ///< the folders' names, also of those without photographs
  std::string family;              ///< of the markers on the grips; empty: no markers were read
};

/// Reads all photographs below `folder`. A photograph is one of a sheet if nearly all its markers lie where
/// `sheets` have them, or if it shows no marker and a sheet is without. The family is `family`, or else the
/// one of which most markers were read twice in the photographs that show no sheet.
[[nodiscard]] PhotographSurvey survey_photographs(const std::filesystem::path& folder,
                                                  const std::vector<Sheet>& sheets, const std::string& family,
                                                  SurveyObserver& observer);

/// True if the markers lie as on the sheet (as seen by any camera without much distortion), at least four.
[[nodiscard]] bool shows_sheet(const std::vector<MarkerObservation>& markers, const Sheet& sheet);

}  // namespace hexcal
