#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "kinematics/geometry/covariance.h"
#include "kinematics/geometry/rigid3.h"
#include "tests/support/run_hexcal.h"
#include "tests/support/sample_campaign.h"
#include "tools/io/campaign_file.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/pose_table.h"

// From photographs alone to poses, on the built program.

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const fs::path kInitSample = fs::path(HEXCAL_SOURCE) / "samples" / "small_lab";
const fs::path kInitRealSets = fs::path(HEXCAL_SOURCE) / "../shared/data/real";

// Squared error over covariance per parameter, after the rigid motion between the frame that hexcal chose and
// the truth's is taken out: rotations give its turn (Kabsch), then translations its shift.
double chi2_against_truth(const std::vector<PoseRecord>& measured, const std::vector<PoseRecord>& truth) {
  std::vector<Rigid3> ours;
  std::vector<Rigid3> theirs;
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
  const Rigid3 true_home = home_from_lg(*truth.front().pose);
  for (std::size_t i = 0; i < measured.size(); ++i) {
    ours.push_back(home_from_lg(*measured[i].pose));
    theirs.push_back(home_from_lg(*truth[i].pose) * inverse(true_home));
    cross += rotation_vector_from_quaternion(theirs.back().rotation) *
             rotation_vector_from_quaternion(ours.back().rotation).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Eigen::Matrix3d turn =
      svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
  // t_theirs = turn t_ours + (1 - R_theirs) shift.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < ours.size(); ++i) {
    const Eigen::Matrix3d j = Eigen::Matrix3d::Identity() - theirs[i].rotation_matrix();
    normal += j.transpose() * j;
    right += j.transpose() * (theirs[i].translation - turn * ours[i].translation);
  }
  const Rigid3 theirs_from_ours(turn, Eigen::Vector3d(normal.ldlt().solve(right)));
  double chi2 = 0;
  for (std::size_t i = 1; i < ours.size(); ++i) {
    const Pose in_ours = pose_from_home_from_lg(inverse(theirs_from_ours) * theirs[i] * theirs_from_ours);
    chi2 += (pose_error(*measured[i].pose, in_ours).array() / measured[i].sigma->array()).square().sum();
  }
  return chi2 / static_cast<double>(6 * ours.size() - 12);
}

TEST(Init, AMemoryCardBecomesPosesWithoutAHandWrittenLine) {
  const TemporaryFolder folder;
  const fs::path card = folder.path() / "card";
  fs::create_directories(card / "100D3200");
  for (const char* from : {"poses", "calibration"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kInitSample / from)) {
      if (entry.is_regular_file()) fs::copy(entry.path(), card / "100D3200" / entry.path().filename());
    }
  }
  fs::copy(kInitSample / "sheet.yaml", card / "sheet.yaml");  // hexcal template wrote it beside the PDF
  const CommandResult made = run_hexcal({"init", card.string(), "--marker-mm", "24"});
  ASSERT_EQ(made.exit_code, 0) << made.out << made.err;
  EXPECT_THAT(made.out, AllOf(HasSubstr("27 in 9 poses, 14 of a sheet"),
                              HasSubstr("fixed 0-9; moving 100-109"), HasSubstr("next: hexcal run")));
  const CommandResult run = run_hexcal({"run", card.string()});
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  const std::vector<PoseRecord> measured = read_pose_table(card / "results/poses.csv");
  const std::vector<PoseRecord> truth = read_pose_table(kInitSample / "truth/poses.csv");
  ASSERT_EQ(measured.size(), truth.size());
  for (const PoseRecord& pose : measured) EXPECT_EQ(pose.status, "ok") << pose.id;
  const double chi2 = chi2_against_truth(measured, truth);
  EXPECT_LT(chi2, 2) << "in sigmas squared";
  // The positions' sigmas hold the 0.1 % by which a print may be off; the sample's is exact. Angles know
  // nothing of it.
  EXPECT_GT(chi2, 0.1);
}

