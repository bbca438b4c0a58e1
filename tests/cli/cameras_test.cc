#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/support/run_hexcal.h"
#include "tests/support/sample_campaign.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kShiftPx = 40;

// Home and two poses of the sample campaign, of which the last photograph of each pose was taken by a second
// camera, told apart by its folder: its principal point lies elsewhere.
class CamerasByFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    copy_sample_campaign(lab_, {"home", "p001", "p002"});
    const std::string camera = contents(lab_ / "camera.yaml");
    write("right.yaml", replaced(camera, "cx_px: 751.5088508290532",
                                 fmt::format("cx_px: {}", 751.5088508290532 - kShiftPx)));
    write("campaign.yaml", replaced(contents(lab_ / "campaign.yaml"), "camera: camera.yaml",
                                    "camera:\n  - {file: camera.yaml, folder: left}\n"
                                    "  - {file: right.yaml, folder: right}"));
    for (const fs::directory_entry& pose : fs::directory_iterator(lab_ / "poses")) {
      std::vector<fs::path> photographs;
      for (const fs::directory_entry& file : fs::directory_iterator(pose)) photographs.push_back(file);
      std::sort(photographs.begin(), photographs.end());
      for (const char* folder : {"left", "right"}) fs::create_directory(pose.path() / folder);
      shift(photographs.back(), pose.path() / "right" / photographs.back().filename());
      photographs.pop_back();
      for (const fs::path& file : photographs) fs::rename(file, pose.path() / "left" / file.filename());
    }
  }

  static std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    if (at == std::string::npos) throw std::runtime_error("the sample no longer has: " + from);
    return text.replace(at, from.size(), to);
  }

  static void shift(const fs::path& from, const fs::path& to) {
    const cv::Mat image = cv::imread(from.string(), cv::IMREAD_GRAYSCALE);
    cv::Mat out(image.size(), image.type(), cv::Scalar(128));
    image.colRange(kShiftPx, image.cols).copyTo(out.colRange(0, image.cols - kShiftPx));
    cv::imwrite(to.string(), out, {cv::IMWRITE_JPEG_QUALITY, 100});
    fs::remove(from);
  }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(lab_ / name, std::ios::binary) << text;
  }

  [[nodiscard]] std::vector<PoseRecord> poses() const { return read_pose_table(lab_ / "results/poses.csv"); }

  TemporaryFolder folder_;
  fs::path lab_ = folder_.path() / "lab";
};

void expect_same(const std::vector<PoseRecord>& a, const std::vector<PoseRecord>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].id, b[i].id);
    ASSERT_TRUE(a[i].pose && b[i].pose) << a[i].status << " / " << b[i].status;
    EXPECT_EQ(a[i].pose->vector(), b[i].pose->vector()) << a[i].id;
  }
}

TEST_F(CamerasByFolder, PhotographsObservationsAndWatchGiveTheSamePoses) {
  const CommandResult measured = run_hexcal({"measure", lab_.string()});
  ASSERT_EQ(measured.exit_code, 0) << measured.out << measured.err;
  const std::vector<PoseRecord> by_photographs = poses();
  for (const PoseRecord& truth :
       read_pose_table(fs::path(HEXCAL_SOURCE) / "samples/small_lab/truth/poses.csv")) {
    for (const PoseRecord& pose : by_photographs) {
      if (pose.id != truth.id) continue;
      EXPECT_LE((pose.pose->position_mm - truth.pose->position_mm).norm(), 0.05) << pose.id;
    }
  }
  fs::rename(lab_ / "results/observations.txt", lab_ / "observations.txt");
  fs::remove_all(lab_ / "results");
  const std::string observations = (lab_ / "observations.txt").string();
  ASSERT_EQ(run_hexcal({"measure", lab_.string(), "--observations", observations}).exit_code, 0);
  expect_same(poses(), by_photographs);
  fs::remove_all(lab_ / "results");
  ASSERT_EQ(run_hexcal({"watch", lab_.string(), "--stop-after", "1"}).exit_code, 0);
  expect_same(poses(), by_photographs);
}

TEST_F(CamerasByFolder, ACameraThatSuitsNoPhotographEndsEveryCommandAndNothingIsWritten) {
  ASSERT_EQ(run_hexcal({"measure", lab_.string()}).exit_code, 0);
  fs::rename(lab_ / "results/observations.txt", lab_ / "observations.txt");
  fs::remove_all(lab_ / "results");
  for (const char* file : {"camera.yaml", "right.yaml"})
    write(file, replaced(contents(lab_ / file), "image_size_px: [1504", "image_size_px: [1500"));
  const std::string lab = lab_.string();
  const std::vector<std::vector<std::string>> commands{
      {"measure", lab},
      {"measure", lab, "--observations", (lab_ / "observations.txt").string()},
      {"measure", lab, "--dry-run"},
      {"check", lab},
      {"run", lab},
      {"watch", lab, "--stop-after", "1"}};
  for (const std::vector<std::string>& command : commands) {
    const CommandResult result = run_hexcal(command);
    EXPECT_EQ(result.exit_code, 2) << command.front() << ": " << result.out << result.err;
    EXPECT_THAT(result.err, HasSubstr("none of the 9 photographs suits a camera file")) << command.front();
    for (const char* file : {"poses.csv", "quality.json", "observations.txt", "report.html"})
      EXPECT_FALSE(fs::exists(lab_ / "results" / file)) << command.front() << " wrote " << file;
  }
}

TEST(CameraLibrary, ListsItsFilesWithTheirSettings) {
  const TemporaryFolder folder;
  const fs::path library = folder.path() / "cameras";
  EXPECT_EQ(run_hexcal({"camera", "--library", library.string(), "--list"}).exit_code, 2);
  fs::create_directories(library);
  EXPECT_THAT(run_hexcal({"camera", "--library", library.string(), "--list"}).err,
              ::testing::HasSubstr("holds no camera file"));
  fs::copy(fs::path(HEXCAL_SOURCE) / "samples/small_lab/camera.yaml", library / "a.yaml");
  const CommandResult listed = run_hexcal({"camera", "--library", library.string(), "--list"});
  EXPECT_EQ(listed.exit_code, 0) << listed.err;
  EXPECT_THAT(listed.out, ::testing::ContainsRegex("a.yaml +NIKON D3200 +35 .*1504 x "));
  std::ofstream(library / "b.yaml") << "kind: aprilgrid\n";
  const CommandResult json = run_hexcal({"camera", "--library", library.string(), "--list", "--json"});
  EXPECT_EQ(json.exit_code, 1);
  const auto parsed = nlohmann::json::parse(json.out);
  EXPECT_EQ(parsed[0]["focal_length_mm"], 35);
  EXPECT_THAT(parsed[1]["error"].get<std::string>(), ::testing::HasSubstr("b.yaml"));
  EXPECT_EQ(run_hexcal({"camera", "--list"}).exit_code, 2);
}

}  // namespace
}  // namespace hexcal
