#include "pose_extract/photograph_screening.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>

namespace hexcal {
namespace {

// Of what two photographs differ by if each has noise of its own; copies, saved again, differ by far less.
constexpr double kCopyShare = 0.25;
constexpr std::size_t kFewestShared = 3;  // markers

// Do both show the same markers at the same places, `turned` by 180 deg or not, nearer than noise can be?
bool shows_the_same(const PhotographObservations& a, const PhotographObservations& b, bool turned) {
  if (a.info.width_px != b.info.width_px || a.info.height_px != b.info.height_px) return false;
  std::map<int, const MarkerObservation*> in_b;
  for (const MarkerObservation& marker : b.markers) {
    if (marker.status == MarkerStatus::ok) in_b[marker.id] = &marker;
  }
  double squares = 0;
  double expected = 0;
  std::size_t shared = 0;
  std::size_t of_a = 0;
  for (const MarkerObservation& marker : a.markers) {
    if (marker.status != MarkerStatus::ok) continue;
    ++of_a;
    const auto other = in_b.find(marker.id);
    if (other == in_b.end()) continue;
    ++shared;
    for (std::size_t c = 0; c < 4; ++c) {
      Eigen::Vector2d at = other->second->corners_px[c];
      if (turned) at = Eigen::Vector2d(b.info.width_px - 1, b.info.height_px - 1) - at;
      squares += (marker.corners_px[c] - at).squaredNorm();
    }
    expected += marker.covariance_px2.trace() + other->second->covariance_px2.trace();
    if (squares > kCopyShare * expected + 1) return false;
  }
  return shared >= kFewestShared && 2 * shared > of_a && squares < kCopyShare * expected;
}

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
  std::vector<std::size_t> counted;
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
    for (const std::size_t earlier : counted) {
      const CampaignPhotograph& other = observations.photographs[earlier];
      const bool turned = shows_the_same(other.seen, photograph.seen, true);
      if (!turned && !shows_the_same(other.seen, photograph.seen, false)) continue;
      out[p].status = PhotoStatus::duplicate;
      out[p].words = fmt::format("a copy of {} of pose {}{}", other.seen.name, other.pose,
                                 turned ? ", turned by 180 deg" : ", saved again");
      break;
    }
    if (out[p].status == PhotoStatus::duplicate) continue;
    counted.push_back(p);
    screen_camera(observations, photograph, out[p]);
  }
  return out;
}

}  // namespace hexcal