class InitWithCamera : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(lab_ / "poses");
    fs::copy(kInitSample / "camera.yaml", lab_);
    for (const char* pose : {"home", "p001", "p002"})
      fs::copy(kInitSample / "poses" / pose, lab_ / "poses" / pose);
  }
  [[nodiscard]] CommandResult init(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments{"init", lab_.string(), "--marker-mm", "24"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_hexcal(arguments);
  }
  TemporaryFolder folder_;
  fs::path lab_ = folder_.path() / "lab";
};

TEST_F(InitWithCamera, FoldersAreThePosesAndWhatIsThereStays) {
  ASSERT_EQ(init().exit_code, 0);
  const Campaign campaign = read_campaign(lab_);
  EXPECT_EQ(campaign.images, lab_ / "poses");
  EXPECT_FALSE(campaign.images_table);
  EXPECT_EQ(campaign.lg->home_pose, "home");
  EXPECT_EQ(campaign.moving.begin()->first, 100);
  EXPECT_EQ(read_pose_table(lab_ / "targets.csv").size(), 3U);
  EXPECT_EQ(run_hexcal({"measure", lab_.string()}).exit_code, 0);
  const std::string before = contents(lab_ / "campaign.yaml") + "# mine\n";
  std::ofstream(lab_ / "campaign.yaml") << before;
  const CommandResult again = init();
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.out, HasSubstr("campaign.yaml is there and stays as it is"));
  EXPECT_EQ(contents(lab_ / "campaign.yaml"), before);
}

TEST_F(InitWithCamera, PhotographsThatBelongToNothingAreNamed) {
  fs::rename(lab_ / "poses/p001/DSC_0004.jpg", lab_ / "poses/p002/DSC_0004.jpg");
  std::ofstream(lab_ / "poses/home/torn.jpg") << "no photograph";
  fs::create_directories(lab_ / "poses/p009");
  const CommandResult made = init();
  EXPECT_THAT(made.out,
              AllOf(HasSubstr("poses/p002/DSC_0004.jpg: does not show what the other photographs of p002"),
                    HasSubstr("poses/home/torn.jpg: "), HasSubstr("p009: a folder without photographs")));
  EXPECT_THAT(made.out, HasSubstr("fixed 0-9; moving 100-109"));
}

TEST_F(InitWithCamera, ASymmetricMachineIsWrittenFromSixNumbers) {
  const PlatformGeometry wanted = read_hexapod_file(kInitSample / "hexapod.yaml");
  const double pair = (wanted.base_joints_mm[0] - wanted.base_joints_mm[5]).norm();
  const double small_pair = (wanted.platform_joints_mm[0] - wanted.platform_joints_mm[1]).norm();
  ASSERT_EQ(init({"--gd-mm", "50", "--machine-mm", fmt::format("260,{},150,{},380,580", pair, small_pair)})
                .exit_code,
            0);
  const PlatformGeometry found = read_hexapod_file(lab_ / "hexapod.yaml");
  for (std::size_t leg = 0; leg < 6; ++leg) {
    EXPECT_LT((found.base_joints_mm[leg] - wanted.base_joints_mm[leg]).norm(), 1e-6) << leg;
    EXPECT_LT((found.platform_joints_mm[leg] - wanted.platform_joints_mm[leg]).norm(), 1e-6) << leg;
  }
  EXPECT_NEAR(leg_lengths(found, found.home_B_from_P()).mean(), 480, 1e-3);
  EXPECT_EQ(read_campaign(lab_).hexapod, lab_ / "hexapod.yaml");
}

