#include <algorithm>
#include <map>

#include "pose_extract/extract_poses.h"
#include "pose_extract/marker_slips.h"

namespace hexcal {
namespace {

// Of a body's markers may have slipped for the others to be trusted.
constexpr double kMostSlipped = 1.0 / 3;

// The marker's sightings on the side that is not kept, as not measured.
void leave_out_side(const std::vector<std::size_t>& epochs, const MarkerSlip& slip, Network& network) {
  const int id = network.features[static_cast<std::size_t>(slip.feature)].id;
  const auto step = std::find(epochs.begin(), epochs.end(), slip.before) + 1;
  const auto first = slip.after_is_kept ? epochs.begin() : step;
  const auto last = slip.after_is_kept ? step : epochs.end();
  for (NetworkPhoto& photo : network.photos) {
    if (std::find(first, last, static_cast<std::size_t>(photo.epoch)) == last) continue;
    for (Observation& seen : photo.observations) {
      if (seen.id == id) seen.measured = false;
    }
  }
}

}  // namespace

std::vector<MarkerSlip> leave_out_slipped_markers(const std::vector<std::size_t>& epochs,
                                                  const std::function<AdjustmentResult()>& adjust,
                                                  Network& network, AdjustmentResult& adjusted) {
  std::vector<MarkerSlip> slips;
  if (adjusted.status == AdjustmentStatus::nothing_connected) return slips;
  std::map<int, int> slipped;
  while (auto slip = find_marker_slip(network, adjusted, epochs)) {
    const int body = network.features[static_cast<std::size_t>(slip->feature)].body;
    int markers = 0;
    for (std::size_t f = 0; f < network.features.size(); ++f)
      markers += network.features[f].body == body && adjusted.geometry.has_feature[f] ? 1 : 0;
    slip->many = ++slipped[body] > kMostSlipped * markers;
    slips.push_back(*slip);
    if (slip->many) break;
    leave_out_side(epochs, *slip, network);
    adjusted = adjust();
    if (adjusted.status == AdjustmentStatus::nothing_connected) break;
  }
  return slips;
}

std::vector<std::size_t> photographing_order(const CampaignObservations& observations) {
  std::vector<std::size_t> order(observations.poses.size());
  std::vector<std::string> first(observations.poses.size());
  for (std::size_t e = 0; e < order.size(); ++e) order[e] = e;
  for (const CampaignPhotograph& photograph : observations.photographs) {
    const auto& time = photograph.seen.info.capture_time;
    if (!time) return order;
    const auto e = static_cast<std::size_t>(
        std::find(observations.poses.begin(), observations.poses.end(), photograph.pose) -
        observations.poses.begin());
    if (e < first.size() && (first[e].empty() || *time < first[e])) first[e] = *time;
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return first[a] < first[b]; });
  return order;
}

}  // namespace hexcal
