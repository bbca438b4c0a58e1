#include "pose_extract/marker_groups.h"

#include <gmock/gmock.h>

#include <numeric>

#include "tests/support/campaign_scene.h"

namespace hexcal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<int> range(int first, int count) {
  std::vector<int> ids(static_cast<std::size_t>(count));
  std::iota(ids.begin(), ids.end(), first);
  return ids;
}

class MarkerGroupsTest : public ::testing::Test {
 protected:
  void make(int epochs, double noise_px, unsigned seed = 1, int stations = 3) {
    ObservationSceneOptions options;
    options.num_epochs = epochs;
    options.noise_px = noise_px;
    options.seed = seed;
    options.stations = stations;
    made_ = make_campaign_scene(options);
    sizes_ = made_.campaign.fixed;
    sizes_.insert(made_.campaign.moving.begin(), made_.campaign.moving.end());
  }
  [[nodiscard]] std::vector<StillScene> scenes() const {
    std::map<std::string, std::vector<std::size_t>> photographs;
    for (std::size_t p = 0; p < made_.observations.photographs.size(); ++p)
      photographs[made_.observations.photographs[p].pose].push_back(p);
    std::vector<StillScene> all;
    for (const auto& [pose, indices] : photographs)
      all.push_back(measure_still_scene(made_.observations, indices, sizes_));
    return all;
  }
  [[nodiscard]] std::vector<std::size_t> order() const {
    std::vector<std::size_t> all(made_.observations.photographs.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    return all;
  }
  CampaignScene made_;
  MarkerSizes sizes_;
};

TEST_F(MarkerGroupsTest, TwoGripsAreToldApartWhateverTheNoise) {
  for (const double noise_px : {0.005, 0.1, 0.3}) {
    make(5, noise_px);
    const MarkerGroups found = group_markers(scenes(), sizes_);
    EXPECT_THAT(found.doubt, IsEmpty())
        << noise_px << ": " << found.largest_inside << " " << found.least_between;
    EXPECT_THAT(found.groups, ElementsAre(range(0, 10), range(100, 10))) << noise_px;
    EXPECT_EQ(found.poses, 5);
  }
  EXPECT_EQ(stands_above(made_.observations, range(0, 10), range(100, 10)), true);
  EXPECT_EQ(stands_above(made_.observations, range(100, 10), range(0, 10)), false);
}

TEST_F(MarkerGroupsTest, AMarkerThatMovesAloneIsInNoGripsGroup) {
  make(4, 0.02);
  // In p02 sticker 4 was glued anew, where 3 had been.
  for (CampaignPhotograph& photograph : made_.observations.photographs) {
    if (photograph.pose != "p02") continue;
    for (MarkerObservation& marker : photograph.seen.markers)
      if (marker.id == 3) marker.id = 777;
    std::erase_if(photograph.seen.markers, [](const auto& marker) { return marker.id == 4; });
    for (MarkerObservation& marker : photograph.seen.markers)
      if (marker.id == 777) marker.id = 4;
  }
  const MarkerGroups found = group_markers(scenes(), sizes_);
  ASSERT_EQ(found.groups.size(), 3U);
  EXPECT_THAT(found.groups[2], ElementsAre(4));
  EXPECT_THAT(found.doubt, IsEmpty());
}

TEST_F(MarkerGroupsTest, WhatCannotBeToldIsSaid) {
  make(1, 0.02);
  EXPECT_THAT(group_markers(scenes(), sizes_).doubt, HasSubstr("only one pose"));
  make(3, 0.02, 1, 1);
  EXPECT_THAT(group_markers(scenes(), sizes_).doubt,
              HasSubstr("no pose shows its markers in two photographs"));
  // The fixed grip alone: a plate, nothing moves.
  make(3, 0.05);
  sizes_ = made_.campaign.fixed;
  const MarkerGroups found = group_markers(scenes(), sizes_);
  EXPECT_THAT(found.doubt, HasSubstr("do not move against each other"));
  EXPECT_THAT(found.groups, ElementsAre(range(0, 10)));
}

TEST_F(MarkerGroupsTest, AHeapIsSplitWhereSomethingMoved) {
  for (const double noise_px : {0.01, 0.2}) {
    make(5, noise_px, 3);
    const auto runs = split_into_poses(made_.observations, order(), sizes_);
    ASSERT_EQ(runs.size(), 5U) << noise_px;
    for (std::size_t r = 0; r < 5; ++r) EXPECT_THAT(runs[r], ElementsAre(3 * r, 3 * r + 1, 3 * r + 2));
  }
}

TEST_F(MarkerGroupsTest, APhotographOfAnotherPoseContradictsItsScene) {
  make(3, 0.02);
  const StillScene mixed = measure_still_scene(made_.observations, {0, 1, 2, 4}, sizes_);
  EXPECT_THAT(mixed.contradicting, ElementsAre(4));
  EXPECT_THAT(measure_still_scene(made_.observations, {0, 1, 2}, sizes_).contradicting, IsEmpty());
}

}  // namespace
}  // namespace hexcal
