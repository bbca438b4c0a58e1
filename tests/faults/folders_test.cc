#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>

#include "tests/faults/fault_campaign.h"
#include "tests/faults/image_variants.h"

// Folders as people leave them.

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class Folders : public ::testing::Test {
 protected:
  void expect_all_healthy(const Outcome& outcome, int exit_code = 0) const {
    FaultCampaign::expect_healthy(outcome, kAllPoses);
    EXPECT_EQ(outcome.poses.size(), kAllPoses.size()) << outcome.out;
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.out << outcome.err;
  }
  // All photographs in one folder: home_DSC_0001.jpg and so on.
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> flatten() const {
    std::vector<std::pair<std::string, std::string>> table;
    for (const std::string& pose : kAllPoses) {
      for (const fs::path& photograph : lab_.photographs(pose)) {
        fs::rename(photograph, lab_.poses() / photograph.filename());
        table.emplace_back(photograph.filename().string(), pose);
      }
      fs::remove(lab_.poses() / pose);
    }
    return table;
  }
  FaultCampaign lab_;
};

TEST_F(Folders, TheCleanCampaignGivesTheSameBytesFromTheCopy) {
  expect_all_healthy(lab_.measure());
  EXPECT_EQ(contents(lab_.folder() / "results" / "poses.csv"), CleanCampaign::instance().poses_csv());
}

TEST_F(Folders, AnyNesting) {
  fs::create_directories(lab_.poses() / "monday" / "morning");
  fs::create_directories(lab_.poses() / "tuesday");
  fs::rename(lab_.poses() / "home", lab_.poses() / "monday" / "home");
  fs::rename(lab_.poses() / "p001", lab_.poses() / "monday" / "morning" / "p001");
  fs::rename(lab_.poses() / "p002", lab_.poses() / "tuesday" / "p002");
  expect_all_healthy(lab_.measure());
}

TEST_F(Folders, TwoFoldersOfOneNameAreToldApartByTheirPath) {
  fs::create_directories(lab_.poses() / "monday");
  fs::create_directories(lab_.poses() / "tuesday");
  fs::rename(lab_.poses() / "p001", lab_.poses() / "monday" / "p001");
  fs::rename(lab_.poses() / "p002", lab_.poses() / "tuesday" / "p001");
  const Outcome outcome = lab_.measure();
  EXPECT_EQ(outcome.exit_code, 0);
  FaultCampaign::expect_healthy(outcome, {"home", "p003"});
  EXPECT_LT(
      pose_distance(outcome.pose("tuesday/p001").pose.value(), CleanCampaign::instance().truth("p002")).first,
      CleanCampaign::instance().allowed_mm("p002"));
}

