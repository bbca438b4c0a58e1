#include "pose_extract/image_folders.h"

#include <gmock/gmock.h>

#include <fstream>

#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class ImageFolders : public ::testing::Test {
 protected:
  void SetUp() override {
    root_ = std::filesystem::path(::testing::TempDir()) /
            ("folders_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::remove_all(root_);
    std::filesystem::create_directories(root_);
  }
  void touch(const std::string& name) const {
    std::filesystem::create_directories((root_ / name).parent_path());
    std::ofstream(root_ / name) << "x";
  }
  [[nodiscard]] static std::vector<std::string> names(const ImageListing& listing) {
    std::vector<std::string> all;
    for (const CampaignImage& image : listing.images) all.push_back(image.pose + "|" + image.name);
    return all;
  }
  std::filesystem::path root_;
};

TEST_F(ImageFolders, OneFolderPerPoseInNaturalOrderAnyCase) {
  for (const char* name : {"p10/b.JPG", "p2/IMG_10.jpeg", "p2/IMG_9.JPEG", "home/a.Tif"}) touch(name);
  const ImageListing listing = list_images(root_, {});
  EXPECT_THAT(listing.poses, ElementsAre("home", "p2", "p10"));
  EXPECT_THAT(names(listing),
              ElementsAre("home|home/a.Tif", "p2|p2/IMG_9.JPEG", "p2|p2/IMG_10.jpeg", "p10|p10/b.JPG"));
  EXPECT_THAT(listing.skipped, IsEmpty());
}

TEST_F(ImageFolders, LitterIsPassedOverAndOtherFilesIgnored) {
  for (const char* name : {"p1/a.jpg", "p1/.DS_Store", "p1/Thumbs.db", "p1/._a.jpg", "p1/notes.txt",
                           "p1/thumbnails/a.jpg", "__MACOSX/p1/a.jpg"}) {
    touch(name);
  }
  EXPECT_THAT(names(list_images(root_, {})), ElementsAre("p1|p1/a.jpg"));
}

TEST_F(ImageFolders, JpegIsPreferredToRawOfTheSameName) {
  for (const char* name : {"p1/DSC_1.JPG", "p1/DSC_1.NEF", "p1/DSC_2.nef"}) touch(name);
  const ImageListing listing = list_images(root_, {});
  EXPECT_THAT(names(listing), ElementsAre("p1|p1/DSC_1.JPG", "p1|p1/DSC_2.nef"));
  ASSERT_EQ(listing.skipped.size(), 1U);
  EXPECT_EQ(listing.skipped[0].name, "p1/DSC_1.NEF");
}

TEST_F(ImageFolders, StrayPhotographIsNamed) {
  touch("p1/a.jpg");
  touch("oops.jpg");
  const ImageListing listing = list_images(root_, {});
  EXPECT_THAT(names(listing), ElementsAre("p1|p1/a.jpg"));
  ASSERT_EQ(listing.skipped.size(), 1U);
  EXPECT_THAT(listing.skipped[0].reason, ::testing::HasSubstr("stray"));
}

TEST_F(ImageFolders, AnyNestingAndSameNamesKeepApart) {
  for (const char* name : {"monday/p1/a.jpg", "tuesday/p1/a.jpg", "tuesday/p2/a.jpg"}) touch(name);
  EXPECT_THAT(list_images(root_, {}).poses, ElementsAre("monday/p1", "p2", "tuesday/p1"));
}

TEST_F(ImageFolders, AFolderOfPhotographsIsOnePose) {
  touch("a.jpg");
  EXPECT_EQ(list_images(root_, {}).images.at(0).pose, root_.filename().string());
}

TEST_F(ImageFolders, CameraFoldersAreNotPoses) {
  for (const char* name : {"p1/left/a.jpg", "p1/right/a.jpg", "p2/left/a.jpg"}) touch(name);
  const ImageListing listing = list_images(root_, {{"left", "right"}, {}});
  EXPECT_THAT(listing.poses, ElementsAre("p1", "p2"));
  EXPECT_EQ(listing.images.at(1).folder, "right");
}

