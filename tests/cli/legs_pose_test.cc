#include <gmock/gmock.h>

#include <array>
#include <fstream>
#include <sstream>

#include "kinematics/dh_chain.h"
#include "tests/support/hexapods.h"
#include "tests/support/run_hexcal.h"
#include "tests/support/temporary_folder.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace {

using ::testing::HasSubstr;

struct Lab {
  Lab() {
    std::ofstream(file("h.yaml")) << hexapod_text("", surrogate_hexapod());
    std::ofstream(file("poses.csv")) << "# by hand\npose,note,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\r\n"
                                     << "a,\"x, y\",5,-3,2,0.5,1,-2\n\n\"b\"\"1\",,-20,10,+5,3,-4,12\n";
  }
  [[nodiscard]] std::string file(const char* name) const { return (folder.path() / name).string(); }
  TemporaryFolder folder;
};

TEST(LegsAndPose, UndoEachOther) {
  const Lab lab;
  const CommandResult legs = run_hexcal({"legs", "--hexapod", lab.file("h.yaml"), "--poses",
                                         lab.file("poses.csv"), "-o", lab.file("legs.csv")});
  ASSERT_EQ(legs.exit_code, 0) << legs.err;
  const CommandResult pose = run_hexcal({"pose", "--hexapod", lab.file("h.yaml"), "--legs",
                                         lab.file("legs.csv"), "-o", lab.file("back.csv"), "--certify"});
  ASSERT_EQ(pose.exit_code, 0) << pose.err;
  const std::vector<PoseRecord> there = read_pose_table(lab.file("poses.csv"));
  const std::vector<PoseRecord> back = read_pose_table(lab.file("back.csv"));
  ASSERT_EQ(back.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(back[i].id, there[i].id);
    EXPECT_EQ(back[i].status, "ok");
    EXPECT_LE(pose_error(*back[i].pose, *there[i].pose).norm(), 1e-8);
  }
  EXPECT_THAT(contents(lab.file("back.csv")), HasSubstr(",unique,1"));
}