TEST_F(Folders, ASingleFolderOfPhotographsIsOnePose) {
  lab_.use_nominal_lg();
  const Outcome outcome = lab_.measure({"--poses-dir", (lab_.poses() / "p001").string() + "/"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  EXPECT_EQ(outcome.poses.size(), 1U);
  const PoseRecord& record = outcome.pose("p001");
  ASSERT_TRUE(record.pose && record.sigma);
  // Three photographs know less than twelve: their own sigma is the measure.
  const auto [mm, deg] = pose_distance(*record.pose, CleanCampaign::instance().truth("p001"));
  EXPECT_LT(mm, 4 * record.sigma->head<3>().norm() + CleanCampaign::instance().allowed_mm("p001"));
}

TEST_F(Folders, EndingsInAnyCase) {
  fs::rename(lab_.photographs("p001")[0], lab_.poses() / "p001" / "DSC_0004.JPG");
  fs::rename(lab_.photographs("p002")[1], lab_.poses() / "p002" / "DSC_0008.Jpeg");
  expect_all_healthy(lab_.measure());
}

TEST_F(Folders, OfRawBesideJpegTheJpegIsTakenAndTheRawNamed) {
  const fs::path jpeg = lab_.photographs("p001")[0];
  lab_.put(fs::path(jpeg).replace_extension(".NEF"), dng_of(pixels_of(contents(jpeg))));
  const Outcome outcome = lab_.measure();
  expect_all_healthy(outcome);
  EXPECT_EQ(outcome.pose("p001").images, 3);
  EXPECT_THAT(outcome.out, HasSubstr(fmt::format("p001/{}.NEF: RAW of p001/{}", jpeg.stem().string(),
                                                 jpeg.filename().string())));
}

TEST_F(Folders, RawInAFolderOfItsOwnIsNoPose) {
  for (const fs::path& jpeg : lab_.photographs("p001"))
    lab_.put(lab_.poses() / "p001" / "RAW" / (jpeg.stem().string() + ".NEF"),
             dng_of(pixels_of(contents(jpeg))));
  const Outcome outcome = lab_.measure();
  expect_all_healthy(outcome);
  EXPECT_THAT(outcome.out, HasSubstr("p001/RAW/DSC_0004.NEF: RAW of p001/DSC_0004.jpg, which is taken"));
}

TEST_F(Folders, ATiffMadeFromTheJpegDoesNotCountTwice) {
  const fs::path jpeg = lab_.photographs("p001")[0];
  lab_.put(fs::path(jpeg).replace_extension(".tif"), encoded(pixels_of(contents(jpeg)), ".tif"));
  const Outcome outcome = lab_.measure();
  expect_all_healthy(outcome);
  EXPECT_EQ(outcome.pose("p001").images, 3);
  EXPECT_THAT(outcome.out, HasSubstr("copy of p001/DSC_0004.jpg"));
}

TEST_F(Folders, LitterOfOperatingSystemsIsPassedOver) {
  for (const char* name :
       {".DS_Store", "Thumbs.db", "._DSC_0004.jpg", "desktop.ini", "notes.txt", "film.MOV"})
    lab_.put(lab_.poses() / "p001" / name, "litter");
  lab_.put(lab_.poses() / "p001" / "thumbnails" / "DSC_0004.jpg", "small");
  lab_.put(lab_.poses() / "__MACOSX" / "p001" / "._DSC_0004.jpg", "litter");
  lab_.put(lab_.poses() / ".DS_Store", "litter");
  const Outcome outcome = lab_.measure();
  expect_all_healthy(outcome);
  EXPECT_THAT(outcome.out, Not(HasSubstr("not used")));
}

TEST_F(Folders, AThumbnailBesideItsPhotographIsNamed) {
  const fs::path jpeg = lab_.photographs("p001")[0];
  lab_.put(jpeg.parent_path() / "DSC_0004_thumb.jpg", contents(jpeg).substr(0, 4000));
  const Outcome outcome = lab_.measure();
  expect_all_healthy(outcome);
  EXPECT_THAT(outcome.out, HasSubstr("DSC_0004_thumb.jpg: a thumbnail"));
}

TEST_F(Folders, AStrayPhotographIsNamed) {
  fs::copy_file(lab_.photographs("p001")[0], lab_.poses() / "DSC_0999.jpg");
  const Outcome outcome = lab_.measure();
  expect_all_healthy(outcome);
  EXPECT_THAT(outcome.out, HasSubstr("DSC_0999.jpg: stray"));
}

TEST_F(Folders, AStrayPhotographInANestedFolderIsNoPose) {
  fs::create_directories(lab_.poses() / "monday");
  for (const std::string& pose : kAllPoses) fs::rename(lab_.poses() / pose, lab_.poses() / "monday" / pose);
  fs::copy_file(lab_.poses() / "monday" / "p001" / "DSC_0004.jpg", lab_.poses() / "monday" / "DSC_0999.jpg");
  const Outcome outcome = lab_.measure();
  expect_all_healthy(outcome);
  EXPECT_THAT(outcome.out, HasSubstr("monday/DSC_0999.jpg: stray"));
}

TEST_F(Folders, ALinkThatLeadsInACircle) {
  fs::create_directory_symlink(lab_.poses(), lab_.poses() / "p001" / "again");
  expect_all_healthy(lab_.measure());
}

TEST_F(Folders, TheSamePhotographTwiceCountsOnce) {
  fs::copy_file(lab_.photographs("p001")[0], lab_.poses() / "p001" / "DSC_0004 (copy).JPG");
  const Outcome outcome = lab_.measure();
  expect_all_healthy(outcome, 1);
  EXPECT_EQ(outcome.pose("p001").images, 3);
  EXPECT_THAT(outcome.out, HasSubstr("duplicate: the same photograph as p001/DSC_0004"));
  EXPECT_THAT(outcome.pose("p001").remarks, HasSubstr("the same photograph as"));
}

TEST_F(Folders, APhotographOfAnotherPoseCopiedIntoAFolder) {
  fs::copy_file(lab_.photographs("p001")[0], lab_.poses() / "p002" / "DSC_0010.jpg");
  const Outcome outcome = lab_.measure();
  expect_all_healthy(outcome, 1);
  EXPECT_THAT(outcome.out,
              HasSubstr("p002/DSC_0010.jpg: duplicate: the same photograph as p001/DSC_0004.jpg"));
}

TEST_F(Folders, AFolderWithThePhotographsOfAnotherPose) {
  for (const fs::path& photograph : lab_.photographs("p002")) fs::remove(photograph);
  for (const fs::path& photograph : lab_.photographs("p001"))
    fs::copy_file(photograph, lab_.poses() / "p002" / photograph.filename());
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kButP002);
  FaultCampaign::expect_refused(outcome, "p002", "same_photographs", "of pose p001");
}

TEST_F(Folders, AnEmptyFolderIsAPoseWithoutPhotographs) {
  for (const fs::path& photograph : lab_.photographs("p002")) fs::remove(photograph);
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kButP002);
  FaultCampaign::expect_refused(outcome, "p002", "no_photographs");
}

