#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "tests/support/run_hexcal.h"
#include "tests/support/sample_campaign.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kPoseHead = "pose,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n";

// The sample campaign with what `measure` would write of three stations and four markers that face them, at
// radius 64 mm on the moving grip.
class Plan : public ::testing::Test {
 protected:
  void SetUp() override {
    copy_sample_campaign(lab_);
    fs::create_directories(lab_ / "results");
    write(lab_ / "results/photos.csv",
          "photo,pose,status,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n"
          "home/1.jpg,home,ok,572.7,-366.9,124.2,-101.56,-0.76,57.60\n"
          "home/2.jpg,home,ok,599.1,-41.8,279.1,-117.52,0.95,84.35\n"
          "home/3.jpg,home,ok,537.2,403.9,-46.5,-89.10,3.12,125.69\n"
          "home/4.jpg,home,too few markers,,,,,,\n");
    std::string markers = "id,corner,frame,x_mm,y_mm,z_mm\n0,0,UG,20.7,-59.3,29.8\n";
    for (int id = 0; id < 4; ++id) {
      const double angle_rad = (20.0 * id - 30) * kRadPerDeg;
      const Eigen::Vector3d out(std::cos(angle_rad), std::sin(angle_rad), 0);
      const Eigen::Vector3d along(-out.y(), out.x(), 0);
      const double x[] = {-8, 8, 8, -8};
      const double z[] = {-6, -6, -22, -22};
      for (int corner = 0; corner < 4; ++corner) {
        const Eigen::Vector3d at = 64 * out + x[corner] * along;
        markers += fmt::format("{},{},LG,{},{},{}\n", 100 + id, corner, at.x(), at.y(), z[corner]);
      }
    }
    write(lab_ / "results/markers.csv", markers);
  }
  static std::string write(const fs::path& path, const std::string& text) {
    std::ofstream(path) << text;
    return path.string();
  }
  CommandResult plan(std::vector<std::string> more) const {
    more.insert(more.begin(), {"plan", lab_.string(), "-o", (folder_.path() / "planned.csv").string()});
    return run_hexcal(more);
  }
  std::vector<std::string> planned() const {
    std::vector<std::string> ids;
    for (const PoseRecord& record : read_pose_table(folder_.path() / "planned.csv")) ids.push_back(record.id);
    return ids;
  }

  TemporaryFolder folder_;
  fs::path lab_ = folder_.path() / "lab";
};

TEST_F(Plan, PosesThatTheMeasuredStationsDoNotSeeAreLeftOut) {
  std::string candidates = kPoseHead;
  for (int i = 0; i < 8; ++i)
    candidates += fmt::format("seen{},{},{},{},{},{},{}\n", i, 4 * i - 14, 10 - 3 * i, 5 * (i % 3) - 5,
                              3 * (i % 4) - 5, 6 - 2 * i, (7 * i) % 5 - 2);
  // Markers turned away; off to the side of all pictures; turned so that one picture only shows two of them.
  candidates += "turned,0,0,0,0,0,120\naway,0,1500,0,0,0,0\ntoo steep,0,0,0,0,75,0\n";
  const std::string file = write(folder_.path() / "candidates.csv", candidates);
  CommandResult r = plan({"--candidates", file, "-n", "8", "--max-tilt-deg", "90"});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  EXPECT_THAT(r.out, HasSubstr("8 of 11 candidates can be measured from the stations"));
  EXPECT_THAT(planned(), Each(HasSubstr("seen")));

  r = plan({"--candidates", file, "-n", "9", "--max-tilt-deg", "90"});
  EXPECT_EQ(r.exit_code, 2);
  EXPECT_THAT(r.err, AllOf(HasSubstr("8 of 11 candidate poses"), HasSubstr("--any-station")));
  EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;

  r = plan({"--candidates", file, "-n", "9", "--max-tilt-deg", "90", "--any-station"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_THAT(r.out, Not(HasSubstr("stations")));
}

TEST_F(Plan, BeforeTheCampaignIsMeasuredAllPosesCount) {
  fs::remove_all(lab_ / "results");
  const CommandResult r = plan({"-n", "6", "--frames", "unknown"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_THAT(r.out, AllOf(HasSubstr("6 poses of 2000 candidates"), Not(HasSubstr("stations"))));
  EXPECT_EQ(planned().size(), 6u);
}

TEST_F(Plan, AMeasuredNetworkWithoutMovingMarkersIsRefused) {
  write(lab_ / "results/markers.csv", "id,corner,frame,x_mm,y_mm,z_mm\n0,0,UG,20.7,-59.3,29.8\n");
  const CommandResult r = plan({"-n", "6"});
  EXPECT_EQ(r.exit_code, 2);
  EXPECT_THAT(r.err, HasSubstr("markers.csv: no marker of LG with four corners"));
}

}  // namespace
}  // namespace hexcal
