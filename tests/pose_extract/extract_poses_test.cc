#include "pose_extract/extract_poses.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <map>

#include "kinematics/geometry/input_error.h"
#include "pose_extract/pose_verdict.h"
#include "tests/support/campaign_scene.h"
#include "tests/support/error_matchers.h"

namespace hexcal {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

MATCHER_P(Says, words, "") {
  *result_listener << finding_text(arg);
  return finding_text(arg).find(words) != std::string::npos;
}

// A campaign on which each test plays one fault; healthy poses must stay within twice their clean error.
class ExtractPoses : public ::testing::Test {
 protected:
  static constexpr double kCleanErrorMm = 0.003;  // worst of seven poses at 0.01 px noise

  void SetUp() override {
    ObservationSceneOptions options;
    options.num_epochs = 5;
    options.noise_px = 0.01;
    made_ = make_campaign_scene(options);
  }
  [[nodiscard]] std::vector<std::size_t> photographs_of(const std::string& pose) const {
    std::vector<std::size_t> found;
    for (std::size_t p = 0; p < made_.observations.photographs.size(); ++p) {
      if (made_.observations.photographs[p].pose == pose) found.push_back(p);
    }
    return found;
  }
  PhotographObservations& seen(const std::string& pose, std::size_t index) {
    return made_.observations.photographs[photographs_of(pose).at(index)].seen;
  }
  // The moving markers of a photograph as they would be seen in another pose.
  void show_moving_markers_of(std::size_t epoch, const std::string& pose, std::size_t index) {
    const std::size_t p = photographs_of(pose).at(index);
    const ObservationScene& scene = made_.scene;
    for (MarkerObservation& marker : made_.observations.photographs[p].seen.markers) {
      if (marker.id < 100) continue;
      Vector8d px;
      ASSERT_TRUE(
          project_drawn({scene.true_camera, scene.camera_from_fixed[p], &scene.fixed_from_moving[epoch],
                         scene.body_from_marker[static_cast<std::size_t>(marker.id) - 90]},
                        scene.network.features[0], px, nullptr));
      for (int c = 0; c < 4; ++c) marker.corners_px[static_cast<std::size_t>(c)] = px.segment<2>(2 * c);
    }
  }
  CampaignResult extract() {
    CampaignResult result = extract_poses(made_.campaign, made_.observations);
    EXPECT_LT(worst_error_mm(made_, result), 2 * kCleanErrorMm);
    return result;
  }
  static const MeasuredPose& pose(const CampaignResult& result, const std::string& id) {
    for (const MeasuredPose& measured : result.poses) {
      if (measured.id == id) return measured;
    }
    throw std::runtime_error("no pose " + id);
  }
  static void expect_others_ok(const CampaignResult& result, const std::string& faulty) {
    for (const MeasuredPose& measured : result.poses) {
      if (measured.id == faulty) continue;
      EXPECT_EQ(measured.status, PoseStatus::ok) << measured.id << ": " << measured.words;
    }
  }
  CampaignScene made_;
};

TEST_F(ExtractPoses, CleanCampaignGivesEveryPoseAndHomeIsZero) {
  const CampaignResult result = extract();
  expect_others_ok(result, "");
  EXPECT_LT(worst_error_mm(made_, result), kCleanErrorMm);
  EXPECT_EQ(pose(result, "home").pose->vector().norm(), 0);
  EXPECT_EQ(pose(result, "home").covariance.norm(), 0);
  EXPECT_GT(pose(result, "p01").covariance(0, 0), 0);
  EXPECT_EQ(pose(result, "p01").images, 3);
  EXPECT_EQ(pose(result, "p01").markers, 10);
  EXPECT_GT(pose(result, "p01").intersection_deg, 20);
  EXPECT_TRUE(result.findings.empty()) << result.findings.front().cause;
  EXPECT_EQ(overall_verdict(result), Severity::good);
}

TEST_F(ExtractPoses, NoiseFreeCampaignIsExact) {
  ObservationSceneOptions options;
  options.num_epochs = 3;
  made_ = make_campaign_scene(options);
  const CampaignResult result = extract();
  EXPECT_LT(worst_error_mm(made_, result), 1e-7);
}

TEST_F(ExtractPoses, PoseCovariancesAreHonestAndCorrelatedThroughHome) {
  double sum = 0;
  int count = 0;
  double correlation = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    ObservationSceneOptions options;
    options.num_epochs = 5;
    options.noise_px = 0.01;
    options.interior_sigma = 1;
    options.seed = seed;
    const CampaignScene made = make_campaign_scene(options);
    const CampaignResult result = extract_poses(made.campaign, made.observations);
    for (std::size_t e = 1; e < 5; ++e) {
      ASSERT_TRUE(result.poses[e].pose) << result.poses[e].words;
      const Vector6d error = pose_error(*result.poses[e].pose, true_pose(made, e));
      sum += error.dot(result.poses[e].covariance.ldlt().solve(error)) / 6;
      ++count;
    }
    const Matrix6d cross = result.pose_covariance(1, 2);
    correlation +=
        cross(0, 0) / std::sqrt(result.poses[1].covariance(0, 0) * result.poses[2].covariance(0, 0)) / 8;
  }
  EXPECT_GT(sum / count, 0.7);
  EXPECT_LT(sum / count, 1.4);
  EXPECT_GT(correlation, 0.2);  // both carry the home pose's noise
}

