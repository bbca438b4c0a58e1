#include "tools/synthetic/campaign_folder.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <map>

#include "camera_calib/calibrated_camera.h"
#include "kinematics/geometry/input_error.h"
#include "photogrammetry/photograph/photograph.h"
#include "tests/support/rigid_matchers.h"
#include "tools/io/atomic_file.h"
#include "tools/io/camera_file.h"
#include "tools/io/campaign_file.h"
#include "tools/io/csv_table.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/sheet_file.h"
#include "tools/synthetic/simulation_file.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

class CampaignFolder : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::temp_directory_path() / fmt_name(testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static SimulationOptions small() {
    SimulationOptions options;
    options.width_px = 240;
    options.poses = 2;
    options.photos_per_pose = 1;
    options.calibration_photos = 1;
    return options;
  }
  fs::path folder_;

 private:
  static std::string fmt_name(const std::string& name) {
    return "hexcal_synthetic_" + name + "_" +
           std::to_string(::testing::UnitTest::GetInstance()->random_seed());
  }
};

TEST_F(CampaignFolder, IsReadByTheProjectsOwnReaders) {
  const VirtualLaboratory laboratory = make_laboratory(small());
  RoundOptions round;
  round.head = "# test\n";
  round.true_camera = true;
  const RoundResult result = write_campaign(folder_, laboratory, round);
  EXPECT_EQ(result.photographs, 3 + 1);
  EXPECT_THAT(result.skipped, testing::IsEmpty());

  EXPECT_NO_THROW((void)read_campaign(folder_));
  EXPECT_EQ(read_pose_table(folder_ / "targets.csv").size(), 3U);
  EXPECT_EQ(read_leg_table(folder_ / "legs.csv").size(), 3U);
  EXPECT_EQ(read_sheet_file(folder_ / "sheet.yaml").size(), 1U);
  EXPECT_NO_THROW((void)read_hexapod_file(folder_ / "hexapod.yaml"));
  EXPECT_NO_THROW((void)read_hexapod_file(folder_ / "truth" / "machine.yaml"));
  const CalibratedCamera camera = read_camera_file(folder_ / "camera.yaml");
  EXPECT_THAT(Eigen::VectorXd(camera.model.parameters),
              MatrixNear(Eigen::VectorXd(laboratory.camera.parameters), 0.0));

  const PhotographInfo info = read_photograph_info(folder_ / "poses" / "home" / "DSC_0001.jpg");
  EXPECT_EQ(info.width_px, 240);
  EXPECT_EQ(info.height_px, 160);
  EXPECT_EQ(info.model, "NIKON D3200");
  ASSERT_TRUE(info.focal_length_mm.has_value());
  EXPECT_NEAR(*info.focal_length_mm, 35, 1e-9);
}

TEST_F(CampaignFolder, TrueObservationsAreProjections) {
  const VirtualLaboratory laboratory = make_laboratory(small());
  (void)write_campaign(folder_, laboratory, {});
  const CsvTable stations = CsvTable::read(folder_ / "truth" / "photos.csv");
  std::map<std::string, Rigid3> camera_from_world;
  for (std::size_t i = 0; i < stations.rows(); ++i) {
    camera_from_world[stations.text(i, "photo")] =
        Rigid3(Eigen::Quaterniond(stations.number(i, "qw"), stations.number(i, "qx"),
                                  stations.number(i, "qy"), stations.number(i, "qz")),
               {stations.number(i, "tx_mm"), stations.number(i, "ty_mm"), stations.number(i, "tz_mm")});
  }
  std::map<std::string, Pose> poses;
  for (const PoseRecord& record : read_pose_table(folder_ / "truth" / "poses.csv"))
    poses[record.id] = *record.pose;
  std::map<std::pair<int, int>, std::pair<bool, Eigen::Vector3d>> corners;
  const CsvTable markers = CsvTable::read(folder_ / "truth" / "markers.csv");
  for (std::size_t i = 0; i < markers.rows(); ++i) {
    corners[{markers.integer(i, "id"), markers.integer(i, "corner")}] = {
        markers.text(i, "body") == "LG",
        {markers.number(i, "x_mm"), markers.number(i, "y_mm"), markers.number(i, "z_mm")}};
  }
  const CsvTable seen = CsvTable::read(folder_ / "truth" / "observations.csv");
  int compared = 0;
  for (std::size_t i = 0; i < seen.rows(); ++i) {
    const std::string photo = seen.text(i, "photo");
    if (photo.rfind("poses/", 0) != 0) continue;
    const std::string pose = photo.substr(6, photo.find('/', 6) - 6);
    const auto& [moving, corner] = corners.at({seen.integer(i, "id"), seen.integer(i, "corner")});
    const Eigen::Vector3d in_UG = moving ? ug_from_lg(poses.at(pose), 50) * corner : corner;
    const auto px = laboratory.camera.project(camera_from_world.at(photo) * in_UG);
    EXPECT_THAT(*px, MatrixNear(Eigen::Vector2d(seen.number(i, "x_px"), seen.number(i, "y_px")), 2e-5));
    ++compared;
  }
  EXPECT_GT(compared, 3 * 12 * 4);  // at least twelve of the twenty markers in each photograph
}