TEST_F(Folders, OnePhotographGivesAPoseWithALargerSigmaAndWords) {
  const std::vector<fs::path> photographs = lab_.photographs("p002");
  fs::remove(photographs[1]);
  fs::remove(photographs[2]);
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kButP002);
  const PoseRecord& record = outcome.pose("p002");
  EXPECT_EQ(record.status, "ok");
  EXPECT_THAT(record.remarks, HasSubstr("one photograph only"));
  EXPECT_GT(record.sigma->head<3>().norm(), 1.5 * outcome.pose("p001").sigma->head<3>().norm());
}

TEST_F(Folders, TwoPhotographsAreEnough) {
  fs::remove(lab_.photographs("p002")[1]);
  const Outcome outcome = lab_.measure();
  expect_all_healthy(outcome);
  EXPECT_EQ(outcome.pose("p002").images, 2);
}

TEST_F(Folders, TwelvePhotographsOfOnePose) {
  int number = 100;
  for (std::uint64_t round = 1; round <= 3; ++round) {
    for (const Shot& shot : CleanCampaign::instance().shots("p002", round))
      lab_.put(lab_.poses() / "p002" / fmt::format("DSC_{:04d}.jpg", number++), shot);
  }
  const Outcome outcome = lab_.measure();
  expect_all_healthy(outcome);
  EXPECT_EQ(outcome.pose("p002").images, 12);
  EXPECT_LT(outcome.pose("p002").sigma->norm(), outcome.pose("p001").sigma->norm());
}

TEST_F(Folders, SeveralCamerasByTheirSerialNumbers) {
  PhotographTags tags;
  tags.serial = "3000001";
  const fs::path photograph = lab_.photographs("p002")[0];
  lab_.put(photograph, jpeg_with_tags(pixels_of(contents(photograph)), tags));
  lab_.replace("campaign.yaml", "camera: camera.yaml",
               "camera: [{file: camera.yaml, serial: 2419077}, {file: second.yaml, serial: 3000001}]");
  fs::copy_file(lab_.folder() / "camera.yaml", lab_.folder() / "second.yaml");
  expect_all_healthy(lab_.measure());
}