// UG from the markers alone is another frame on the same body: motions agree up to that one turn, and the
// covariances are as honest.
TEST_F(ExtractPoses, UgFromMarkersNeedsNoCoordinates) {
  double sum = 0;
  int count = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    ObservationSceneOptions options;
    options.num_epochs = 5;
    options.noise_px = 0.01;
    options.interior_sigma = 1;
    options.seed = seed;
    CampaignScene made = make_campaign_scene(options);
    made.campaign.ug->from = FrameRule::From::markers;
    const Rigid3 markers_from_frame =
        seed % 2 == 0 ? Rigid3() : Rigid3(quaternion_from_rpy({0.1, -0.2, 1.5}), {5, -3, 8});
    made.campaign.ug->markers_from_frame = markers_from_frame;
    const CampaignResult result = extract_poses(made.campaign, made.observations);
    ASSERT_TRUE(result.UG.ok) << result.UG.reason;
    // The same frame from the true geometry.
    Eigen::Vector3d fixed = Eigen::Vector3d::Zero();
    Eigen::Vector3d moving = Eigen::Vector3d::Zero();
    Eigen::Vector3d facing = Eigen::Vector3d::Zero();
    for (std::size_t m = 0; m < 20; ++m) {
      const Rigid3& marker = made.scene.body_from_marker[m];
      if (m < 10) {
        fixed += marker.translation / 10;
        facing += marker.rotation_matrix().col(2);
      } else {
        moving += made.scene.fixed_from_moving[0] * marker.translation / 10;
      }
    }
    Eigen::Matrix3d axes;
    axes.col(2) = (fixed - moving).normalized();
    axes.col(0) = axes.col(2).cross(facing).normalized();
    axes.col(1) = axes.col(2).cross(axes.col(0));
    EXPECT_LT(axes.col(1).dot(facing), 0);  // the markers face -y
    const Rigid3 ug_from_fixed = inverse(markers_from_frame) * inverse(Rigid3(axes, fixed));
    for (std::size_t e = 1; e < 5; ++e) {
      ASSERT_TRUE(result.poses[e].pose) << result.poses[e].words;
      const auto in_ug = [&](std::size_t epoch) {
        return ug_from_fixed * made.scene.fixed_from_moving[epoch];
      };
      const Pose truth = pose_from_ug_from_lg(in_ug(e) * inverse(in_ug(0)) * ug_from_lg(Pose(), 50), 50);
      const Vector6d error = pose_error(*result.poses[e].pose, truth);
      EXPECT_LT(error.head<3>().norm(), 2 * kCleanErrorMm) << "seed " << seed;
      sum += error.dot(result.poses[e].covariance.ldlt().solve(error)) / 6;
      ++count;
    }
  }
  EXPECT_GT(sum / count, 0.7);
  EXPECT_LT(sum / count, 1.4);
}

// LG turned on its body so that p01 stands at just this rotation.
void turn_lower_grip(CampaignScene& made, const Eigen::Quaterniond& rotation_of_p01) {
  const Rigid3 LG_from_moving(rotation_of_p01.conjugate() * made.scene.fixed_from_moving[1].rotation,
                              Eigen::Vector3d(3, -2, 1));
  FrameRule lg;
  lg.gd_mm = 50;
  for (std::size_t m = 0; m < made.scene.network.features.size(); ++m) {
    const NetworkFeature& marker = made.scene.network.features[m];
    if (marker.body == kReferenceBody) continue;
    const Rigid3 LG_from_marker = LG_from_moving * made.scene.body_from_marker[m];
    for (int c = 0; c < 4; ++c)
      lg.nominal.push_back({{marker.id, c}, LG_from_marker * made.scene.printed_points(m).col(c), 0.001});
  }
  made.campaign.lg = lg;
}

TEST_F(ExtractPoses, AtEveryPitchTheErrorsAreWithinTheirSigmasOrThePoseIsSuspect) {
  for (const double degrees : {89.5, 90.0, 180.0, 270.0}) {
    const Pose stated{{}, {0.3, degrees * kRadPerDeg, -0.7}};
    double sum = 0;
    int count = 0;
    for (unsigned seed = 1; seed <= 3; ++seed) {
      ObservationSceneOptions options;
      options.num_epochs = 2;
      options.noise_px = 0.01;
      options.seed = seed;
      made_ = make_campaign_scene(options);
      turn_lower_grip(made_, quaternion_from_rpy(stated.rpy_rad));
      const CampaignResult result = extract_poses(made_.campaign, made_.observations);
      const MeasuredPose& measured = pose(result, "p01");
      ASSERT_TRUE(measured.pose) << measured.words;
      EXPECT_TRUE(measured.covariance.allFinite());
      EXPECT_LE(
          rotation_distance(quaternion_from_rpy(measured.pose->rpy_rad), quaternion_from_rpy(stated.rpy_rad)),
          1e-3);
      const bool at_pole = degrees == 90.0 || degrees == 270.0;
      EXPECT_EQ(measured.status, at_pole ? PoseStatus::suspect : PoseStatus::ok) << degrees;
      EXPECT_EQ(measured.words.find("roll and yaw turn about one axis") != std::string::npos, at_pole);
      if (at_pole) continue;
      const Vector6d error = pose_error(*measured.pose, stated);
      sum += error.tail<3>().dot(measured.covariance.bottomRightCorner<3, 3>().ldlt().solve(error.tail<3>()));
      count += 3;
    }
    if (count == 0) continue;
    EXPECT_GT(sum / count, 0.12) << degrees;  // chi2 of 9 numbers: within these in 998 of 1000
    EXPECT_LT(sum / count, 3.1) << degrees;
  }
}

