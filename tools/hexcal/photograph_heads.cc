#include "tools/hexcal/photograph_heads.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>

#include "photogrammetry/photograph/photograph_format.h"
#include "photogrammetry/photograph/sha256.h"
#include "tools/io/atomic_file.h"

namespace hexcal {
namespace fs = std::filesystem;
namespace {

// Of a RAW file the head tells the size of the sensor or of a preview, not of what is developed from it.
bool head_tells_size(const fs::path& path) { return !is_raw(photograph_format(path)); }

class HeadInspector {
 public:
  explicit HeadInspector(const OpenCampaign& open) : open_(open) {}

  std::vector<HeadFinding> inspect() {
    for (std::size_t i = 0; i < open_.listing.images.size(); ++i) inspect(i);
    return std::move(findings_);
  }

 private:
  void bad(std::size_t image, const std::string& words) { findings_.push_back({image, true, words}); }

  void inspect(std::size_t i) {
    const CampaignImage& image = open_.listing.images[i];
    std::error_code error;
    if (!fs::exists(image.path, error)) return bad(i, "no such file");
    if (!fs::is_regular_file(image.path, error)) return bad(i, "is no file");
    if (fs::file_size(image.path, error) == 0) return bad(i, "is empty");
    const PhotographInfo info = read_photograph_info(image.path);
    if (info.width_px == 0) return bad(i, "is no photograph that can be read");
    const auto [first, is_new] = first_with_.emplace(sha256_hex(read_file(image.path)), image.name);
    if (!is_new) return bad(i, fmt::format("is the same photograph as {}", first->second));
    const int camera_index = open_.camera_of_image[i];
    if (camera_index < 0) {
      return bad(i, fmt::format("no camera file is for it (serial {})", info.serial.value_or("unknown")));
    }
    const CalibratedCamera& camera = open_.cameras[static_cast<std::size_t>(camera_index)];
    if (head_tells_size(image.path) &&
        (info.width_px != camera.model.width_px || info.height_px != camera.model.height_px)) {
      return bad(i, fmt::format("{} x {} px, the camera file is for {} x {}", info.width_px, info.height_px,
                                camera.model.width_px, camera.model.height_px));
    }
    for (const SettingDifference& difference : compare_setting(camera.setting, info))
      findings_.push_back({i, difference.fatal, difference.words});
  }

  const OpenCampaign& open_;
  std::map<std::string, std::string> first_with_;
  std::vector<HeadFinding> findings_;
};

}  // namespace

std::vector<HeadFinding> inspect_heads(const OpenCampaign& open) { return HeadInspector(open).inspect(); }

}  // namespace hexcal
