#include "tools/io/observations_file.h"

#include <gmock/gmock.h>

#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

using ::testing::HasSubstr;

DetectionSet example_set() {
  DetectionSet set{"tag36h11", "abc", {}};
  PhotographObservations photograph;
  photograph.name = "home, \"first\".jpg";
  photograph.sha256 = "0123";
  photograph.status = PhotographStatus::ok;
  photograph.info.width_px = 6016;
  photograph.info.height_px = 4000;
  photograph.info.model = "NIKON D3200";
  photograph.info.focal_length_mm = 35.0;
  photograph.info.vibration_reduction = false;
  MarkerObservation marker;
  marker.id = 7;
  marker.status = MarkerStatus::ok;
  marker.method = MarkerMethod::edges;
  for (int i = 0; i < 4; ++i) marker.corners_px[static_cast<std::size_t>(i)] = {100.0 / 3 + i, 0.1 * i};
  marker.covariance_px2.setIdentity();
  marker.covariance_px2(3, 1) = marker.covariance_px2(1, 3) = 1e-5 / 3;
  marker.chi2_per_dof = 1.0 / 7;
  photograph.markers.push_back(marker);
  set.photographs.push_back(photograph);
  PhotographObservations bad;
  bad.name = "cut.jpg";
  bad.status = PhotographStatus::truncated;
  bad.reason = "Premature end of JPEG file";
  set.photographs.push_back(bad);
  return set;
}

TEST(ObservationsFile, ReadingGivesBackEveryBit) {
  const std::string text = observations_text(example_set(), "# made by a test\n");
  const DetectionSet set = parse_observations(text, "observations.txt");
  EXPECT_EQ(observations_text(set, "# made by a test\n"), text);
  ASSERT_EQ(set.photographs.size(), 2U);
  EXPECT_EQ(set.photographs[0].name, "home, \"first\".jpg");
  EXPECT_EQ(set.photographs[0].markers[0].corners_px[2].x(), 100.0 / 3 + 2);
  EXPECT_EQ(set.photographs[0].markers[0].method, MarkerMethod::edges);
  EXPECT_EQ(set.photographs[0].markers[0].covariance_px2,
            example_set().photographs[0].markers[0].covariance_px2);
  EXPECT_EQ(set.photographs[1].status, PhotographStatus::truncated);
  EXPECT_TRUE(set.photographs[1].markers.empty());
  EXPECT_FALSE(set.photographs[0].info.serial.has_value());
}

TEST(ObservationsFile, NamesTheLineOfAFault) {
  const auto error_of = [](const std::string& text) -> std::string {
    try {
      (void)parse_observations(text, "o.txt");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(error_of("x,y\n"), HasSubstr("not a file of marker observations"));
  EXPECT_THAT(error_of("observations,9,tag36h11,\n"), HasSubstr("o.txt:1: found version 9, wanted 1"));
  EXPECT_THAT(error_of("# c\nobservations,1,tag36h11,\nmarker,1\n"), HasSubstr("o.txt:3: a marker before"));
  std::string text = observations_text(example_set());
  text.replace(text.find("marker,7,ok"), 11, "marker,7,odd");
  EXPECT_THAT(error_of(text), HasSubstr("found status 'odd', which is none"));
  EXPECT_THAT(error_of("observations,1,tag36h11,\nphotograph,\"a\n"), HasSubstr("a quote is not closed"));
}

}  // namespace
}  // namespace hexcal
