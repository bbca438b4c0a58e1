#include "tools/campaign/campaign_files.h"

#include <algorithm>

#include "kinematics/geometry/input_error.h"
#include "tools/io/camera_file.h"
#include "tools/io/sheet_file.h"

namespace hexcal {
namespace fs = std::filesystem;
namespace {

std::vector<fs::path> yaml_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (auto entry = fs::recursive_directory_iterator(folder, error);
       !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    const fs::path& path = entry->path();
    const std::string name = path.filename().string();
    if (entry.depth() > 1 || name == "results" || name.starts_with(".")) entry.disable_recursion_pending();
    std::error_code ignored;
    if (entry->is_regular_file(ignored) && path.extension() == ".yaml" && name != "campaign.yaml")
      files.push_back(path);
  }
  std::sort(files.begin(), files.end());
  return files;
}

template <class Reader>
auto read_if_one(const Reader& reader, const fs::path& file) -> std::optional<decltype(reader(file))> {
  try {
    return reader(file);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

}  // namespace

CampaignFiles find_campaign_files(const fs::path& folder, const std::optional<fs::path>& camera,
                                  const std::optional<fs::path>& sheet) {
  CampaignFiles found;
  if (camera) {
    found.camera = read_camera_file(*camera);
    found.camera_file = *camera;
  }
  if (sheet) found.sheets = read_sheet_file(*sheet);
  for (const fs::path& file : yaml_files(folder)) {
    if (auto sheets = read_if_one(read_sheet_file, file)) {
      for (Sheet& each : *sheets) {
        const bool stickers = each.kind == SheetKind::markers;
        if (stickers || !sheet) (stickers ? found.printed_markers : found.sheets).push_back(std::move(each));
      }
    } else if (!camera && (!found.camera || file == folder / "camera.yaml")) {
      if (auto read = read_if_one(read_camera_file, file)) {
        found.camera = std::move(read);
        found.camera_file = file;
      }
    }
  }
  return found;
}

}  // namespace hexcal
