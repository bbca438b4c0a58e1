#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/faults/fault_campaign.h"
#include "tests/faults/image_variants.h"
#include "tools/io/camera_file.h"
#include "tools/synthetic/stations.h"

// Faults of what was photographed: markers, grips, stations, lens, and which pose it was.

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::AnyOf;
using ::testing::HasSubstr;

class FaultyScene : public ::testing::Test {
 protected:
  // Photographs pose p002 again after `edit`.
  template <class Edit>
  void photograph_again(const Edit& edit) const {
    const std::vector<fs::path> photographs = lab_.photographs("p002");
    const std::vector<Shot> shots = CleanCampaign::instance().shots("p002");
    for (std::size_t i = 0; i < shots.size(); ++i) {
      Shot shot = shots[i];
      edit(shot, i);
      lab_.put(photographs[i], shot);
    }
  }
  // A board right before the camera-side of the rig between two heights of UG.
  static Surface board(double z_low_mm, double z_high_mm) {
    Eigen::Matrix3d facing;  // normal along +x, y up
    facing << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    Surface surface;
    surface.world_from_surface = {facing, {110, 0, 0.5 * (z_low_mm + z_high_mm)}};
    surface.outline_mm = rectangle_outline(400, 0.5 * (z_high_mm - z_low_mm));
    surface.albedo = 0.3F;
    return surface;
  }
  FaultCampaign lab_;
};

TEST_F(FaultyScene, AFixedMarkerThatMovedIsNamedAndLeftOut) {
  photograph_again([](Shot& shot, std::size_t) {
    for (int id = 0; id < 10; id += 7)
      shot.moved_stickers.push_back({id, Rigid3::from_translation({1.0, -0.7, 0})});
  });
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kAllPoses);
  EXPECT_THAT(outcome.out, AnyOf(HasSubstr("marker 0 stands elsewhere in pose p002"),
                                 HasSubstr("marker 7 stands elsewhere in pose p002")));
}

TEST_F(FaultyScene, AMovingMarkerThatCameOffIsNamedAndLeftOut) {
  photograph_again([](Shot& shot, std::size_t) {
    shot.moved_stickers.push_back({102, Rigid3::from_translation({0.8, 0.8, 0})});
  });
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kAllPoses);
  EXPECT_THAT(outcome.out, HasSubstr("marker 102 stands elsewhere in pose p002"));
}

TEST_F(FaultyScene, TheMovingGripHidden) {
  photograph_again([](Shot& shot, std::size_t) { shot.obstacles.push_back(board(-300, -28)); });
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kButP002);
  FaultCampaign::expect_refused(outcome, "p002", "no_moving_markers");
}

TEST_F(FaultyScene, TheFixedGripHidden) {
  photograph_again([](Shot& shot, std::size_t) { shot.obstacles.push_back(board(-10, 300)); });
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kButP002);
  FaultCampaign::expect_refused(outcome, "p002", "disconnected");
}

TEST_F(FaultyScene, AMarkerSeenOnceIsNamed) {
  lab_.replace("campaign.yaml", "fixed:  {ids: [0-9], size_mm: 24}", "fixed:  {ids: [0-9, 77], size_mm: 24}");
  // Marker 77 on a card beside the rig, in one photograph of p002.
  Shot shot = CleanCampaign::instance().shots("p002")[1];
  Sticker card;
  card.id = 77;
  card.size_mm = 24;
  Eigen::Matrix3d facing;
  facing << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  card.body_from_marker = {facing, {40, 130, 20}};
  shot.obstacles.push_back(sticker_surface("tag36h11", card));
  lab_.put(lab_.photographs("p002")[1], shot);
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kAllPoses);
  EXPECT_THAT(outcome.out, HasSubstr("seen in one photograph only and not used: marker 77"));
}

TEST_F(FaultyScene, AGripThatWasBumpedBetweenTwoPhotographs) {
  photograph_again([](Shot& shot, std::size_t i) {
    if (i == 2) shot.UG_from_LG = shot.UG_from_LG * Rigid3::from_translation({0.6, 0.4, -0.5});
  });
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kButP002);
  // Two of three agree, but which are right nobody knows: never a silent mean, never ok.
  EXPECT_THAT(outcome.pose("p002").status, HasSubstr("contradict"));
}

TEST_F(FaultyScene, PhotographsSwappedBetweenTwoPoses) {
  const fs::path a = lab_.photographs("p002")[1];
  const fs::path b = lab_.photographs("p003")[1];
  const fs::path aside = lab_.folder() / "aside.jpg";
  fs::rename(a, aside);
  fs::rename(b, a);
  fs::rename(aside, b);
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, {"home", "p001"});
  for (const char* pose : {"p002", "p003"}) {
    FaultCampaign::expect_healthy(outcome, {pose});
    EXPECT_THAT(outcome.pose(pose).remarks, HasSubstr("left out"));
  }
  EXPECT_THAT(outcome.out, HasSubstr("shows pose p003, not p002: move it to the folder of p003"));
  EXPECT_THAT(outcome.out, HasSubstr("shows pose p002, not p003: move it to the folder of p002"));
}

TEST_F(FaultyScene, TwoPoseFoldersSwappedIsSaidWhenTheTargetsAreKnown) {
  const fs::path aside = lab_.poses() / "aside";
  fs::rename(lab_.poses() / "p002", aside);
  fs::rename(lab_.poses() / "p003", lab_.poses() / "p002");
  fs::rename(aside, lab_.poses() / "p003");
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, {"home", "p001"});
  EXPECT_THAT(outcome.out, HasSubstr("p002 and p003 look swapped"));
  EXPECT_THAT(outcome.pose("p002").status, HasSubstr("suspect: swapped"));
}