TEST_F(ExtractPoses, UnreadablePhotographIsNamedAndItsPoseGoesOn) {
  seen("p02", 1).status = PhotographStatus::truncated;
  seen("p02", 1).reason = "ends after 40 of 100 kB";
  seen("p02", 1).markers.clear();
  const CampaignResult result = extract();
  expect_others_ok(result, "");
  EXPECT_EQ(pose(result, "p02").images, 2);
  EXPECT_THAT(pose(result, "p02").words, HasSubstr("ends after 40"));
  EXPECT_EQ(result.photographs[photographs_of("p02")[1]].status, PhotoStatus::unreadable);
}

TEST_F(ExtractPoses, AllPhotographsOfAPoseUnreadable) {
  for (std::size_t i = 0; i < 3; ++i) {
    seen("p02", i).status = PhotographStatus::empty;
    seen("p02", i).markers.clear();
  }
  const CampaignResult result = extract();
  expect_others_ok(result, "p02");
  EXPECT_EQ(pose(result, "p02").status, PoseStatus::no_usable_photographs);
  EXPECT_FALSE(pose(result, "p02").pose);
}

TEST_F(ExtractPoses, EmptyPoseFolder) {
  made_.observations.poses.push_back("p99");
  const CampaignResult result = extract_poses(made_.campaign, made_.observations);
  expect_others_ok(result, "p99");
  EXPECT_EQ(pose(result, "p99").status, PoseStatus::no_photographs);
}

TEST_F(ExtractPoses, OnePhotographGivesAPoseWithALargerSigma) {
  const double sigma = pose(extract(), "p03").covariance(0, 0);
  made_.observations.photographs.erase(made_.observations.photographs.begin() +
                                       static_cast<std::ptrdiff_t>(photographs_of("p03")[2]));
  made_.observations.photographs.erase(made_.observations.photographs.begin() +
                                       static_cast<std::ptrdiff_t>(photographs_of("p03")[0]));
  const CampaignResult result = extract_poses(made_.campaign, made_.observations);
  EXPECT_EQ(pose(result, "p03").status, PoseStatus::ok);
  EXPECT_THAT(pose(result, "p03").words, HasSubstr("one photograph only"));
  EXPECT_GT(pose(result, "p03").covariance.trace(), 2 * sigma);
  const Vector6d error = pose_error(*pose(result, "p03").pose, true_pose(made_, 3));
  EXPECT_LT(error.dot(pose(result, "p03").covariance.ldlt().solve(error)), 30);
}

TEST_F(ExtractPoses, PhotographOfAnotherSizeIsRefused) {
  seen("p01", 0).info.width_px = 3008;
  seen("p01", 0).info.height_px = 2000;
  const CampaignResult result = extract();
  EXPECT_EQ(result.photographs[photographs_of("p01")[0]].status, PhotoStatus::wrong_camera);
  EXPECT_THAT(result.photographs[photographs_of("p01")[0]].words, HasSubstr("3008 x 2000"));
  EXPECT_EQ(pose(result, "p01").images, 2);
}

TEST_F(ExtractPoses, PhotographOfAnotherFocalLengthIsRefused) {
  seen("p01", 2).info.focal_length_mm = 50;
  const CampaignResult result = extract();
  EXPECT_EQ(result.photographs[photographs_of("p01")[2]].status, PhotoStatus::wrong_camera);
  EXPECT_THAT(result.photographs[photographs_of("p01")[2]].words, HasSubstr("focal length"));
}

TEST_F(ExtractPoses, PhotographWithoutACameraFileIsRefused) {
  made_.observations.photographs[photographs_of("p01")[2]].camera = -1;
  const CampaignResult result = extract();
  EXPECT_EQ(result.photographs[photographs_of("p01")[2]].status, PhotoStatus::wrong_camera);
}

TEST_F(ExtractPoses, SamePhotographTwiceInAPoseCountsOnce) {
  CampaignPhotograph copy = made_.observations.photographs[photographs_of("p01")[0]];
  copy.seen.name = "p01/copy.JPG";
  made_.observations.photographs.push_back(copy);
  const CampaignResult result = extract();
  EXPECT_EQ(pose(result, "p01").images, 3);
  EXPECT_EQ(result.photographs.back().status, PhotoStatus::duplicate);
  EXPECT_THAT(result.photographs.back().words, HasSubstr("IMG_0003"));
}

