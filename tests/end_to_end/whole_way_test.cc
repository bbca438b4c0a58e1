#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>

#include "tests/support/output_files.h"
#include "tests/support/run_hexcal.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

struct Rms {
  double mm = 0;
  double deg = 0;
  int poses = 0;
};

// Root mean square over the poses of the length of the position difference and of the angle between the
// rotations.
Rms difference(const fs::path& a, const fs::path& b) {
  std::map<std::string, Pose> wanted;
  for (const PoseRecord& record : read_pose_table(b)) wanted[record.id] = record.pose.value();
  Rms rms;
  for (const PoseRecord& record : read_pose_table(a)) {
    if (!record.pose || record.id == "home") continue;
    const Rigid3 difference = inverse(home_from_lg(wanted.at(record.id))) * home_from_lg(*record.pose);
    rms.mm += difference.translation.squaredNorm();
    const double angle = Eigen::AngleAxisd(difference.rotation).angle() * 180 / M_PI;
    rms.deg += angle * angle;
    ++rms.poses;
  }
  rms.mm = std::sqrt(rms.mm / rms.poses);
  rms.deg = std::sqrt(rms.deg / rms.poses);
  return rms;
}

void run(const std::vector<std::string>& arguments) {
  const CommandResult result = run_hexcal(arguments);
  ASSERT_EQ(result.exit_code, 0) << arguments.front() << '\n' << result.out << result.err;
}

// Photographs of a quarter of the camera's width: 12 poses are photographed with a lens that is calibrated
// from photographs of a sheet, the machine is identified, and its answer to the corrected commands is tried
// at 12 poses never measured.
TEST(WholeWay, FromPhotographsToCorrectedCommands) {
  const TemporaryFolder folder;
  const std::string lab = (folder.path() / "lab").string();
  const std::string other = (folder.path() / "other").string();
  const std::string corrected = (folder.path() / "corrected").string();
  const std::string answer = (folder.path() / "answer").string();
  const std::string uncorrected = (folder.path() / "uncorrected").string();
  run({"simulate", "-o", lab, "--width", "1504", "--poses", "12", "--seed", "5"});
  run({"camera", lab + "/calibration", "--template", lab + "/sheet.yaml", "-o", lab + "/camera.yaml"});
  run({"measure", lab});
  const Rms measured = difference(lab + "/results/poses.csv", lab + "/truth/poses.csv");
  EXPECT_EQ(measured.poses, 12);
  EXPECT_LT(measured.mm, 0.004);
  EXPECT_LT(measured.deg, 0.003);

  run({"simulate", "-o", other, "--poses", "12", "--seed", "77", "--no-images"});
  run({"compensate", lab, "--method", "kinematic", "--apply", other + "/targets.csv", "-o", corrected});
  run({"simulate", "-o", answer, "--from", lab, "--commands", corrected + "/actuators.csv", "--targets",
       other + "/targets.csv", "--no-images"});
  run({"simulate", "-o", uncorrected, "--from", lab, "--commands", other + "/legs.csv", "--targets",
       other + "/targets.csv", "--no-images"});
  const Rms before = difference(uncorrected + "/truth/poses.csv", other + "/targets.csv");
  const Rms after = difference(answer + "/truth/poses.csv", other + "/targets.csv");
  EXPECT_EQ(after.poses, 12);
  EXPECT_LT(after.mm, 0.05 * before.mm) << before.mm;
  EXPECT_LT(after.deg, 0.05 * before.deg) << before.deg;

  run({"report", lab});
  EXPECT_GT(expect_finite_numbers(folder.path()), 40);
}

}  // namespace
}  // namespace hexcal
