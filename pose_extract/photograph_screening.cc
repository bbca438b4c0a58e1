#include "pose_extract/photograph_screening.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>

namespace hexcal {
namespace {

void screen_camera(const CampaignObservations& observations, const CampaignPhotograph& photograph,
                   MeasuredPhotograph& out) {
  if (photograph.camera < 0) {
    out.status = PhotoStatus::wrong_camera;
    out.words =
        fmt::format("no camera file is for it (serial {})", photograph.seen.info.serial.value_or("unknown"));
    return;
  }
  const CalibratedCamera& camera = observations.cameras[static_cast<std::size_t>(photograph.camera)];
  const PhotographInfo& info = photograph.seen.info;
  if (info.width_px != camera.model.width_px || info.height_px != camera.model.height_px) {
    out.status = PhotoStatus::wrong_camera;
    out.words = fmt::format("{} x {} px, the camera file is for {} x {}", info.width_px, info.height_px,
                            camera.model.width_px, camera.model.height_px);
    return;
  }
  for (const SettingDifference& difference : compare_setting(camera.setting, info)) {
    if (!out.words.empty()) out.words += "; ";
    out.words += difference.words;
    if (difference.fatal) out.status = PhotoStatus::wrong_camera;
  }
}

}  // namespace

std::vector<MeasuredPhotograph> screen_photographs(const Campaign& campaign,
                                                   const CampaignObservations& observations) {
  std::vector<MeasuredPhotograph> out(observations.photographs.size());
  std::vector<std::size_t> order(out.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::string home = campaign.lg ? campaign.lg->home_pose : std::string();
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return (observations.photographs[a].pose == home) > (observations.photographs[b].pose == home);
  });
  std::map<std::string, std::size_t> first_with;
  for (const std::size_t p : order) {
    const CampaignPhotograph& photograph = observations.photographs[p];
    if (photograph.seen.status != PhotographStatus::ok) {
      out[p].status = PhotoStatus::unreadable;
      out[p].words = photograph.seen.reason;
      continue;
    }
    const std::string& hash = photograph.seen.sha256;
    if (!hash.empty()) {
      const auto [first, is_new] = first_with.emplace(hash, p);
      if (!is_new) {
        const CampaignPhotograph& other = observations.photographs[first->second];
        out[p].status = PhotoStatus::duplicate;
        out[p].words = fmt::format("the same photograph as {} of pose {}", other.seen.name, other.pose);
        continue;
      }
    }
    screen_camera(observations, photograph, out[p]);
  }
  return out;
}

}  // namespace hexcal
