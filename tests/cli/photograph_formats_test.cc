#include <gmock/gmock.h>

#include <exiv2/exiv2.hpp>
#include <functional>
#include <opencv2/imgcodecs.hpp>

#include "tests/support/run_hexcal.h"
#include "tests/support/sample_campaign.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

using Change = std::function<void(const fs::path& jpeg)>;

// Measures home and one pose of the sample campaign after a change of each photograph.
std::vector<PoseRecord> poses_after(const Change& change) {
  const TemporaryFolder folder;
  const fs::path lab = folder.path() / "lab";
  copy_sample_campaign(lab, {"home", "p001"});
  std::vector<fs::path> photographs;  // first: a change may put files beside them
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(lab / "poses"))
    if (entry.is_regular_file()) photographs.push_back(entry.path());
  for (const fs::path& photograph : photographs) change(photograph);
  const CommandResult result = run_hexcal({"measure", lab.string()});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  return read_pose_table(lab / "results" / "poses.csv");
}

const std::vector<PoseRecord>& poses_of_sample() {
  static const std::vector<PoseRecord> poses = poses_after([](const fs::path&) {});
  return poses;
}

void expect_same(const std::vector<PoseRecord>& poses, double sigmas) {
  const std::vector<PoseRecord>& wanted = poses_of_sample();
  ASSERT_EQ(poses.size(), wanted.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    ASSERT_TRUE(poses[i].pose && wanted[i].pose) << poses[i].id;
    ASSERT_TRUE(wanted[i].sigma) << poses[i].id;
    const Vector6d difference = pose_error(*poses[i].pose, *wanted[i].pose);
    for (int k = 0; k < 6; ++k) {
      // Home is zero by definition; the table is rounded.
      EXPECT_LE(std::abs(difference[k]), sigmas * (*wanted[i].sigma)[k] + 1e-8)
          << poses[i].id << " parameter " << k << " sigma " << (*wanted[i].sigma)[k];
    }
  }
}

void rewrite(const fs::path& jpeg, const char* extension, int flags, int depth) {
  cv::Mat image = cv::imread(jpeg.string(), flags | cv::IMREAD_IGNORE_ORIENTATION);
  ASSERT_FALSE(image.empty());
  if (depth == CV_16U) image.convertTo(image, CV_16U, 257);
  fs::remove(jpeg);
  ASSERT_TRUE(cv::imwrite(fs::path(jpeg).replace_extension(extension).string(), image,
                          {cv::IMWRITE_JPEG_QUALITY, 95}));
}

Change rewritten(const char* extension, int flags, int depth = CV_8U) {
  return [=](const fs::path& jpeg) { rewrite(jpeg, extension, flags, depth); };
}

TEST(PhotographFormats, ExifOrientationChangesNothing) {
  for (const int orientation : {6, 8}) {
    SCOPED_TRACE(orientation);
    expect_same(poses_after([orientation](const fs::path& jpeg) {
                  const auto image = Exiv2::ImageFactory::open(jpeg.string());
                  image->readMetadata();
                  image->exifData()["Exif.Image.Orientation"] = static_cast<std::uint16_t>(orientation);
                  image->writeMetadata();
                }),
                0);
  }
}

// Colour is another mixture of the channels and noise than the JPEG's own luminance; a second compression
// adds noise.
TEST(PhotographFormats, PngAndTiffGiveThePosesOfTheJpegToWithinNoise) {
  expect_same(poses_after(rewritten(".png", cv::IMREAD_COLOR)), 3);
  expect_same(poses_after(rewritten(".tiff", cv::IMREAD_COLOR)), 3);
  expect_same(poses_after(rewritten(".tiff", cv::IMREAD_COLOR, CV_16U)), 3);
}

TEST(PhotographFormats, GreyGivesThePosesOfColourToWithinNoise) {
  expect_same(poses_after(rewritten(".png", cv::IMREAD_GRAYSCALE)), 3);
  expect_same(poses_after(rewritten(".jpg", cv::IMREAD_GRAYSCALE)), 3);
}

}  // namespace
}  // namespace hexcal