TEST_F(ExtractPoses, PoseWithThePhotographsOfHomeIsRefused) {
  for (std::size_t i = 0; i < 3; ++i) seen("p04", i) = seen("home", i);
  const CampaignResult result = extract();
  expect_others_ok(result, "p04");
  EXPECT_EQ(pose(result, "p04").status, PoseStatus::same_photographs);
}

TEST_F(ExtractPoses, PhotographWithoutMarkers) {
  seen("p01", 1).markers.clear();
  const CampaignResult result = extract();
  EXPECT_EQ(result.photographs[photographs_of("p01")[1]].status, PhotoStatus::no_markers);
  expect_others_ok(result, "");
}

TEST_F(ExtractPoses, BlurredPhotographWhoseMarkersAreNotMeasured) {
  for (MarkerObservation& marker : seen("p01", 1).markers) marker.status = MarkerStatus::misfit;
  const CampaignResult result = extract();
  EXPECT_EQ(result.photographs[photographs_of("p01")[1]].status, PhotoStatus::no_markers);
  EXPECT_THAT(result.photographs[photographs_of("p01")[1]].words, HasSubstr("misfit"));
}

TEST_F(ExtractPoses, PoseWithoutFixedMarkersIsDisconnected) {
  for (std::size_t i = 0; i < 3; ++i) {
    std::erase_if(seen("p02", i).markers, [](const MarkerObservation& m) { return m.id < 100; });
  }
  const CampaignResult result = extract();
  expect_others_ok(result, "p02");
  EXPECT_EQ(pose(result, "p02").status, PoseStatus::disconnected);
}

TEST_F(ExtractPoses, PoseWithoutMovingMarkers) {
  for (std::size_t i = 0; i < 3; ++i) {
    std::erase_if(seen("p02", i).markers, [](const MarkerObservation& m) { return m.id >= 100; });
  }
  const CampaignResult result = extract();
  expect_others_ok(result, "p02");
  EXPECT_EQ(pose(result, "p02").status, PoseStatus::no_moving_markers);
}

TEST_F(ExtractPoses, PhotographFiledInAWrongPoseIsFound) {
  std::swap(seen("p02", 1), seen("p03", 1));
  const CampaignResult result = extract_poses(made_.campaign, made_.observations);
  EXPECT_EQ(result.photographs[photographs_of("p02")[1]].residuals.rejected > 0 ||
                result.photographs[photographs_of("p03")[1]].residuals.rejected > 0,
            true);
  for (const char* id : {"p01", "p04"}) EXPECT_EQ(pose(result, id).status, PoseStatus::ok);
  EXPECT_LT(worst_error_mm(made_, result), 3 * kCleanErrorMm);
}

TEST_F(ExtractPoses, MovedFixedMarkerIsNamed) {
  const Rigid3 moved = Rigid3::from_translation({0.4, 0.5, -0.3}) * made_.scene.body_from_marker[2];
  for (const std::size_t p : photographs_of("p03")) {
    for (MarkerObservation& marker : made_.observations.photographs[p].seen.markers) {
      if (marker.id != 2) continue;
      Vector8d px;
      ASSERT_TRUE(project_drawn({made_.scene.true_camera, made_.scene.camera_from_fixed[p], nullptr, moved},
                                made_.scene.network.features[2], px, nullptr));
      for (int c = 0; c < 4; ++c) marker.corners_px[static_cast<std::size_t>(c)] = px.segment<2>(2 * c);
    }
  }
  const CampaignResult result = extract();
  expect_others_ok(result, "");
  EXPECT_THAT(result.findings, Contains(Says("marker 2 stands elsewhere in pose p03")));
}

TEST_F(ExtractPoses, MarkerSeenOnceIsNamed) {
  bool kept = false;
  for (CampaignPhotograph& photograph : made_.observations.photographs) {
    std::erase_if(photograph.seen.markers, [&](const MarkerObservation& m) {
      const bool erase = m.id == 105 && kept;
      kept = kept || m.id == 105;
      return erase;
    });
  }
  const CampaignResult result = extract();
  EXPECT_THAT(result.findings, Contains(Says("marker 105")));
}

TEST_F(ExtractPoses, NearlyOneDirectionIsSaid) {
  // Two photographs from the same tripod, each with noise of its own.
  seen("p03", 1).markers = seen("p03", 0).markers;
  double sign = 1;
  for (MarkerObservation& marker : seen("p03", 1).markers) {
    for (Eigen::Vector2d& corner : marker.corners_px)
      corner += (sign = -sign) * Eigen::Vector2d(0.015, 0.015);
  }
  seen("p03", 2).markers.clear();
  const CampaignResult result = extract_poses(made_.campaign, made_.observations);
  EXPECT_THAT(pose(result, "p03").words, HasSubstr("nearly one direction"));
}

TEST_F(ExtractPoses, WeakGeometryIsRefusedNotTrusted) {
  ExtractOptions options;
  options.max_sigma_mm = 1e-6;
  const CampaignResult result = extract_poses(made_.campaign, made_.observations, options);
  EXPECT_EQ(pose(result, "p01").status, PoseStatus::weak_geometry);
  EXPECT_FALSE(pose(result, "p01").pose);
}

