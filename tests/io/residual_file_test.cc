#include "tools/io/residual_file.h"

#include <gmock/gmock.h>

#include <fstream>

#include "tests/support/campaign_scene.h"
#include "tests/support/error_matchers.h"
#include "tests/support/temporary_folder.h"

namespace hexcal {
namespace {

TEST(ResidualFile, HoldsEveryMarkerOfEveryPhotographAndReadsBack) {
  CampaignScene made = make_campaign_scene({});
  auto& markers = made.observations.photographs[1].seen.markers;
  MarkerObservation stranger = markers.front();
  stranger.id = 586;
  markers.insert(markers.begin(), stranger);
  const CampaignResult result = extract_poses(made.campaign, made.observations);
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "residuals.csv";
  std::ofstream(path) << format_residuals("# made by a test\n", made.observations, result);
  const auto residuals = read_residuals(path);
  const auto places = sightings_by_id(result);
  for (std::size_t p = 0; p < made.observations.photographs.size(); ++p) {
    const PhotographObservations& photograph = made.observations.photographs[p].seen;
    const std::vector<MarkerResidual>& read = residuals.at(photograph.name);
    ASSERT_EQ(read.size(), photograph.markers.size());
    for (std::size_t m = 0; m < read.size(); ++m) {
      EXPECT_EQ(read[m].id, photograph.markers[m].id);
      const bool known = read[m].id != stranger.id;
      EXPECT_EQ(read[m].status, known ? "used" : "not of this campaign");
      EXPECT_EQ(read[m].placed, known);
      if (!known) continue;
      const std::size_t place = places.at({static_cast<int>(p), read[m].id});
      for (std::size_t c = 0; c < 4; ++c) {
        EXPECT_LT((read[m].corners_px[c] - photograph.markers[m].corners_px[c]).norm(), 1e-3);
        const Eigen::Vector2d residual =
            result.adjusted.residuals_px[place].segment<2>(2 * static_cast<Eigen::Index>(c));
        EXPECT_LT((read[m].residuals_px[c] - residual).norm(), 1e-5);
      }
    }
  }
}

TEST(ResidualFile, SaysOfEachMarkerWhatBecameOfIt) {
  MarkerObservation seen;
  seen.status = MarkerStatus::cut_by_frame;
  EXPECT_EQ(sighting_words(nullptr, seen), marker_status_name(seen.status));
  const std::vector<std::pair<SightingStatus, std::string>> words{
      {SightingStatus::used, "used"},
      {SightingStatus::not_measured, marker_status_name(seen.status)},
      {SightingStatus::unknown_id, "not of this campaign"},
      {SightingStatus::repeated_id, "id twice"},
      {SightingStatus::seen_once, "seen once"},
      {SightingStatus::unoriented, "not connected"},
      {SightingStatus::outlier, "contradicts the rest"}};
  for (const auto& [status, wanted] : words) {
    Sighting sighting;
    sighting.status = status;
    EXPECT_EQ(sighting_words(&sighting, seen), wanted);
  }
}

TEST(ResidualFile, AWordInANumberColumnIsRefused) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "residuals.csv";
  std::ofstream(path) << "photo,id,status,x0_px\na,one,used,1\n";
  EXPECT_THAT([&] { (void)read_residuals(path); }, ThrowsInputError("column 'id'"));
}

}  // namespace
}  // namespace hexcal