// The paper's options 1 and 2 work with these; any of the six legs tells the whole pose.
TEST(LegsAndPose, DenavitHartenbergVariablesTellThePose) {
  const Lab lab;
  const CommandResult result = run_hexcal({"legs", "--hexapod", lab.file("h.yaml"), "--dh", "--poses",
                                           lab.file("poses.csv"), "-o", lab.file("dh.csv")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const PlatformGeometry geometry = surrogate_hexapod();
  const std::array<LegChain, 6> chains = leg_chains(geometry);
  const std::vector<PoseRecord> poses = read_pose_table(lab.file("poses.csv"));
  std::istringstream lines(contents(lab.file("dh.csv")));
  std::string line;
  std::getline(lines, line);
  std::getline(lines, line);
  EXPECT_EQ(line, "pose,leg,theta1_deg,theta2_deg,d3_mm,theta4_deg,theta5_deg,theta6_deg");
  for (const PoseRecord& pose : poses) {
    for (std::size_t leg = 0; leg < 6; ++leg) {
      ASSERT_TRUE(std::getline(lines, line));
      Vector6d dh;
      std::istringstream cells(line.substr(line.rfind(',' + std::to_string(leg + 1) + ',') + 3));
      for (double& value : dh) {
        cells >> value;
        cells.ignore();
      }
      for (const Eigen::Index angle : {0, 1, 3, 4, 5}) dh[angle] *= kRadPerDeg;
      const Pose back = geometry.pose_from_B_from_P(pose_along_leg(chains[leg], dh));
      EXPECT_LT(pose_error(back, *pose.pose).norm(), 1e-6) << line;
    }
  }
  const CommandResult one =
      run_hexcal({"legs", "--hexapod", lab.file("h.yaml"), "--dh", "--pose", "0,0,0,0,0,0"});
  EXPECT_EQ(one.exit_code, 0);
  EXPECT_THAT(one.out, HasSubstr("theta4_deg"));
}

// 350 degrees are -10.
TEST(LegsAndPose, AnglesBeyondHalfATurnAreWrapped) {
  const Lab lab;
  std::ofstream(lab.file("turned.csv"))
      << "pose,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\na,1,2,3,350,-725,370\n";
  const Vector6d deg = mm_deg(read_pose_table(lab.file("turned.csv")).front().pose->vector());
  EXPECT_LT((deg - (Vector6d() << 1, 2, 3, -10, -5, 10).finished()).norm(), 1e-9);
}

TEST(LegsAndPose, BytesDoNotDependOnTheThreads) {
  const Lab lab;
  std::ofstream many(lab.file("many.csv"));
  many << "pose,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n";
  for (int n = 0; n < 200; ++n)
    many << n << ',' << n % 7 << ',' << n % 5 << ',' << n % 3 << ",0,1," << n % 11 << '\n';
  many.close();
  for (const char* threads : {"1", "3"}) {
    ASSERT_EQ(run_hexcal({"legs", "--hexapod", lab.file("h.yaml"), "--poses", lab.file("many.csv"),
                          "--threads", threads, "-o", lab.file(threads)})
                  .exit_code,
              0);
  }
  EXPECT_EQ(contents(lab.file("1")), contents(lab.file("3")));
}

TEST(LegsAndPose, SayWhatIsOutOfReach) {
  const Lab lab;
  const CommandResult far = run_hexcal({"legs", "--hexapod", lab.file("h.yaml"), "--pose", "0,0,-200,0,0,0"});
  EXPECT_EQ(far.exit_code, 1);
  EXPECT_THAT(far.err, HasSubstr("mm too short"));
  const CommandResult long_leg =
      run_hexcal({"pose", "--hexapod", lab.file("h.yaml"), "--readings", "460,460,460,460,460,5000"});
  EXPECT_EQ(long_leg.exit_code, 1);
}

TEST(LegsAndPose, RefuseWhatTheyCannotRead) {
  const Lab lab;
  std::ofstream(lab.file("bad.csv")) << "pose,q1,q2,q3,q4,q5,q6\n1,460,460,460,46O,460,460\n";
  const CommandResult bad = run_hexcal(
      {"pose", "--hexapod", lab.file("h.yaml"), "--legs", lab.file("bad.csv"), "-o", lab.file("o.csv")});
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_THAT(bad.err, HasSubstr("bad.csv:2: q4: found '46O', wanted a number"));
  EXPECT_FALSE(std::filesystem::exists(lab.file("o.csv")));
  EXPECT_EQ(run_hexcal({"pose", "--hexapod", lab.file("h.yaml")}).exit_code, 2);
  EXPECT_EQ(run_hexcal({"legs", "--pose", "0,0,0,0,0,0"}).exit_code, 2);
  EXPECT_EQ(run_hexcal({"legs", "--hexapod", lab.file("h.yaml"), "--pose", "0,0,0,0,0"}).exit_code, 2);
}

TEST(LegsAndPose, AllModesHoldTheFeasibleOneFirst) {
  const Lab lab;
  const CommandResult all =
      run_hexcal({"pose", "--hexapod", lab.file("h.yaml"), "--readings", "460,461,462,463,462,461", "--all"});
  EXPECT_EQ(all.exit_code, 0) << all.err;
  EXPECT_THAT(all.out, HasSubstr("1,1,ok,"));
}

TEST(Workspace, WritesSlicesAndSamples) {
  const Lab lab;
  const CommandResult slice =
      run_hexcal({"workspace", "--hexapod", lab.file("h.yaml"), "--slice", "x,z", "--cells", "21", "--svg",
                  lab.file("s.svg"), "-o", lab.file("s.csv")});
  ASSERT_EQ(slice.exit_code, 0) << slice.err;
  EXPECT_THAT(contents(lab.file("s.svg")), HasSubstr("</svg>"));
  EXPECT_THAT(contents(lab.file("s.csv")), HasSubstr("\nok,"));
  const CommandResult sample = run_hexcal({"workspace", "--hexapod", lab.file("h.yaml"), "--sample",
                                           "load-paths", "-n", "12", "-o", lab.file("t.csv")});
  ASSERT_EQ(sample.exit_code, 0) << sample.err;
  EXPECT_EQ(read_pose_table(lab.file("t.csv")).size(), 12u);
  EXPECT_EQ(run_hexcal({"workspace", "--hexapod", lab.file("h.yaml")}).exit_code, 2);
}

}  // namespace
}  // namespace hexcal