TEST_F(ExtractPoses, HomeNotMeasuredLeavesNoDatum) {
  for (std::size_t i = 0; i < 3; ++i) seen("home", i).markers.clear();
  const CampaignResult result = extract_poses(made_.campaign, made_.observations);
  EXPECT_EQ(pose(result, "p01").status, PoseStatus::no_datum);
  EXPECT_THAT(pose(result, "p01").words, HasSubstr("home"));
}

TEST_F(ExtractPoses, UnknownHomePoseIsTheUsersErrorAndHasAWayOn) {
  made_.campaign.lg->home_pose = "start";
  EXPECT_THAT(
      [&] { (void)extract_poses(made_.campaign, made_.observations); },
      ThrowsInputError("found 'start', which is none of the poses: home, p01, p02, p03, p04; photograph the "
                       "home as 'start', or let another pose be the home: --home POSE"));
}

TEST_F(ExtractPoses, WrongNominalPointIsLeftOut) {
  made_.campaign.ug->nominal[5].xyz_mm += Eigen::Vector3d(3, 0, 0);
  const CampaignResult result = extract();
  expect_others_ok(result, "");
  EXPECT_THAT(result.findings, Contains(Says("nominal point 1.1")));
}

TEST_F(ExtractPoses, NothingAtAllIsRefusedForEveryPose) {
  for (CampaignPhotograph& photograph : made_.observations.photographs) photograph.seen.markers.clear();
  const CampaignResult result = extract_poses(made_.campaign, made_.observations);
  for (const MeasuredPose& measured : result.poses) EXPECT_NE(measured.status, PoseStatus::ok);
}

TEST_F(ExtractPoses, BarThatDisagreesWithTheMarkersIsNamed) {
  const double length =
      (made_.scene.body_from_marker[0].translation - made_.scene.body_from_marker[4].translation).norm();
  made_.campaign.bars.push_back({{0, -1}, {4, -1}, length + 0.2, 0.005});
  made_.campaign.checks.push_back({{1, -1}, {3, -1}, 10, 0});
  const CampaignResult result = extract();
  EXPECT_THAT(result.findings, Contains(Says("bar 0-4")));
  EXPECT_TRUE(result.checks.at(0).measured);
}

TEST_F(ExtractPoses, ScaleFromNominalCoordinatesOverridesMisprintedSizes) {
  ObservationSceneOptions options;
  options.num_epochs = 5;
  options.noise_px = 0.01;
  options.print_scale = 0.01;
  made_ = make_campaign_scene(options);
  const CampaignResult with_sizes = extract_poses(made_.campaign, made_.observations);
  EXPECT_THAT(with_sizes.findings, Contains(Says("disagree with the scale")));
  made_.campaign.scale = ScaleFrom::nominal;
  const CampaignResult result = extract();
  EXPECT_NEAR(result.UG.scale, 1.01, 1e-4);
  EXPECT_THAT(result.findings, Contains(Says("printed 1.0")));
}

TEST_F(ExtractPoses, BarsGiveTheScaleAndSayHowTheMarkersWerePrinted) {
  ObservationSceneOptions options;
  options.num_epochs = 5;
  options.noise_px = 0.01;
  options.print_scale = 0.01;
  made_ = make_campaign_scene(options);
  const auto distance = [&](std::size_t a, std::size_t b) {
    return (made_.scene.body_from_marker[a].translation - made_.scene.body_from_marker[b].translation).norm();
  };
  made_.campaign.scale = ScaleFrom::bars;
  made_.campaign.bars = {{{0, -1}, {4, -1}, distance(0, 4), 0.002},
                         {{5, -1}, {9, -1}, distance(5, 9), 0.002}};
  const CampaignResult agreeing = extract();
  EXPECT_THAT(agreeing.findings, Contains(Says("the markers are printed 1.0")));
  EXPECT_THAT(agreeing.findings, Not(Contains(Says("bar "))));
  made_.campaign.bars[1].length_mm += 0.05;
  EXPECT_THAT(extract_poses(made_.campaign, made_.observations).findings,
              Contains(Says("bar 5-9: measured")));
}

TEST_F(ExtractPoses, ResidualsFarBeyondTheirPromiseAreSaidInEveryPose) {
  for (CampaignPhotograph& photograph : made_.observations.photographs) {
    for (MarkerObservation& marker : photograph.seen.markers) marker.covariance_px2 *= 0.01;
  }
  const CampaignResult result = extract();
  EXPECT_THAT(result.findings, Contains(Says("times what the photographs promise")));
  EXPECT_THAT(pose(result, "p01").words, HasSubstr("times what they should be"));
  EXPECT_EQ(pose(result, "p01").status, PoseStatus::suspect);
  EXPECT_TRUE(pose(result, "p01").pose);
}