TEST_F(Folders, APhotographOfAnUnknownCameraIsRefused) {
  PhotographTags tags;
  tags.serial = "3000002";
  const fs::path photograph = lab_.photographs("p002")[0];
  lab_.put(photograph, jpeg_with_tags(pixels_of(contents(photograph)), tags));
  lab_.replace("campaign.yaml", "camera: camera.yaml",
               "camera: [{file: camera.yaml, serial: 2419077}, {file: camera.yaml, serial: 3000001}]");
  const Outcome outcome = lab_.measure();
  expect_all_healthy(outcome, 1);
  EXPECT_THAT(outcome.out, HasSubstr("wrong_camera: no camera file is for it (serial 3000002)"));
}

TEST_F(Folders, SeveralCamerasByFoldersInsideThePoses) {
  for (const std::string& pose : kAllPoses) {
    const std::vector<fs::path> photographs = lab_.photographs(pose);
    for (std::size_t i = 0; i < photographs.size(); ++i) {
      const fs::path folder = lab_.poses() / pose / (i == 1 ? "right" : "left");
      fs::create_directories(folder);
      fs::rename(photographs[i], folder / photographs[i].filename());
    }
  }
  fs::copy_file(lab_.folder() / "camera.yaml", lab_.folder() / "second.yaml");
  lab_.replace("campaign.yaml", "camera: camera.yaml",
               "camera: [{file: camera.yaml, folder: left}, {file: second.yaml, folder: right}]");
  const Outcome outcome = lab_.measure();
  expect_all_healthy(outcome);
  EXPECT_EQ(outcome.pose("p001").images, 3);
}

TEST_F(Folders, SeveralCamerasByFoldersAboveThePoses) {
  for (const std::string& pose : kAllPoses) {
    const std::vector<fs::path> photographs = lab_.photographs(pose);
    for (std::size_t i = 0; i < photographs.size(); ++i) {
      const fs::path folder = lab_.poses() / (i == 1 ? "right" : "left") / pose;
      fs::create_directories(folder);
      // Cameras number their photographs alike.
      fs::rename(photographs[i], folder / fmt::format("DSC_{:04d}.jpg", i / 2));
    }
    fs::remove(lab_.poses() / pose);
  }
  lab_.replace("campaign.yaml", "camera: camera.yaml",
               "camera: [{file: camera.yaml, folder: left}, {file: camera.yaml, folder: right}]");
  const Outcome outcome = lab_.measure();
  expect_all_healthy(outcome);
  EXPECT_EQ(outcome.pose("p001").images, 3);
}

// The same pose photographed at 50 mm from a station further away.
Shot zoomed_shot(const CleanCampaign& clean, const VirtualLaboratory& zoomed) {
  Shot shot = pose_shots(zoomed, {{"p002", clean.truth("p002")}}, 1, 900).front();
  shot.tags.focal_mm = 50;
  return shot;
}

class Zoomed : public Folders {
 protected:
  void SetUp() override {
    const CleanCampaign& clean = CleanCampaign::instance();
    VirtualLaboratory zoomed = clean.laboratory();
    zoomed.options.focal_mm = 50;
    zoomed.camera = brown_camera(50, zoomed.options.width_px);
    const Shot shot = zoomed_shot(clean, zoomed);
    write_jpeg(lab_.poses() / "p002" / "DSC_0900.jpg", photograph(zoomed, RayLattice(zoomed.camera), shot),
               zoomed.options.jpeg, shot.tags);
    fx_px_ = zoomed.camera.fx_px();
  }
  double fx_px_ = 0;
};

TEST_F(Zoomed, APhotographOfAnotherZoomSettingIsRefusedByItsExif) {
  const Outcome outcome = lab_.measure();
  expect_all_healthy(outcome, 1);
  EXPECT_EQ(outcome.pose("p002").images, 3);
  EXPECT_THAT(outcome.pose("p002").remarks, HasSubstr("focal length: camera 35 mm, photograph 50 mm"));
}

