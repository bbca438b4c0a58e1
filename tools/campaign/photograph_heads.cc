#include "tools/campaign/photograph_heads.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "photogrammetry/photograph/photograph_file.h"
#include "photogrammetry/photograph/photograph_format.h"
#include "tools/campaign/measure_campaign.h"

namespace hexcal {
namespace {

// Of a RAW file the head tells the size of the sensor or of a preview, not of what is developed from it.
bool head_tells_size(const std::filesystem::path& path) { return !is_raw(photograph_format(path)); }

class HeadInspector {
 public:
  explicit HeadInspector(const OpenCampaign& open) : open_(open) {}

  HeadInspection inspect() {
    heads_.camera_of_image.assign(open_.listing.images.size(), -1);
    for (std::size_t i = 0; i < open_.listing.images.size(); ++i) inspect(i);
    return std::move(heads_);
  }

 private:
  void bad(std::size_t image, const std::string& words) {
    heads_.findings.push_back({image, true, false, words});
  }
  void foreign(std::size_t image, const std::string& words) {
    heads_.findings.push_back({image, true, true, words});
  }

  void inspect(std::size_t i) {
    const CampaignImage& image = open_.listing.images[i];
    const PhotographFile file = read_photograph_file(image.path);
    if (file.status == PhotographStatus::empty) return bad(i, "is empty");
    if (file.status != PhotographStatus::ok) return bad(i, file.reason);
    const PhotographInfo info = photograph_info(file);
    if (info.width_px == 0) return bad(i, "is no photograph that can be read");
    const auto [first, is_new] = first_with_.emplace(file.sha256, image.name);
    if (!is_new) return bad(i, fmt::format("is the same photograph as {}", first->second));
    const int camera_index = camera_for(open_, image.folder, info);
    heads_.camera_of_image[i] = camera_index;
    if (camera_index < 0) {
      return foreign(i, fmt::format("no camera file is for it (serial {})", info.serial.value_or("unknown")));
    }
    const CalibratedCamera& camera = open_.cameras[static_cast<std::size_t>(camera_index)];
    if (head_tells_size(image.path) &&
        (info.width_px != camera.model.width_px || info.height_px != camera.model.height_px)) {
      return foreign(i, fmt::format("{} x {} px, the camera file is for {} x {}", info.width_px,
                                    info.height_px, camera.model.width_px, camera.model.height_px));
    }
    if (camera.setting.focal_length_mm && !info.focal_length_mm)
      heads_.findings.push_back(
          {i, false, false, "its EXIF states no focal length: the zoom setting is not checked"});
    for (const SettingDifference& difference : compare_setting(camera.setting, info))
      heads_.findings.push_back({i, difference.fatal, difference.fatal, difference.words});
  }

  const OpenCampaign& open_;
  std::map<std::string, std::string> first_with_;
  HeadInspection heads_;
};

}  // namespace

HeadInspection inspect_heads(const OpenCampaign& open) { return HeadInspector(open).inspect(); }

void refuse_foreign_camera(const OpenCampaign& open, const HeadInspection& heads) {
  std::set<std::size_t> foreign;
  for (const HeadFinding& finding : heads.findings) {
    if (finding.foreign) foreign.insert(finding.image);
  }
  if (foreign.empty() || foreign.size() < open.listing.images.size()) return;
  const auto first = std::ranges::find_if(heads.findings, &HeadFinding::foreign);
  throw UnsuitedCamera(fmt::format("{}: none of the {} photographs suits a camera file; {}: {}",
                                   open.campaign.file.string(), foreign.size(),
                                   open.listing.images[first->image].name, first->words));
}

}  // namespace hexcal