TEST_F(CampaignFolder, SecondRoundMovesTheSameMachine) {
  const SimulationOptions options = small();
  const VirtualLaboratory laboratory = make_laboratory(options);
  RoundOptions round;
  round.images = false;
  (void)write_campaign(folder_ / "a", laboratory, round);
  const VirtualLaboratory again = make_laboratory(read_simulation_file(folder_ / "a/truth/simulation.yaml"));
  RoundOptions second;
  second.images = false;
  second.round = 1;
  second.targets = read_pose_table(folder_ / "a/targets.csv");
  second.commands = read_leg_table(folder_ / "a/legs.csv");
  second.commands->erase(second.commands->begin() + 2);
  EXPECT_THAT(write_campaign(folder_ / "c", again, second).skipped,
              testing::ElementsAre("p002: not commanded"));
  second.commands = read_leg_table(folder_ / "a/legs.csv");
  (*second.commands)[2].status = "out of stroke";
  const RoundResult result = write_campaign(folder_ / "b", again, second);
  EXPECT_THAT(result.skipped, testing::ElementsAre("p002: out of stroke"));
  const auto first_truth = read_pose_table(folder_ / "a/truth/poses.csv");
  const auto second_truth = read_pose_table(folder_ / "b/truth/poses.csv");
  for (std::size_t i = 0; i < 2; ++i) {
    // The tables carry 1e-6 mm; so do the readings.
    EXPECT_THAT(home_from_lg(*second_truth[i].pose),
                RigidNear(home_from_lg(*first_truth[i].pose), 1e-5, 1e-5));
  }
  EXPECT_FALSE(second_truth[2].pose.has_value());
}

TEST_F(CampaignFolder, FaultsAreInjectedIntoShots) {
  SimulationOptions options = small();
  options.width_px = 128;
  options.calibration_photos = 0;
  const VirtualLaboratory laboratory = make_laboratory(options);
  RoundOptions round;
  round.edit_shots = [](std::vector<Shot>& shots) {
    shots.erase(shots.begin());                                            // a view is missing
    shots[0].moved_stickers = {{3, Rigid3::from_translation({1, 0, 0})}};  // a fixed marker has moved
    std::swap(shots[0].pose, shots[1].pose);                               // folders swapped
  };
  EXPECT_EQ(write_campaign(folder_, laboratory, round).photographs, 2);
  EXPECT_TRUE(fs::exists(folder_ / "poses/p001/DSC_0003.jpg"));
  EXPECT_FALSE(fs::exists(folder_ / "poses/home/DSC_0001.jpg"));

  std::vector<Shot> shots = pose_shots(laboratory, {{"home", Pose{}}}, 0, 1);
  const auto corner = [&](const Shot& shot) {
    return sticker_views(shot_scene(laboratory, shot), laboratory.rig.stickers, laboratory.camera,
                         shot.camera_from_world)[3]
        .corners_px[0];
  };
  const Eigen::Vector2d before = corner(shots[0]);
  shots[0].moved_stickers = {{3, Rigid3::from_translation({1, 0, 0})}};
  EXPECT_GT((corner(shots[0]) - before).norm(), 0.1);
}

TEST_F(CampaignFolder, SameOptionsSameBytes) {
  SimulationOptions options = small();
  options.poses = 0;
  for (const char* name : {"a", "b"}) {
    (void)write_campaign(folder_ / name, make_laboratory(options), {});
  }
  for (const char* file : {"poses/home/DSC_0001.jpg", "truth/observations.csv", "campaign.yaml"}) {
    EXPECT_EQ(sha256_hex(read_file(folder_ / "a" / file)), sha256_hex(read_file(folder_ / "b" / file)))
        << file;
  }
}

TEST(SimulationFile, GivesBackTheOptions) {
  SimulationOptions options;
  options.seed = 0xFFFFFFFFFFFFFFF1ULL;
  options.brown_lens = true;
  options.sensor.tone = ToneCurveKind::s_curve;
  options.print.warp_mm = {1, -0.5};
  const fs::path path = fs::temp_directory_path() / "hexcal_simulation_file_test.yaml";
  const std::string text = format_simulation_file("# test\n", options);
  write_file_atomically(path, text);
  EXPECT_EQ(format_simulation_file("# test\n", read_simulation_file(path)), text);
  fs::remove(path);
}

TEST(SimulationOptions, RefusesWhatCannotBe) {
  SimulationOptions options;
  options.blur_min_px = 2;
  EXPECT_THROW(options.validate(), InputError);
  options = {};
  options.focal_mm = 200;
  EXPECT_THROW(options.validate(), InputError);
}

}  // namespace
}  // namespace hexcal
