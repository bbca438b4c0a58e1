#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/faults/fault_campaign.h"
#include "tests/faults/image_variants.h"

// Photographs that cannot count: each is named with its reason, and the rest goes on.

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::AnyOf;
using ::testing::HasSubstr;

class Photographs : public ::testing::Test {
 protected:
  // The second photograph of p002 is spoilt; all poses must stay healthy and the words be in both places.
  void expect_left_out(const std::string& status, const std::string& words) const {
    const Outcome outcome = lab_.measure();
    FaultCampaign::expect_healthy(outcome, kAllPoses);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_EQ(outcome.pose("p002").images, 2);
    EXPECT_THAT(outcome.out, HasSubstr("DSC_0008.jpg: " + status));
    EXPECT_THAT(outcome.pose("p002").remarks, HasSubstr(words));
    EXPECT_THAT(contents(lab_.folder() / "results" / "photos.csv"), HasSubstr(status + ": "));
  }
  FaultCampaign lab_;
  fs::path spoilt_ = lab_.photographs("p002")[1];
};

TEST_F(Photographs, WithoutContent) {
  lab_.put(spoilt_, "");
  expect_left_out("unreadable", "the file has no content");
}

TEST_F(Photographs, Truncated) {
  const std::string bytes = contents(spoilt_);
  lab_.put(spoilt_, bytes.substr(0, bytes.size() / 2));
  expect_left_out("unreadable", "DSC_0008.jpg: ");
}

TEST_F(Photographs, OverwrittenInTheMiddle) {
  std::string bytes = contents(spoilt_);
  for (std::size_t i = bytes.size() / 3; i < bytes.size() / 2; ++i) bytes[i] = static_cast<char>(i * 7);
  lab_.put(spoilt_, bytes);
  const Outcome outcome = lab_.measure();
  // A decoder may not notice; then the markers must.
  FaultCampaign::expect_healthy(outcome, kAllPoses);
}

TEST_F(Photographs, TextUnderAPhotographsName) {
  lab_.put(spoilt_, "this is no photograph\n");
  expect_left_out("unreadable", "DSC_0008.jpg: ");
}

TEST_F(Photographs, ALinkToNothing) {
  fs::remove(spoilt_);
  fs::create_symlink("/nowhere/at/all.jpg", spoilt_);
  expect_left_out("unreadable", "no such file");
}

TEST_F(Photographs, AllOfAPoseUnreadable) {
  for (const fs::path& photograph : lab_.photographs("p002")) lab_.put(photograph, "");
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kButP002);
  FaultCampaign::expect_refused(outcome, "p002", "no_usable_photographs", "the file has no content");
}

TEST_F(Photographs, Black) {
  lab_.put(spoilt_, jpeg_with_tags(cv::Mat::zeros(pixels_of(contents(spoilt_)).size(), CV_8UC3), {}));
  expect_left_out("no_markers", "none of the campaign's markers");
}

TEST_F(Photographs, OfSomethingElse) {
  cv::Mat pixels = pixels_of(contents(spoilt_));
  pixels(cv::Rect(0, 0, pixels.cols, pixels.rows / 4))
      .copyTo(pixels(cv::Rect(0, pixels.rows / 2, pixels.cols, pixels.rows / 4)));
  cv::GaussianBlur(pixels, pixels, {}, 25);
  lab_.put(spoilt_, jpeg_with_tags(pixels, {}));
  expect_left_out("no_markers", "none of the campaign's markers");
}

TEST_F(Photographs, OfAnotherSize) {
  cv::Mat pixels;
  cv::resize(pixels_of(contents(spoilt_)), pixels, {}, 0.5, 0.5, cv::INTER_AREA);
  lab_.put(spoilt_, jpeg_with_tags(pixels, {}));
  expect_left_out("wrong_camera", "the camera file is for 640 x");
}

TEST_F(Photographs, TurnedByAViewer) {
  cv::Mat pixels;
  cv::rotate(pixels_of(contents(spoilt_)), pixels, cv::ROTATE_90_CLOCKWISE);
  lab_.put(spoilt_, jpeg_with_tags(pixels, {}));
  expect_left_out("wrong_camera", "the camera file is for 640 x");
}

TEST_F(Photographs, HeldUprightWithTheTagOnlyIsMeasured) {
  PhotographTags tags;
  tags.orientation = 6;
  lab_.put(spoilt_, jpeg_with_tags(pixels_of(contents(spoilt_)), tags));
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kAllPoses);
  EXPECT_EQ(outcome.pose("p002").images, 3);
}

TEST_F(Photographs, Mirrored) {
  cv::Mat pixels;
  cv::flip(pixels_of(contents(spoilt_)), pixels, 1);
  lab_.put(spoilt_, jpeg_with_tags(pixels, {}));
  expect_left_out("no_markers", "none of the campaign's markers");
}

TEST_F(Photographs, WithTheLensAtAnotherFocalLength) {
  PhotographTags tags;
  tags.focal_mm = 38;
  lab_.put(spoilt_, jpeg_with_tags(pixels_of(contents(spoilt_)), tags));
  expect_left_out("wrong_camera", "focal length: camera 35 mm, photograph 38 mm");
}

TEST_F(Photographs, AllWithTheLensAtAnotherFocalLengthRefusesThePose) {
  PhotographTags tags;
  tags.focal_mm = 38;
  for (const fs::path& photograph : lab_.photographs("p002"))
    lab_.put(photograph, jpeg_with_tags(pixels_of(contents(photograph)), tags));
  const Outcome outcome = lab_.measure();
  FaultCampaign::expect_healthy(outcome, kButP002);
  FaultCampaign::expect_refused(outcome, "p002", "no_usable_photographs", "focal length");
}

TEST_F(Photographs, Grey) {
  cv::Mat grey;
  cv::cvtColor(pixels_of(contents(spoilt_)), grey, cv::COLOR_BGR2GRAY);
  lab_.put(spoilt_, jpeg_with_tags(grey, {}));
  FaultCampaign::expect_healthy(lab_.measure(), kAllPoses);
}

TEST_F(Photographs, ShakenSoThatNoMarkerIsRead) {
  Shot shot = CleanCampaign::instance().shots("p002")[1];
  shot.blur_px = 9;
  lab_.put(spoilt_, shot);
  expect_left_out("no_markers", "none of the campaign's markers");
}

TEST_F(Photographs, SlightlyOutOfFocusCountsWithLessWeightOrNotAtAll) {
  Shot shot = CleanCampaign::instance().shots("p002")[1];
  shot.blur_px = 2.5;
  lab_.put(spoilt_, shot);
  FaultCampaign::expect_healthy(lab_.measure(), kAllPoses);
}

TEST_F(Photographs, AreNeverWrittenTo) {
  for (const fs::path& photograph : lab_.photographs("p001"))
    fs::permissions(photograph, fs::perms::owner_read | fs::perms::group_read);
  FaultCampaign::expect_healthy(lab_.measure({"--no-cache", "--overlays"}), kAllPoses);
  EXPECT_TRUE(CleanCampaign::instance().photographs_untouched());
}

}  // namespace
}  // namespace hexcal