TEST_F(ExtractPoses, WithoutAMeasuredBarTheScaleIsThatOfTheMarkers) {
  made_.campaign.scale = ScaleFrom::bars;
  made_.campaign.bars = {{{0, -1}, {4, -1}, 90, 0.002}};
  for (CampaignPhotograph& photograph : made_.observations.photographs)
    std::erase_if(photograph.seen.markers, [](const MarkerObservation& m) { return m.id == 4; });
  const CampaignResult result = extract();
  expect_others_ok(result, "");
  EXPECT_THAT(result.findings,
              Contains(Says("no scale bar was measured: the scale is that of the markers' sizes")));
  EXPECT_FALSE(result.bars.at(0).measured);
}

TEST_F(ExtractPoses, PhotographsOfThreePosesInOneFitNone) {
  show_moving_markers_of(3, "p02", 1);
  show_moving_markers_of(4, "p02", 2);
  const CampaignResult result = extract();
  expect_others_ok(result, "p02");
  EXPECT_EQ(pose(result, "p02").status, PoseStatus::disconnected);
  EXPECT_THAT(pose(result, "p02").words, HasSubstr("its markers of the moving grip fit no other pose"));
  EXPECT_FALSE(pose(result, "p02").pose);
}

TEST_F(ExtractPoses, APoseInWhichMostMovingMarkersMovedContradicts) {
  for (const std::size_t p : photographs_of("p02")) {
    for (MarkerObservation& marker : made_.observations.photographs[p].seen.markers) {
      if (marker.id < 104) continue;
      const double way = marker.id - 104;
      const Rigid3 moved = made_.scene.body_from_marker[static_cast<std::size_t>(marker.id) - 90] *
                           Rigid3::from_translation({std::cos(way), std::sin(way), 0});
      Vector8d px;
      ASSERT_TRUE(project_drawn({made_.scene.true_camera, made_.scene.camera_from_fixed[p],
                                 &made_.scene.fixed_from_moving[2], moved},
                                made_.scene.network.features[0], px, nullptr));
      for (int c = 0; c < 4; ++c) marker.corners_px[static_cast<std::size_t>(c)] = px.segment<2>(2 * c);
    }
  }
  const CampaignResult result = extract();
  expect_others_ok(result, "p02");
  EXPECT_EQ(pose(result, "p02").status, PoseStatus::contradictory) << pose(result, "p02").words;
  EXPECT_THAT(pose(result, "p02").words, HasSubstr("sightings of moving markers contradict the rest"));
  EXPECT_FALSE(pose(result, "p02").pose);
}

TEST_F(ExtractPoses, APhotographOfAnotherPoseWithFewFixedMarkersIsNamedToo) {
  show_moving_markers_of(3, "p02", 1);
  std::erase_if(seen("p02", 1).markers, [](const MarkerObservation& m) { return m.id > 3 && m.id < 100; });
  const CampaignResult result = extract();
  expect_others_ok(result, "");
  const MeasuredPhotograph& photograph = result.photographs[photographs_of("p02")[1]];
  EXPECT_EQ(photograph.status, PhotoStatus::suspect);
  EXPECT_EQ(photograph.shows_pose, "p03");
  EXPECT_THAT(pose(result, "p02").words, HasSubstr(photograph.words));
  EXPECT_EQ(pose(result, "p02").images, 2);
}

TEST_F(ExtractPoses, OneBlurredMarkerInOnePhotographIsAmbiguous) {
  for (std::size_t i = 0; i < 3; ++i) {
    std::erase_if(seen("p02", i).markers,
                  [i](const MarkerObservation& m) { return i == 0 ? m.id > 102 : m.id >= 100; });
  }
  std::erase_if(seen("p02", 0).markers,
                [](const MarkerObservation& m) { return m.id >= 100 && m.id != 102; });
  ASSERT_EQ(seen("p02", 0).markers.back().id, 102);
  seen("p02", 0).markers.back().covariance_px2 *= 1e6;
  const CampaignResult result = extract();
  expect_others_ok(result, "p02");
  EXPECT_EQ(pose(result, "p02").status, PoseStatus::ambiguous) << pose(result, "p02").words;
  EXPECT_THAT(pose(result, "p02").words, HasSubstr("its flipped pose fits as well"));
  EXPECT_FALSE(pose(result, "p02").pose);
}

TEST_F(ExtractPoses, ACameraThatIsNotAsCalibratedIsSaid) {
  ObservationSceneOptions options;
  options.num_epochs = 5;
  options.noise_px = 0.01;
  options.interior_sigma = 1;
  made_ = make_campaign_scene(options);
  made_.observations.cameras[0].model.parameters[0] += 20;
  const CampaignResult result = extract_poses(made_.campaign, made_.observations);
  EXPECT_THAT(result.findings, Contains(Says("the camera is not as it was calibrated")));
  expect_others_ok(result, "");
}

// Poses p0, p1, ... as measured, judged against the targets of the same names.
CampaignResult judged_poses(const std::vector<std::optional<Pose>>& measured,
                            const std::vector<Pose>& targets) {
  CampaignResult result;
  std::map<std::string, Pose> commanded;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    MeasuredPose pose;
    pose.id = fmt::format("p{}", i);
    pose.pose = measured[i];
    if (pose.pose) pose.status = PoseStatus::ok;
    result.poses.push_back(pose);
    commanded[pose.id] = targets[i];
  }
  judge_against_targets(commanded, result);
  return result;
}

