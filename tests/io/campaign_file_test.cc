#include "tools/io/campaign_file.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

using ::testing::HasSubstr;

class CampaignFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ::testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::create_directories(folder_);
    write("nominal.csv", "id,corner,x_mm,y_mm,z_mm\n0,0,1,2,3\n0,1,2,2,3\n1,,5,5,5\n");
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  Campaign read(const std::string& text) const {
    write("campaign.yaml", text);
    return read_campaign(folder_);
  }
  std::string error(const std::string& text) const {
    try {
      (void)read(text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }
  static std::string good() {
    return "camera: camera.yaml\nimages: poses\nmarkers:\n  family: tag36h11\n"
           "  fixed: {ids: [0-9], size_mm: 24.0}\n  moving: {ids: {100: 24, 101-103: 12.5}}\n"
           "frames:\n  UG: {from: nominal, file: nominal.csv}\n  LG: {from: home, pose: home, gd_mm: 50}\n"
           "scale: {from: markers}\n";
  }
  static std::string with(const std::string& from, const std::string& to) {
    std::string text = good();
    text.replace(text.find(from), from.size(), to);
    return text;
  }
  std::filesystem::path folder_;
};

TEST_F(CampaignFile, ReadsTheExampleOfTheDesign) {
  const Campaign campaign = read(good());
  EXPECT_EQ(campaign.cameras.at(0).file, folder_ / "camera.yaml");
  EXPECT_EQ(campaign.fixed.size(), 10U);
  EXPECT_EQ(campaign.moving.at(102), 12.5);
  EXPECT_EQ(campaign.ug->nominal.size(), 3U);
  EXPECT_EQ(campaign.ug->nominal[2].point.corner, -1);
  EXPECT_EQ(campaign.lg->home_pose, "home");
  EXPECT_EQ(campaign.lg->gd_mm, 50);
  EXPECT_FALSE(campaign.hexapod.has_value());
}

TEST_F(CampaignFile, ReadsFeaturesBarsChecksAndSeveralCameras) {
  std::string text =
      with("{from: nominal, file: nominal.csv}",
           "{from: features, z: {plane: [0, 1]}, x: {line: [0.1, 3]}, origin: {circle: [4, 5, 6]}}");
  text.replace(text.find("{from: markers}"), 15,
               "{bars: [{a: 0.1, b: 9.2, length_mm: 182.41, sigma_mm: 0.01}]}");
  text.replace(text.find("camera.yaml"), 11, "[{file: a.yaml, serial: '77'}, {file: b.yaml, folder: left}]");
  text += "checks: [{a: 100, b: 101.3, length_mm: 20.5}]\n";
  const Campaign campaign = read(text);
  EXPECT_EQ(campaign.scale, ScaleFrom::bars);
  EXPECT_EQ(campaign.bars.at(0).b, (MarkerPoint{9, 2}));
  EXPECT_EQ(campaign.ug->features->x.points.at(0), (MarkerPoint{0, 1}));
  EXPECT_EQ(campaign.ug->features->origin.kind, Feature::Kind::circle);
  EXPECT_EQ(campaign.cameras.at(1).folder, "left");
  EXPECT_EQ(campaign.checks.at(0).a, (MarkerPoint{100, -1}));
}

TEST_F(CampaignFile, RefusesWithFileLineAndKey) {
  EXPECT_THAT(error(with("images: poses", "image: poses")), HasSubstr("images: missing"));
  EXPECT_THAT(error(with("size_mm: 24.0", "sise_mm: 24.0")), HasSubstr("markers.fixed.size_mm: missing"));
  EXPECT_THAT(error(with("[0-9]", "[9-0]")), HasSubstr("campaign.yaml:5"));
  EXPECT_THAT(error(with("[0-9]", "[0-100]")), HasSubstr("marker 100 is both fixed and moving"));
  EXPECT_THAT(error(with("[0-9]", "[0-9, 3]")), HasSubstr("marker 3 stands twice"));
  EXPECT_THAT(error(with(", gd_mm: 50", "")), HasSubstr("frames.LG.gd_mm: missing"));
  EXPECT_THAT(error(with("from: home", "from: hom")), HasSubstr("wanted one of nominal, home, features"));
  EXPECT_EQ(read(with("{from: nominal, file: nominal.csv}", "{from: markers}")).ug->from,
            FrameRule::From::markers);
  std::string no_home = with("{from: nominal, file: nominal.csv}", "{from: markers}");
  no_home.replace(no_home.find("from: home, pose: home"), 22, "from: nominal, file: nominal.csv");
  EXPECT_THAT(error(no_home), HasSubstr("UG from markers wants LG from home"));
  EXPECT_THAT(error(with("{from: markers}", "{from: nominal}") + "extra: 1\n"),
              HasSubstr("unknown key 'extra'"));
  EXPECT_THAT(error(with("{from: markers}", "{from: bars}")), HasSubstr("scale.bars: missing"));
  EXPECT_THAT(error(good() + "checks: [{a: 0, b: 100, length_mm: 3}]\n"),
              HasSubstr("two markers of one body"));
  EXPECT_THAT(error(good() + "checks: [{a: 0.4, b: 1, length_mm: 3}]\n"), HasSubstr("corner 0 to 3"));
}

}  // namespace
}  // namespace hexcal
