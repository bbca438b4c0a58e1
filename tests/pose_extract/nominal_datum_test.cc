#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <random>

#include "pose_extract/extract_poses.h"
#include "pose_extract/pose_verdict.h"
#include "tests/support/campaign_scene.h"

namespace hexcal {
namespace {

using ::testing::HasSubstr;

CampaignScene nominal_scene(unsigned seed, int epochs, int markers = 10) {
  ObservationSceneOptions options;
  options.num_epochs = epochs;
  options.noise_px = 0.01;
  options.markers_per_body = markers;
  options.seed = seed;
  return make_campaign_scene(options);
}

// Nominal coordinates of a drawing from which a hand placed the stickers: shifted inside their faces and out
// of them, turned.
struct Hand {
  double in_face_mm = 0, off_face_mm = 0, turn_deg = 0;
};

enum class Listed { corners, centres };

std::vector<NominalPoint> drawing(const CampaignScene& made, int body, const Hand& hand, Listed listed,
                                  double sigma_mm, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal(0, 1);
  std::vector<NominalPoint> nominal;
  const ObservationScene& scene = made.scene;
  for (std::size_t m = 0; m < scene.network.features.size(); ++m) {
    if (scene.network.features[m].body != body) continue;
    const int id = scene.network.features[m].id;
    const Rigid3 placed_from_drawn(
        quaternion_from_rotation_vector({0, 0, hand.turn_deg * kRadPerDeg * normal(rng)}),
        {hand.in_face_mm * normal(rng), hand.in_face_mm * normal(rng), hand.off_face_mm * normal(rng)});
    const Rigid3 body_from_drawn = scene.body_from_marker[m] * inverse(placed_from_drawn);
    const DrawnPoints corners = scene.printed_points(m);
    if (listed == Listed::centres) {
      nominal.push_back({{id, -1}, body_from_drawn.translation, sigma_mm});
    } else {
      for (int c = 0; c < 4; ++c) nominal.push_back({{id, c}, body_from_drawn * corners.col(c), sigma_mm});
    }
  }
  return nominal;
}

struct HandCase {
  const char* name;
  Hand hand;
  Listed listed;
  double sigma_mm;
  int markers;
};

class HandPlaced : public ::testing::TestWithParam<HandCase> {};

// The everyday datum: coordinates of a drawing, stickers placed by hand, no sigma or one that is wrong.
TEST_P(HandPlaced, PosesHaveSigmasThatHold) {
  const HandCase& test = GetParam();
  double squares = 0;
  double worst = 0;
  int numbers = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    CampaignScene made = nominal_scene(seed, 2, test.markers);
    made.campaign.ug->nominal =
        drawing(made, kReferenceBody, test.hand, test.listed, test.sigma_mm, 1000 + seed);
    const CampaignResult result = extract_poses(made.campaign, made.observations);
    for (std::size_t e = 1; e < result.poses.size(); ++e) {
      ASSERT_TRUE(result.poses[e].pose) << result.poses[e].words;
      const Vector6d z = pose_error(*result.poses[e].pose, true_pose(made, e))
                             .cwiseQuotient(result.poses[e].covariance.diagonal().cwiseSqrt());
      squares += z.squaredNorm();
      numbers += 6;
      if (result.poses[e].status == PoseStatus::ok) worst = std::max(worst, z.cwiseAbs().maxCoeff());
    }
  }
  const double rms = std::sqrt(squares / numbers);
  EXPECT_GT(rms, 0.7);
  EXPECT_LT(rms, 1.3);
  EXPECT_LT(worst, 4);
  fmt::print("{}: error over sigma {:.2f}, worst {:.2f}\n", test.name, rms, worst);
}

INSTANTIATE_TEST_SUITE_P(
    Datum, HandPlaced,
    ::testing::Values(HandCase{"Corners", {0.3, 0, 1}, Listed::corners, 0, 6},
                      HandCase{"CornersNotTurned", {0.3, 0.3, 0}, Listed::corners, 0, 6},
                      HandCase{"CornersWithASigmaThatIsWrong", {0.3, 0, 1}, Listed::corners, 0.002, 6},
                      HandCase{"Centres", {0.3, 0.1, 1}, Listed::centres, 0, 6},
                      HandCase{"FourCentres", {0.3, 0.3, 1}, Listed::centres, 0, 4},
                      HandCase{"ThreeStickers", {0.3, 0.1, 1}, Listed::corners, 0, 3},
                      HandCase{"ExactButNotStated", {0, 0, 0}, Listed::corners, 0, 6},
                      HandCase{"StatedAsItIs", {0.3, 0.3, 0}, Listed::centres, 0.3, 6}),
    [](const auto& test) { return std::string(test.param.name); });

const std::vector<PoseStatus> kOk{PoseStatus::ok};
const std::vector<PoseStatus> kNone{PoseStatus::no_datum};
const std::vector<PoseStatus> kSuspect{PoseStatus::suspect};

struct SlipCase {
  const char* name;
  std::function<void(CampaignScene&)> slip;
  std::vector<PoseStatus> statuses;  // of all poses, one of them
  const char* words;                 // in a finding
};

void for_all_points(CampaignScene& made, const std::function<void(NominalPoint&)>& change) {
  for (NominalPoint& point : made.campaign.ug->nominal) change(point);
}

std::function<void(CampaignScene&)> every_point(const std::function<void(NominalPoint&)>& change) {
  return [change](CampaignScene& made) { for_all_points(made, change); };
}

std::function<void(CampaignScene&)> every_corner(const std::array<int, 4>& order) {
  return every_point(
      [order](NominalPoint& p) { p.point.corner = order[static_cast<std::size_t>(p.point.corner)]; });
}

std::function<void(CampaignScene&)> points_of(int id, const std::function<void(NominalPoint&)>& change) {
  return every_point([id, change](NominalPoint& p) {
    if (p.point.id == id) change(p);
  });
}

class DatumSlips : public ::testing::TestWithParam<SlipCase> {};

TEST_P(DatumSlips, AreNamedAndNoPoseThatIsOkIsWrong) {
  const SlipCase& test = GetParam();
  CampaignScene made = nominal_scene(4, 4);
  // As a hand places stickers.
  made.campaign.ug->nominal = drawing(made, kReferenceBody, {0.05, 0.02, 0.2}, Listed::corners, 0, 77);
  test.slip(made);
  const CampaignResult result = extract_poses(made.campaign, made.observations);
  for (std::size_t e = 1; e < result.poses.size(); ++e) {
    const MeasuredPose& pose = result.poses[e];
    EXPECT_THAT(test.statuses, ::testing::Contains(pose.status))
        << pose_status_name(pose.status) << pose.words;
    EXPECT_EQ(pose.pose.has_value(), is_measured(pose.status));
    if (pose.status != PoseStatus::ok) continue;
    const Vector6d z =
        pose_error(*pose.pose, true_pose(made, e)).cwiseQuotient(pose.covariance.diagonal().cwiseSqrt());
    EXPECT_LT(z.cwiseAbs().maxCoeff(), 4);
  }
  const std::string all = findings_text(result);
  EXPECT_THAT(all, HasSubstr(test.words));
  if (*test.words != 0) {
    EXPECT_NE(overall_verdict(result), Severity::good);
  }
  if (test.statuses == kNone) {
    EXPECT_EQ(overall_verdict(result), Severity::bad);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Datum, DatumSlips,
    ::testing::Values(
        SlipCase{"None", [](CampaignScene&) {}, kOk, ""},
        SlipCase{"XHasTheOtherSign", every_point([](auto& p) { p.xyz_mm.x() *= -1; }), kNone,
                 "mirrored: x has the other sign, or y has the other sign, or x and y are exchanged"},
        SlipCase{"ZHasTheOtherSign", every_point([](auto& p) { p.xyz_mm.z() *= -1; }), kNone,
                 "mirrored: z has the other sign"},
        SlipCase{"YAndZExchanged", every_point([](auto& p) { std::swap(p.xyz_mm.y(), p.xyz_mm.z()); }), kNone,
                 "y and z are exchanged"},
        SlipCase{"XAndYExchanged", every_point([](auto& p) { std::swap(p.xyz_mm.x(), p.xyz_mm.y()); }), kNone,
                 "x and y are exchanged"},
        SlipCase{"Inch", every_point([](auto& p) { p.xyz_mm /= 25.4; }), kNone, "coordinates are in inch"},
        SlipCase{"Cm", every_point([](auto& p) { p.xyz_mm /= 10; }), kNone, "coordinates are in cm"},
        SlipCase{"M", every_point([](auto& p) { p.xyz_mm /= 1000; }), kNone, "coordinates are in m"},
        SlipCase{"Um", every_point([](auto& p) { p.xyz_mm *= 1000; }), kNone, "coordinates are in um"},
        SlipCase{"InchAndScaleFromThem",
                 [](CampaignScene& made) {
                   for_all_points(made, [](auto& p) { p.xyz_mm /= 25.4; });
                   made.campaign.scale = ScaleFrom::nominal;
                 },
                 kNone, "coordinates are in inch"},
        SlipCase{"SizesInInch",
                 [](CampaignScene& made) {
                   for (MarkerSizes* sizes : {&made.campaign.fixed, &made.campaign.moving})
                     for (auto& [id, size] : *sizes) size /= 25.4;
                 },
                 kNone, "right and the markers' size_mm in inch"},
        SlipCase{"SizesATenthTooLarge",
                 [](CampaignScene& made) {
                   for (MarkerSizes* sizes : {&made.campaign.fixed, &made.campaign.moving})
                     for (auto& [id, size] : *sizes) size *= 1.2;
                 },
                 kNone, "times as large as the markers' size_mm say"},
        SlipCase{"IdsShiftedByOne", every_point([](auto& p) { ++p.point.id; }), kNone,
                 "for id 1 fits marker 0, and so on (shifted by -1)"},
        SlipCase{"IdsShiftedByARow", every_point([](auto& p) { p.point.id += 5; }), kNone,
                 "for id 5 fits marker 0, and so on (shifted by -5)"},
        SlipCase{"IdsOfAnotherRange", every_point([](auto& p) { p.point.id += 40; }), kNone,
                 "for id 40 fits marker 0"},
        SlipCase{"IdsInReverseOrder", every_point([](auto& p) { p.point.id = 9 - p.point.id; }), kNone,
                 "ids in reverse order"},
        SlipCase{"CornersTheOtherWay", every_corner({0, 3, 2, 1}), kNone, "counted the other way round"},
        SlipCase{"CornersTheOtherWayFromTopRight", every_corner({1, 0, 3, 2}), kNone,
                 "counted the other way round from corner 1"},
        SlipCase{"TurnedBy90", every_corner({1, 2, 3, 0}), kNone, "turned by"},
        SlipCase{"TurnedBy180", every_corner({2, 3, 0, 1}), kNone, "turned by 180 deg"},
        SlipCase{"FilesOfTheTwoGripsExchanged",
                 [](CampaignScene& made) {
                   made.campaign.ug->nominal =
                       drawing(made, kMovingBody, {0.05, 0.02, 0.2}, Listed::corners, 0, 77);
                 },
                 kNone, "give each frame the file of its own grip"},
        SlipCase{"NoSenseAtAll",
                 [](CampaignScene& made) {
                   std::mt19937_64 rng(3);
                   std::uniform_real_distribution<double> anywhere(-60, 60);
                   for_all_points(made, [&](auto& p) {
                     p.xyz_mm = {anywhere(rng), anywhere(rng), anywhere(rng)};
                   });
                 },
                 kNone, "no placement by hand"},
        SlipCase{"TwoStickersExchanged",
                 every_point([](auto& p) { p.point.id = p.point.id == 3 ? 7 : p.point.id == 7 ? 3 : p.point.id; }),
                 kOk, "markers 3 and 7 were left out, for each lies where the other is listed"},
        SlipCase{"OneCoordinateMistyped", points_of(4, [](auto& p) { p.xyz_mm.x() += 10; }), kOk,
                 "marker 4 is 10.0"},
        SlipCase{"OneStickerTurned", points_of(4, [](auto& p) { p.point.corner = (p.point.corner + 2) % 4; }),
                 kOk, "marker 4 was left out, its coordinates are of markers that are turned by 180 deg"},
        SlipCase{"OneCornerMistyped",
                 every_point([](auto& p) {
                   if (p.point == MarkerPoint{1, 1}) p.xyz_mm.x() += 3;
                 }),
                 kOk, "nominal point 1.1 is 3.0"},
        SlipCase{"ARowOfStickersFiveMillimetresLower",
                 every_point([](auto& p) {
                   if (p.point.id >= 6) p.xyz_mm.z() -= 5;
                 }),
                 kSuspect, "16 of its 40 nominal points contradict the others"},
        SlipCase{"CoordinatesOfARoughSketch",
                 every_point([rng = std::mt19937_64(5)](auto& p) mutable {
                   std::uniform_real_distribution<double> rough(-1, 1);
                   p.xyz_mm += Eigen::Vector3d(rough(rng), rough(rng), rough(rng));
                 }),
                 kOk, ""}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace hexcal