TEST(SwappedFolders, AreNamedOnlyWhereEachLiesAtTheOthersTarget) {
  const std::vector<Pose> targets{Pose{}, Pose{{20, 0, 0}, {0, 0, 0}}, Pose{{0, 30, 0}, {0, 0.1, 0}}};
  const CampaignResult swapped = judged_poses({Pose{{1, 1, 0}, {0, 0, 0}}, targets[2], targets[1]}, targets);
  EXPECT_THAT(
      swapped.findings,
      ElementsAre(Says("p1 and p2 look swapped: each lies where the other was commanded to: exchange the two "
                       "folders p1 and p2")));
  EXPECT_EQ(swapped.findings[0].severity, Severity::bad);
  EXPECT_EQ(swapped.poses[0].words, "");
  EXPECT_EQ(swapped.poses[1].words, "swapped with p2?");
  EXPECT_EQ(swapped.poses[2].words, "swapped with p1?");
  EXPECT_EQ(swapped.poses[0].status, PoseStatus::ok);
  EXPECT_EQ(swapped.poses[1].status, PoseStatus::suspect);
  EXPECT_EQ(swapped.poses[2].status, PoseStatus::suspect);
  EXPECT_TRUE(judged_poses({targets[0], targets[1], targets[2]}, targets).findings.empty());
  EXPECT_TRUE(judged_poses({Pose{}, targets[2], std::nullopt}, targets).findings.empty());
}

std::vector<Pose> some_targets() {
  return {Pose{}, Pose{{20, 3, -5}, {0.02, 0.05, 0}}, Pose{{-4, 18, 2}, {-0.06, 0.01, 0.03}},
          Pose{{7, -9, 11}, {0.03, -0.04, -0.05}}, Pose{{-12, -6, -8}, {0.05, 0.02, 0.04}}};
}

TEST(TurnedFrames, AreToldFromAMachineThatIsOff) {
  const std::vector<Pose> targets = some_targets();
  const Eigen::Quaterniond quarter(Eigen::AngleAxisd(90 * kRadPerDeg, Eigen::Vector3d::UnitZ()));
  std::vector<std::optional<Pose>> turned, off, mirrored;
  for (const Pose& target : targets) {
    const Rigid3 motion = home_from_lg(target);
    turned.emplace_back(pose_from_home_from_lg(
        {quarter * motion.rotation * quarter.inverse(), quarter * motion.translation}));
    Pose wrong = target;
    wrong.position_mm += Eigen::Vector3d(1.5, -2, 1) + 0.05 * target.position_mm;
    wrong.rpy_rad += Eigen::Vector3d(0.01, -0.01, 0.02);
    off.emplace_back(wrong);
    Pose other_sign = target;
    other_sign.position_mm.x() *= -1;
    mirrored.emplace_back(other_sign);
  }
  EXPECT_THAT(judged_poses(turned, targets).findings,
              ElementsAre(Says("turned by 90 deg about (0.00, 0.00, 1.00): the axes of frame UG")));
  EXPECT_THAT(judged_poses(mirrored, targets).findings, ElementsAre(Says("an axis has the other sign")));
  EXPECT_TRUE(judged_poses(off, targets).findings.empty());
}

TEST(TargetNames, AMisspeltOneIsNamedWithThePoseThatIsMeant) {
  const std::vector<Pose> targets = some_targets();
  CampaignResult result;
  for (const char* id : {"home", "p001", "p002"}) {
    MeasuredPose pose;
    pose.id = id;
    result.poses.push_back(pose);
  }
  judge_against_targets(
      {{"home", targets[0]}, {"P001", targets[1]}, {"p002", targets[2]}, {"p077", targets[3]}}, result);
  EXPECT_THAT(result.findings,
              ElementsAre(Says("target P001 has no photographs, and pose p001 has no target: did you "
                               "mean p001?")));
}

TEST(SamePoseTwice, TheOneFartherFromItsTargetIsSuspect) {
  const std::vector<Pose> targets = some_targets();
  const CampaignResult result =
      judged_poses({targets[0], targets[1], targets[1], targets[3], targets[4]}, targets);
  EXPECT_EQ(result.poses[1].status, PoseStatus::ok);
  EXPECT_EQ(result.poses[2].status, PoseStatus::suspect);
  EXPECT_THAT(result.findings, ElementsAre(Says("p1 and p2 are the same measured pose")));
}

TEST_F(ExtractPoses, APhotographOfAnotherPoseIsNamedWithThePoseThatItBelongsTo) {
  show_moving_markers_of(3, "p02", 1);
  const CampaignResult result = extract();
  const MeasuredPhotograph& photograph = result.photographs[photographs_of("p02")[1]];
  EXPECT_EQ(photograph.status, PhotoStatus::suspect) << photograph.words;
  EXPECT_EQ(photograph.shows_pose, "p03");
  EXPECT_THAT(result.findings, Contains(Says("shows pose p03, not p02: move it to the folder of p03")));
  expect_others_ok(result, "");
  EXPECT_EQ(overall_verdict(result), Severity::bad);
}