TEST_F(Folders, AFlatFolderWithATableOfPoses) {
  std::string table = "file,pose\n";
  for (const auto& [file, pose] : flatten()) table += file + "," + pose + "\n";
  lab_.put(lab_.folder() / "photographs.csv", table);
  lab_.replace("campaign.yaml", "images: poses", "images: poses\nimages_table: photographs.csv");
  expect_all_healthy(lab_.measure());
}

TEST_F(Folders, ATableThatNamesAPhotographThatIsNotThere) {
  std::string table = "file,pose\n";
  for (const auto& [file, pose] : flatten()) table += file + "," + pose + "\n";
  lab_.put(lab_.folder() / "photographs.csv", table + "DSC_0998.jpg,p002\nDSC_0999.jpg,p009\n");
  lab_.replace("campaign.yaml", "images: poses", "images: poses\nimages_table: photographs.csv");
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kAllPoses);
  EXPECT_THAT(outcome.pose("p002").remarks, HasSubstr("DSC_0998.jpg: no such file"));
  FaultCampaign::expect_refused(outcome, "p009", "no_usable_photographs", "DSC_0999.jpg: no such file");
}

TEST_F(Folders, AMemoryCardGroupedByTime) {
  std::map<std::string, std::string> group{
      {"home", "g01"}, {"p001", "g02"}, {"p002", "g03"}, {"p003", "g04"}};
  int seconds = 0;
  for (const auto& [file, pose] : flatten()) {
    PhotographTags tags;
    tags.capture_time = capture_time(seconds);
    const bool last = file == "DSC_0003.jpg" || file == "DSC_0006.jpg" || file == "DSC_0009.jpg";
    seconds += last ? 300 : 20;
    const fs::path path = lab_.poses() / file;
    lab_.put(path, jpeg_with_tags(pixels_of(contents(path)), tags));
  }
  lab_.put(lab_.poses() / "DSC_0500.png", encoded(cv::Mat::zeros(20, 30, CV_8UC1), ".png"));
  lab_.replace("campaign.yaml", "pose: home", "pose: g01");
  const Outcome outcome = lab_.measure({"--group-by-time", "60"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("DSC_0500.png: has no capture time"));
  for (const char* pose : {"p001", "p002", "p003"}) {
    // Encoded a second time, so a little more than twice the clean error is fair.
    EXPECT_LT(
        pose_distance(outcome.pose(group.at(pose)).pose.value(), CleanCampaign::instance().truth(pose)).first,
        2 * CleanCampaign::instance().allowed_mm(pose));
  }
}

// A photograph of p002 in another format; nothing is lost in it.
class Formats : public Folders {
 protected:
  void store(const std::string& ending, const std::string& bytes) const {
    const fs::path jpeg = lab_.photographs("p002")[0];
    lab_.put(fs::path(jpeg).replace_extension(ending), bytes);
    fs::remove(jpeg);
  }
  [[nodiscard]] cv::Mat pixels() const { return pixels_of(contents(lab_.photographs("p002")[0])); }
  void expect_measured() const {
    const Outcome outcome = lab_.measure();
    expect_all_healthy(outcome);
    EXPECT_EQ(outcome.pose("p002").images, 3);
  }
};

TEST_F(Formats, Png) {
  store(".png", encoded(pixels(), ".png"));
  expect_measured();
}
TEST_F(Formats, PngOf16Bit) {
  store(".PNG", encoded(sixteen_bit(pixels()), ".png"));
  expect_measured();
}
TEST_F(Formats, Tiff) {
  store(".tif", encoded(pixels(), ".tif"));
  expect_measured();
}
TEST_F(Formats, TiffOf16Bit) {
  store(".TIFF", encoded(sixteen_bit(pixels()), ".tif"));
  expect_measured();
}
// The green of a mosaic, half interpolated.
TEST_F(Formats, Dng) {
  store(".dng", dng_of(pixels()));
  expect_measured();
}
TEST_F(Formats, AJpegUnderThePngsName) {
  store(".png", contents(lab_.photographs("p002")[0]));
  expect_measured();
}

}  // namespace
}  // namespace hexcal