TEST_F(InitWithCamera, JointsComeFromATableToo) {
  const PlatformGeometry wanted = read_hexapod_file(kInitSample / "hexapod.yaml");
  std::string table = "leg,body,x_mm,y_mm,z_mm\n";
  for (std::size_t leg = 0; leg < 6; ++leg) {
    for (const auto& [body, joint] : {std::pair{"base", wanted.base_joints_mm[leg]},
                                      std::pair{"platform", wanted.platform_joints_mm[leg]}})
      table += fmt::format("{},{},{},{},{}\n", leg + 1, body, joint.x(), joint.y(), joint.z());
  }
  const fs::path joints = folder_.path() / "joints.csv";
  std::ofstream(joints) << table;
  ASSERT_EQ(init({"--joints", joints.string(), "--leg-mm", "380,580"}).exit_code, 0);
  EXPECT_LT((read_hexapod_file(lab_ / "hexapod.yaml").base_joints_mm[3] - wanted.base_joints_mm[3]).norm(),
            1e-9);
  std::ofstream(joints) << table.substr(0, table.rfind("6,platform"));
  fs::remove(lab_ / "campaign.yaml");
  fs::remove(lab_ / "hexapod.yaml");
  const CommandResult short_table = init({"--joints", joints.string(), "--leg-mm", "380,580"});
  EXPECT_EQ(short_table.exit_code, 2);
  EXPECT_THAT(short_table.err, HasSubstr("11 joints, wanted 12"));
  EXPECT_FALSE(fs::exists(lab_ / "campaign.yaml"));
}

// UG from markers alone knows nothing of the machine's axes; the commanded poses do.
TEST_F(InitWithCamera, TargetsTellWhereTheFrameStands) {
  for (const char* pose : {"p003", "p004", "p005", "p006", "p007", "p008"})
    fs::copy(kInitSample / "poses" / pose, lab_ / "poses" / pose);
  fs::copy(kInitSample / "targets.csv", lab_);
  fs::copy(kInitSample / "hexapod.yaml", lab_);
  const CommandResult made = init();
  ASSERT_EQ(made.exit_code, 0) << made.out << made.err;
  EXPECT_THAT(made.out, HasSubstr("frame UG agrees best with targets.csv"));
  EXPECT_GT(rotation_distance(read_campaign(lab_).ug->markers_from_frame.rotation, Rigid3().rotation), 1);
  const CommandResult run = run_hexcal({"run", lab_.string()});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("* kinematic"), HasSubstr("to the controller")));
  const CommandResult again = init();
  EXPECT_THAT(again.out, HasSubstr("agrees best with the targets: UG: {from: markers, xyz_mm: ["));
}

// One number has no proposal; Enter takes the others.
TEST_F(InitWithCamera, AtATerminalThreeQuestionsAreAskedAtMost) {
  const fs::path out = folder_.path() / "out";
  fs::rename(lab_ / "poses/home", lab_ / "poses/p000");
  const std::string line = fmt::format("printf '24\\n\\n\\n' | script -qec '{} init {}' /dev/null >{} 2>&1",
                                       HEXCAL_BINARY, lab_.string(), out.string());
  ASSERT_EQ(std::system(line.c_str()), 0) << contents(out);
  const std::string said = contents(out);
  EXPECT_THAT(said, AllOf(HasSubstr("edge of the markers' black square on the grips, mm? "),
                          HasSubstr("ids on the grip that stands still [0-9]? "),
                          HasSubstr("pose that is the home [p000]? ")));
  EXPECT_EQ(std::count(said.begin(), said.end(), '?'), 3) << said;
  EXPECT_EQ(read_campaign(lab_).fixed.at(0), 24);
}

TEST(Init, AWordThatIsNoCommandIsToldWhichIsMeant) {
  const CommandResult bare = run_hexcal({});
  EXPECT_EQ(bare.exit_code, 2);
  EXPECT_THAT(bare.err, AllOf(HasSubstr("hexcal init FOLDER begins"), HasSubstr("measure")));
  const CommandResult misspelt = run_hexcal({"mesure", "lab"});
  EXPECT_EQ(misspelt.exit_code, 2);
  EXPECT_THAT(misspelt.err, HasSubstr("'mesure' is no command; did you mean measure?"));
  EXPECT_THAT(run_hexcal({"measure"}).err, HasSubstr("campaign is required"));
}

