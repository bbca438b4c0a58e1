#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "pose_extract/extract_poses.h"

// Before a campaign is described: what of it can be told from its photographs alone. Which photographs were
// taken while nothing moved, and which markers keep their places relative to each other from pose to pose.
// Nothing is assumed of the markers but their sizes; a camera is needed.

namespace hexcal {

/// What photographs of one pose show when every marker is taken to stand still.
struct StillScene {
  std::vector<std::size_t> photographs;    ///< indices into CampaignObservations::photographs
  std::vector<std::size_t> contradicting;  ///< those of them that show another arrangement of the markers
  Network network;                         ///< all markers on the reference body
  AdjustmentResult adjusted;
  [[nodiscard]] bool measured() const { return adjusted.errors != nullptr; }
};

/// One rigid adjustment of these photographs with all their markers of which `sizes` has an edge (mm).
[[nodiscard]] StillScene measure_still_scene(const CampaignObservations& observations,
                                             const std::vector<std::size_t>& photographs,
                                             const MarkerSizes& sizes);

/// Splits photographs, in the order in which they were taken, wherever a marker moved against another: each
/// run is a pose. Photographs with fewer than three markers in common with their neighbours stand alone.
[[nodiscard]] std::vector<std::vector<std::size_t>> split_into_poses(const CampaignObservations& observations,
                                                                     const std::vector<std::size_t>& order,
                                                                     const MarkerSizes& sizes);

struct MarkerGroups {
  /// Ids that keep their places relative to each other, the largest group first. Between any two groups
  /// something moved.
  std::vector<std::vector<int>> groups;
  std::vector<int> unseen;  ///< ids that no two poses show well enough to compare
  int poses = 0;            ///< compared
  /// Chance-normalised changes of distances (1 is noise): the largest inside a group, the least between the
  /// two largest groups.
  double largest_inside = 0, least_between = 0;
  std::string doubt;  ///< why the groups cannot be told; empty if they can
};

/// Compares the distances between the corners of every two markers over the scenes (one per pose), each
/// change against its standard deviation, and joins markers whose distances do not change. Distances need no
/// frame.
[[nodiscard]] MarkerGroups group_markers(const std::vector<StillScene>& scenes, const MarkerSizes& sizes);

/// True if the markers of `a` stand above those of `b` in most photographs, false if below, nothing if the
/// photographs do not agree. Above is the direction in which the markers' own upper edges point.
[[nodiscard]] std::optional<bool> stands_above(const CampaignObservations& observations,
                                               const std::vector<int>& a, const std::vector<int>& b);

}  // namespace hexcal