TEST_F(FaultyScene, NearlyOneDirectionIsSaidAndTheSigmaIsLarger) {
  const Shot first = CleanCampaign::instance().shots("p002")[0];
  photograph_again([&first](Shot& shot, std::size_t i) {
    shot.camera_from_world =
        Rigid3::from_translation({2.0 * static_cast<double>(i), 0, 0}) * first.camera_from_world;
  });
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kButP002);
  const PoseRecord& record = outcome.pose("p002");
  ASSERT_TRUE(record.pose && record.sigma);
  EXPECT_THAT(record.remarks, HasSubstr("nearly one direction"));
  EXPECT_GT(record.sigma->head<3>().norm(), 1.5 * outcome.pose("p001").sigma->head<3>().norm());
  const auto [mm, deg] = pose_distance(*record.pose, CleanCampaign::instance().truth("p002"));
  EXPECT_LT(mm, 5 * record.sigma->head<3>().norm() + CleanCampaign::instance().allowed_mm("p002"));
}

TEST_F(FaultyScene, OnlyOneMovingMarkerInOnePhotograph) {
  const std::vector<fs::path> photographs = lab_.photographs("p002");
  fs::remove(photographs[1]);
  fs::remove(photographs[2]);
  Shot shot = CleanCampaign::instance().shots("p002")[0];
  shot.obstacles.push_back(board(-300, -28));
  lab_.put(photographs[0], shot);
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kButP002);
  FaultCampaign::expect_refused(outcome, "p002", "no_moving_markers");
}

// Three per cent off: another zoom setting under the same EXIF.
CalibratedCamera wrong_lens(const fs::path& file) {
  CalibratedCamera camera = read_camera_file(file);
  camera.model.parameters[0] *= 1.03;
  return camera;
}

TEST_F(FaultyScene, ALensThatIsNotTheCalibratedOneIsSaidInEveryPose) {
  const fs::path file = lab_.folder() / "camera.yaml";
  lab_.put(file, format_camera_file("", wrong_lens(file)));
  const Outcome outcome = lab_.measure();
  EXPECT_THAT(outcome.out,
              HasSubstr("times what the photographs promise: the camera file is not of this lens"));
  for (const char* pose : {"p001", "p002", "p003"})
    EXPECT_THAT(outcome.pose(pose).status, HasSubstr("times what they should be"));
}

TEST_F(FaultyScene, ALensThatIsNotTheCalibratedOneIsRefinedWhenTheCalibrationStatesItsCovariance) {
  const fs::path file = lab_.folder() / "camera.yaml";
  CalibratedCamera camera = wrong_lens(file);
  Eigen::VectorXd sigma(9);
  sigma << 5, 2e-5, 0.1, 0.1, 2e-4, 4e-3, 1e-5, 1e-5, 2e-2;
  camera.covariance = sigma.cwiseAbs2().asDiagonal();
  lab_.put(file, format_camera_file("", camera));
  const Outcome outcome = lab_.measure();
  EXPECT_THAT(outcome.out,
              AnyOf(HasSubstr("not as it was calibrated"), HasSubstr("times what the photographs promise")));
  for (const char* pose : {"p001", "p002", "p003"}) {
    const PoseRecord& record = outcome.pose(pose);
    ASSERT_TRUE(record.pose && record.sigma) << record.status;
    const auto [mm, deg] = pose_distance(*record.pose, CleanCampaign::instance().truth(pose));
    EXPECT_LT(mm, 4 * record.sigma->head<3>().norm() + CleanCampaign::instance().allowed_mm(pose));
  }
}

TEST_F(FaultyScene, HomeNotPhotographedLeavesNoPoseWithoutWords) {
  for (const fs::path& photograph : lab_.photographs("home")) lab_.put(photograph, "");
  const Outcome outcome = lab_.measure();
  for (const char* pose : {"p001", "p002", "p003"})
    FaultCampaign::expect_refused(outcome, pose, "no_datum", "home");
}

TEST_F(FaultyScene, AMisspeltHomePoseIsTheUsersErrorAndNamesThePoses) {
  lab_.replace("campaign.yaml", "pose: home", "pose: hoem");
  const Outcome outcome = lab_.measure();
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("found 'hoem', which is none of the poses: home, p001, p002, p003"));
  EXPECT_TRUE(outcome.poses.empty());
}

TEST_F(FaultyScene, AWrongNominalCoordinateIsNamedAndLeftOut) {
  const std::string table = contents(lab_.folder() / "markers_nominal.csv");
  const std::size_t at = table.find("\n3,1,") + 5;
  const std::string x = table.substr(at, table.find(',', at) - at);
  lab_.replace("markers_nominal.csv", "\n3,1," + x, fmt::format("\n3,1,{}", std::stod(x) + 2));
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kAllPoses);
  EXPECT_THAT(outcome.out, HasSubstr("nominal point 3.1"));
}

TEST_F(FaultyScene, MarkersOfAnotherSizeThanStatedDisagreeWithTheNominalCoordinates) {
  lab_.replace("campaign.yaml", "fixed:  {ids: [0-9], size_mm: 24}", "fixed:  {ids: [0-9], size_mm: 24.5}");
  lab_.replace("campaign.yaml", "moving: {ids: [100-109], size_mm: 24}",
               "moving: {ids: [100-109], size_mm: 24.5}");
  EXPECT_THAT(lab_.measure().out, HasSubstr("disagree with the scale used"));
}

}  // namespace
}  // namespace hexcal