TEST_F(ExtractPoses, APhotographThatFitsNoPoseMakesItsPoseSuspect) {
  const Rigid3 elsewhere = made_.scene.fixed_from_moving[2] * Rigid3::from_translation({6, -7, 5});
  made_.scene.fixed_from_moving.push_back(elsewhere);
  show_moving_markers_of(made_.scene.fixed_from_moving.size() - 1, "p02", 1);
  const CampaignResult result = extract();
  expect_others_ok(result, "p02");
  EXPECT_EQ(pose(result, "p02").status, PoseStatus::suspect) << pose(result, "p02").words;
  EXPECT_TRUE(pose(result, "p02").pose);
  EXPECT_THAT(result.findings, Contains(Says("contradicts the others of pose p02, and fits no other pose")));
}

TEST_F(ExtractPoses, ACheckDistanceFarOffMakesThePosesSuspect) {
  const double length =
      (made_.scene.body_from_marker[0].translation - made_.scene.body_from_marker[4].translation).norm();
  made_.campaign.checks.push_back({{0, -1}, {4, -1}, length, 0.05});
  CampaignResult result = extract();
  expect_others_ok(result, "");
  EXPECT_EQ(overall_verdict(result), Severity::good);
  made_.campaign.checks[0].length_mm += 0.55;
  result = extract();
  EXPECT_THAT(result.findings, Contains(Says("check 0-4: measured")));
  EXPECT_EQ(overall_verdict(result), Severity::bad);
  EXPECT_EQ(pose(result, "p01").status, PoseStatus::suspect);
  EXPECT_THAT(pose(result, "p01").words, HasSubstr("check 0-4 is -0.55 mm off (11.0 sigma)"));
  EXPECT_TRUE(pose(result, "p01").pose);
}

TEST_F(ExtractPoses, TheAngleBetweenStationsIsSaidAlsoWhereNoMarkerIsSeenTwice) {
  seen("p03", 2).markers.clear();
  const double both = pose(extract(), "p03").intersection_deg;
  EXPECT_GT(both, 20);
  std::erase_if(seen("p03", 0).markers, [](const MarkerObservation& m) { return m.id >= 105; });
  std::erase_if(seen("p03", 1).markers, [](const MarkerObservation& m) { return m.id >= 100 && m.id < 105; });
  const CampaignResult result = extract_poses(made_.campaign, made_.observations);
  EXPECT_NEAR(pose(result, "p03").intersection_deg, both, 3);
  EXPECT_THAT(pose(result, "p03").words, Not(HasSubstr("nearly one direction")));
}

TEST_F(ExtractPoses, AHomeWrittenOtherwiseIsTakenAndSaid) {
  made_.campaign.lg->home_pose = "Home";
  const CampaignResult result = extract();
  expect_others_ok(result, "");
  EXPECT_THAT(result.findings, ElementsAre(Says("'Home' is none of the poses; 'home' was taken")));
}

TEST_F(ExtractPoses, OnlyFixedMarkersIsAPlainPhotogrammetryProject) {
  made_.campaign.moving.clear();
  made_.campaign.lg.reset();
  made_.campaign.checks.push_back({{0, 0}, {9, 2}, 100, 0});
  const CampaignResult result = extract_poses(made_.campaign, made_.observations);
  EXPECT_EQ(result.points.size(), 40U);
  EXPECT_TRUE(result.checks.at(0).measured);
  EXPECT_TRUE(result.photographs.at(0).UG_from_camera.has_value());
}

TEST_F(ExtractPoses, OptionsAreRefusedByName) {
  expect_option_refused<ExtractOptions>("option max_sigma_mm: found 0, wanted more than 0",
                                        [](auto& o) { o.max_sigma_mm = 0; });
  expect_option_refused<ExtractOptions>("option map_poses: found 1, wanted 2 or more, or 0",
                                        [](auto& o) { o.map_poses = 1; });
  expect_option_refused<ExtractOptions>("option min_intersection_deg: found nan, wanted 0 or more",
                                        [](auto& o) { o.min_intersection_deg = std::nan(""); });
}

TEST_F(ExtractPoses, LgFromNominalCoordinates) {
  FrameRule lg;
  lg.gd_mm = 50;
  for (std::size_t m = 10; m < 20; ++m) {
    for (int c = 0; c < 4; ++c) {
      // LG is the moving body's own frame shifted by a millimetre.
      lg.nominal.push_back(
          {{made_.scene.network.features[m].id, c},
           made_.scene.body_from_marker[m] * made_.scene.printed_points(m).col(c) + Eigen::Vector3d(1, 0, 0),
           0.001});
    }
  }
  made_.campaign.lg = lg;
  const CampaignResult result = extract_poses(made_.campaign, made_.observations);
  for (std::size_t e = 0; e < 5; ++e) {
    ASSERT_TRUE(result.poses[e].pose) << result.poses[e].words;
    const Rigid3 truth = made_.scene.fixed_from_moving[e] * Rigid3::from_translation({-1, 0, 0});
    EXPECT_LT((ug_from_lg(*result.poses[e].pose, 50).translation - truth.translation).norm(), 0.004);
  }
}

}  // namespace
}  // namespace hexcal