TEST(Init, BeginsFromNothingWithStickersToPrint) {
  const TemporaryFolder folder;
  const fs::path lab = folder.path() / "lab";
  const CommandResult made = run_hexcal({"init", lab.string(), "--marker-mm", "20"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  for (const char* name : {"markers.pdf", "markers.yaml", "sheet.pdf", "sheet.yaml", "targets.csv"})
    EXPECT_TRUE(fs::exists(lab / name)) << name;
  EXPECT_EQ(read_campaign(lab).moving.at(109), 20);
  EXPECT_EQ(run_hexcal({"init", lab.string()}).exit_code, 0);
}

TEST(Init, NonsenseIsOneLine) {
  const TemporaryFolder folder;
  const auto refused = [](const std::vector<std::string>& arguments, const std::string& words) {
    std::vector<std::string> all{"init"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const CommandResult result = run_hexcal(all);
    EXPECT_EQ(result.exit_code, 2) << result.out;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  };
  std::ofstream(folder.path() / "thesis.tex") << "text";
  refused({folder.path().string()}, "holds thesis.tex but no photograph");
  refused({(folder.path() / "thesis.tex").string()}, "is a file, wanted a folder");
  std::ofstream(folder.path() / "a.jpg") << "no photograph at all";
  refused({folder.path().string()}, "none of its 1 photographs can be read; a.jpg: ");
  refused({folder.path().string(), "--marker-mm", "4x"}, "--marker-mm: found '4x'");
  refused({folder.path().string(), "--fixed", "a"}, "--fixed: found 'a'");
  EXPECT_FALSE(fs::exists(folder.path() / "campaign.yaml"));
  EXPECT_FALSE(fs::exists(folder.path() / "results"));
}

// A board before a real camera: nothing moves on it, which is said and not guessed.
TEST(Init, ABoardOnWhichNothingMovesIsSaidToBeOne) {
  if (!fs::exists(kInitRealSets / "kuka3")) GTEST_SKIP() << "no public photographs beside the project";
  const TemporaryFolder folder;
  const fs::path lab = folder.path() / "lab";
  fs::create_directories(lab / "calibration");
  for (const char* name : {"01.png", "02.png", "03.png", "04.png", "10.png", "11.png", "12.png", "13.png"})
    fs::copy(kInitRealSets / "kuka3" / name, lab / "calibration" / name);
  std::ofstream(lab / "sheet.yaml") << "kind: charuco\ndictionary: DICT_5X5_250\ncolumns: 12\nrows: 9\n"
                                       "square_mm: 60\nmarker_mm: 47\nfirst_id: 0\n";
  const CommandResult camera = run_hexcal({"init", lab.string()});
  EXPECT_EQ(camera.exit_code, 1);  // no poses yet
  EXPECT_THAT(camera.out, HasSubstr("0 in 0 poses, 8 of a sheet"));
  ASSERT_TRUE(fs::exists(lab / "camera.yaml"));
  fs::remove(lab / "sheet.yaml");
  fs::create_directories(lab / "poses/a");
  fs::create_directories(lab / "poses/b");
  for (const char* name : {"01.png", "02.png", "03.png"})
    fs::rename(lab / "calibration" / name, lab / "poses/a" / name);
  for (const char* name : {"10.png", "11.png", "12.png"})
    fs::rename(lab / "calibration" / name, lab / "poses/b" / name);
  fs::remove_all(lab / "calibration");
  const CommandResult made = run_hexcal({"init", lab.string(), "--marker-mm", "46.7"});
  EXPECT_EQ(made.exit_code, 1);
  EXPECT_THAT(made.out, HasSubstr("cannot be told: the markers do not move against each other"));
  EXPECT_THAT(made.out, Not(HasSubstr("of another pose?")));
}

}  // namespace
}  // namespace hexcal
