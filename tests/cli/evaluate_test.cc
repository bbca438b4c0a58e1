#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/run_hexcal.h"

namespace hexcal {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Evaluate : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& rows) {
    const std::filesystem::path path = folder_.path() / name;
    std::ofstream(path) << "pose,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n" << rows;
    return path.string();
  }
  TemporaryFolder folder_;
};

TEST_F(Evaluate, PrintsThePapersTableAndTheFairOne) {
  const std::string targets = write("t.csv", "a,0,0,0,0,0,0\nb,10,0,0,5,0,0\nc,0,5,0,0,1,0\n");
  // Ranges of the paper's table 2, a missing row after compensation.
  const std::string before =
      write("b.csv", "a,26.54,16.67,13.49,8.27,11.99,12.59\nb,10,0,0,5,0,0\nc,1,6,1,1,2,1\n");
  const std::string after = write("a.csv", "a,20.25,18.44,14.01,6.86,10.29,9.2\nb,10,0,0,5,0,0\n");
  const CommandResult r =
      run_hexcal({"evaluate", "--targets", targets, "--before", before, "--after", after});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_THAT(r.out,
              AllOf(HasSubstr("19.70"), HasSubstr("11.1155"), HasSubstr("17.761"), HasSubstr("8.8991")));
  EXPECT_THAT(r.out, AllOf(HasSubstr("9.8 %"), HasSubstr("19.9 %"), HasSubstr("same 2 poses")));
}

// The home that defines LG is zero by definition: counted, it makes every error look smaller.
TEST_F(Evaluate, TheHomeThatDefinesTheFrameIsNoMeasuredError) {
  const std::string targets = write("t.csv", "home,0,0,0,0,0,0\na,1,0,0,0,0,0\nb,0,2,0,0,0,0\n");
  const std::filesystem::path before = folder_.path() / "b.csv";
  std::ofstream(before) << "pose,status,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg,sigma_x_mm,sigma_y_mm,"
                           "sigma_z_mm,sigma_roll_deg,sigma_pitch_deg,sigma_yaw_deg\n"
                           "home,ok,0,0,0,0,0,0,0,0,0,0,0,0\n"
                           "a,ok,4,0,0,0,0,0,0.1,0.1,0.1,0.1,0.1,0.1\n"
                           "b,ok,0,5,0,0,0,0,0.1,0.1,0.1,0.1,0.1,0.1\n";
  const CommandResult r = run_hexcal({"evaluate", "--targets", targets, "--before", before.string()});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_THAT(r.out, AllOf(HasSubstr("same 2 poses"), HasSubstr("3.0000")));
}

TEST_F(Evaluate, TablesOfOneNameAreToldApartAndZeroHasNoSign) {
  const std::string targets = write("t.csv", "a,0,0,0,0,0,0\nb,10,0,0,5,0,0\n");
  const std::string before = write("b.csv", "a,1,0,0,0,0,0\nb,10,0,0,5,0,0\n");
  std::vector<std::string> command{"evaluate", "--targets", targets, "--before", before};
  for (const char* folder : {"A", "B"}) {
    std::filesystem::create_directories(folder_.path() / folder / "results");
    command.insert(command.end(), {"--after", write(std::string(folder) + "/results/poses.csv",
                                                    "a,1.000001,0,0,0,0,0\nb,10,0,0,5,0,0\n")});
  }
  const CommandResult r = run_hexcal(command);
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_THAT(r.out, AllOf(HasSubstr("A/results/poses"), HasSubstr("B/results/poses"), HasSubstr("0.0 %"),
                           ::testing::Not(HasSubstr("-0.0"))));
}

TEST_F(Evaluate, RefusesTablesThatShareNoPose) {
  const std::string targets = write("t.csv", "a,0,0,0,0,0,0\n");
  const std::string before = write("b.csv", "z,1,0,0,0,0,0\n");
  const CommandResult r = run_hexcal({"evaluate", "--targets", targets, "--before", before});
  EXPECT_EQ(r.exit_code, 2);
  EXPECT_THAT(r.err, HasSubstr("no pose has a target"));
}

}  // namespace
}  // namespace hexcal