TEST_F(ImageFolders, EmptyPoseFolderStaysInTheList) {
  touch("p1/a.jpg");
  std::filesystem::create_directories(root_ / "p2");
  EXPECT_THAT(list_images(root_, {}).poses, ElementsAre("p1", "p2"));
}

TEST_F(ImageFolders, FlatFolderWithATable) {
  for (const char* name : {"a.jpg", "b.jpg", "c.jpg"}) touch(name);
  const ImageListing listing = list_images(root_, {{}, {{"b.jpg", "home"}, {"a.jpg", "p1"}}});
  EXPECT_THAT(names(listing), ElementsAre("home|b.jpg", "p1|a.jpg"));
  EXPECT_EQ(listing.skipped.at(0).name, "c.jpg");
}

TEST_F(ImageFolders, ThumbnailsByNameAndFilesNamedTwiceAreSkippedWithWords) {
  for (const char* name : {"p1/a.jpg", "p1/a_Thumb.jpg"}) touch(name);
  const ImageListing folders = list_images(root_, {});
  EXPECT_THAT(names(folders), ElementsAre("p1|p1/a.jpg"));
  ASSERT_EQ(folders.skipped.size(), 1U);
  EXPECT_EQ(folders.skipped[0].name, "p1/a_Thumb.jpg");
  EXPECT_EQ(folders.skipped[0].reason, "a thumbnail by its name");
  touch("b.jpg");
  const ImageListing table = list_images(root_, {{}, {{"b.jpg", "home"}, {"B.JPG", "p1"}}});
  EXPECT_THAT(names(table), ElementsAre("home|b.jpg"));
  ASSERT_EQ(table.skipped.size(), 1U);
  EXPECT_EQ(table.skipped[0].name, "b.jpg");
  EXPECT_EQ(table.skipped[0].reason, "named twice in the table of images; not taken for pose p1");
}

TEST_F(ImageFolders, AFileOfTheTableThatIsMissingIsListedForItsStatusToSaySo) {
  touch("a.jpg");
  const ImageListing listing = list_images(root_, {{}, {{"missing.jpg", "home"}, {"A.JPG", "p1"}}});
  EXPECT_THAT(names(listing), ElementsAre("home|missing.jpg", "p1|a.jpg"));
}

TEST_F(ImageFolders, CameraFoldersMayStandAboveThePoses) {
  for (const char* name : {"left/p1/a.jpg", "right/p1/a.jpg", "left/p2/a.jpg"}) touch(name);
  const ImageListing listing = list_images(root_, {{"left", "right"}, {}});
  EXPECT_THAT(names(listing), ElementsAre("p1|left/p1/a.jpg", "p1|right/p1/a.jpg", "p2|left/p2/a.jpg"));
}

TEST_F(ImageFolders, FormatFoldersBelongToTheirPoseAndOneFormatIsTaken) {
  for (const char* name : {"p1/JPG/a.jpg", "p1/RAW/a.nef", "p1/RAW/b.nef", "p2/a.tif", "p2/a.png"})
    touch(name);
  const ImageListing listing = list_images(root_, {});
  EXPECT_THAT(names(listing), ElementsAre("p1|p1/JPG/a.jpg", "p1|p1/RAW/b.nef", "p2|p2/a.tif"));
  EXPECT_EQ(listing.skipped.size(), 2U);
}

TEST_F(ImageFolders, OneHeapIgnoresFoldersAndKeepsNumbersOfTheCardsFoldersApart) {
  for (const char* name : {"100NCD/DSC_1.JPG", "101NCD/DSC_1.JPG", "101NCD/DSC_1.NEF"}) touch(name);
  ListingOptions options;
  options.one_heap = true;
  EXPECT_EQ(list_images(root_, options).images.size(), 2U);
}

TEST_F(ImageFolders, MissingFolderIsTheUsersError) {
  EXPECT_THROW((void)list_images(root_ / "nowhere", {}), InputError);
}

}  // namespace
}  // namespace hexcal
