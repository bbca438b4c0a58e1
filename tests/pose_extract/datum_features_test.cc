#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>

#include "pose_extract/datum_frame.h"
#include "pose_extract/feature_fit.h"
#include "tests/support/campaign_scene.h"

namespace hexcal {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

// A twelve-sided grip: markers on its sides (ids 0-11) and on its end plate (ids 12-17), the frame's z its
// axis.
// `lifted` is the marker that stands off by 0.1 mm; `glued_mm` and `glued_deg` are how far stickers were
// glued from where they belong, inside their faces.
struct GripOptions {
  double noise_px = 0;
  int lifted = -1;
  double glued_mm = 0;
  double glued_deg = 0;
};

ObservationScene twelve_sided_grip(const GripOptions& options) {
  ObservationScene scene;
  scene.true_camera = CameraModel(6016, 4000, 9011.0);
  scene.network.cameras.push_back({scene.true_camera, {}});
  scene.network.num_epochs = 1;
  for (int i = 0; i < 12; ++i) {
    const double azimuth = 30.0 * i * kRadPerDeg;
    const Eigen::Vector3d outward(std::cos(azimuth), std::sin(azimuth), 0);
    Eigen::Matrix3d r;
    r << Eigen::Vector3d::UnitZ().cross(outward), Eigen::Vector3d::UnitZ(), outward;
    scene.body_from_marker.emplace_back(r, Eigen::Vector3d(60 * outward + Eigen::Vector3d(0, 0, -20)));
    (void)scene.network.add_square(i, kReferenceBody, 20);
  }
  for (int i = 0; i < 6; ++i) {
    const double azimuth = 60.0 * i * kRadPerDeg;
    scene.body_from_marker.push_back(
        Rigid3::from_translation({35 * std::cos(azimuth), 35 * std::sin(azimuth), 0}));
    (void)scene.network.add_square(12 + i, kReferenceBody, 20);
  }
  std::mt19937_64 rng(5);
  std::normal_distribution<double> unit(0.0, 1.0);
  const auto normal = [&](std::mt19937_64& random) { return options.noise_px * unit(random); };
  for (std::size_t m = 0; m < scene.network.features.size(); ++m) {
    const Eigen::Vector3d shift(options.glued_mm * unit(rng), options.glued_mm * unit(rng),
                                scene.network.features[m].id == options.lifted ? 0.1 : 0);
    const Eigen::Vector3d turn(0, 0, options.glued_deg * kRadPerDeg * unit(rng));
    scene.body_from_marker[m] =
        scene.body_from_marker[m] * Rigid3(quaternion_from_rotation_vector(turn), shift);
  }
  for (int p = 0; p < 12; ++p) {
    const double azimuth = 30.0 * p * kRadPerDeg;
    const Eigen::Vector3d eye(600 * std::cos(azimuth), 600 * std::sin(azimuth), 350);
    Eigen::Matrix3d r;
    r.col(2) = (Eigen::Vector3d(0, 0, -10) - eye).normalized();
    r.col(0) = r.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
    r.col(1) = r.col(2).cross(r.col(0));
    const Rigid3 camera_from_fixed = inverse(Rigid3(r, eye));
    NetworkPhoto photo;
    for (std::size_t m = 0; m < scene.network.features.size(); ++m) {
      const Rigid3 seen_from = camera_from_fixed * scene.body_from_marker[m];
      if (-seen_from.rotation_matrix().col(2).dot(seen_from.translation.normalized()) < 0.35) continue;
      Observation seen;
      Vector8d px;
      if (!project_drawn({scene.true_camera, camera_from_fixed, nullptr, scene.body_from_marker[m]},
                         scene.network.features[m], px, nullptr)) {
        continue;
      }
      seen.id = scene.network.features[m].id;
      seen.covariance_px2 = 1e-4 * Matrix8d::Identity();
      seen.px = px;
      for (int i = 0; i < 8; ++i) seen.px[i] += normal(rng);
      photo.observations.push_back(seen);
    }
    scene.network.photos.push_back(photo);
  }
  return scene;
}

Feature feature(Feature::Kind kind, int first, int last) {
  Feature out;
  out.kind = kind;
  for (int id = first; id <= last; ++id) out.points.push_back({id, -1});
  return out;
}

// The grip's axis as z, its end plate as origin, both from markers.
void expect_axis_and_end_plate(const GripOptions& options) {
  const ObservationScene scene = twelve_sided_grip(options);
  const AdjustmentResult adjusted = adjust_network(scene.network, {});
  ASSERT_EQ(adjusted.status, AdjustmentStatus::ok) << adjusted.reason;
  FeatureFrame features;
  features.z = feature(Feature::Kind::cylinder, 0, 11);
  features.z.towards = MarkerPoint{12, -1};
  features.x.kind = Feature::Kind::line;
  features.x.points = {{15, -1}, {12, -1}};
  features.origin = feature(Feature::Kind::plane, 12, 17);  // where the axis meets the end plate
  const DatumFrame frame = frame_from_features(scene.network, adjusted, kReferenceBody, features);
  ASSERT_TRUE(frame.ok) << frame.reason;
  // The grip's own frame, up to the turn about z that the line sets.
  const Rigid3 frame_from_true =
      frame.frame_from_body * adjusted.geometry.body_from_feature[0] * inverse(scene.body_from_marker[0]);
  EXPECT_LT(frame_from_true.translation.norm(), 0.010);
  const double tilt = std::acos(std::min(1.0, frame_from_true.rotation_matrix()(2, 2)));
  EXPECT_LT(tilt * kDegPerRad, 0.01);
  if (options.lifted >= 0) {
    EXPECT_THAT(frame.notes, Contains(AllOf(HasSubstr(fmt::format("marker {} lies ", options.lifted)),
                                            HasSubstr("lifted"))));
  }
  EXPECT_EQ(std::count_if(frame.notes.begin(), frame.notes.end(),
                          [](const std::string& note) { return note.find("lifted") != std::string::npos; }),
            options.lifted >= 0 ? 1 : 0);
  // The stated covariance explains the error of the origin.
  const Eigen::Matrix3d covariance = (frame.by_error * frame.by_error.transpose()).topLeftCorner<3, 3>();
  EXPECT_GT(covariance.trace(), 0);
}

TEST(DatumFeatures, AxisAndEndPlateOfAGrip) { expect_axis_and_end_plate({0.01, -1, 0, 0}); }
TEST(DatumFeatures, ALiftedStickerOnTheEndPlateIsNamed) { expect_axis_and_end_plate({0.01, 15, 0, 0}); }
TEST(DatumFeatures, ALiftedStickerOnTheSideIsNamed) { expect_axis_and_end_plate({0.01, 4, 0, 0}); }
TEST(DatumFeatures, StickersThatWereGluedByHandTellTheSameAxis) {
  expect_axis_and_end_plate({0.01, -1, 0.5, 1.0});
  expect_axis_and_end_plate({0.01, 7, 0.5, 1.0});
}

TEST(DatumFeatures, ParallelDirectionsAreRefused) {
  const ObservationScene scene = twelve_sided_grip({});
  const AdjustmentResult adjusted = adjust_network(scene.network, {});
  FeatureFrame features;
  features.z = feature(Feature::Kind::plane, 12, 17);
  features.x = feature(Feature::Kind::cylinder, 0, 11);
  features.origin = feature(Feature::Kind::point, 12, 12);
  const DatumFrame frame = frame_from_features(scene.network, adjusted, kReferenceBody, features);
  EXPECT_FALSE(frame.ok);
  EXPECT_THAT(frame.reason, HasSubstr("parallel"));
}

TEST(DatumFeatures, SayWhichFeatureIsTooWeakForAFrame) {
  const ObservationScene scene = twelve_sided_grip({});
  AdjustmentResult adjusted = adjust_network(scene.network, {});
  ASSERT_EQ(adjusted.status, AdjustmentStatus::ok) << adjusted.reason;
  FeatureFrame good;
  good.z = feature(Feature::Kind::plane, 13, 17);
  good.x = feature(Feature::Kind::line, 13, 14);
  good.origin = feature(Feature::Kind::point, 15, 15);
  const auto expect = [&](const std::string& words, auto change) {
    FeatureFrame features = good;
    change(features);
    const DatumFrame frame = frame_from_features(scene.network, adjusted, kReferenceBody, features);
    EXPECT_EQ(frame.ok, words.empty()) << words;
    EXPECT_THAT(frame.reason, HasSubstr(words));
  };
  expect("", [](FeatureFrame&) {});
  expect("none of a feature's markers was measured",
         [](auto& f) { f.origin = feature(Feature::Kind::point, 90, 92); });
  expect("its x feature: too few of its points were measured",
         [](auto& f) { f.x = feature(Feature::Kind::line, 17, 18); });
  expect("z and x must be a plane, line, circle or cylinder: a point or sphere has no direction",
         [](auto& f) { f.x = feature(Feature::Kind::point, 13, 13); });
  // A line so steep on the plane that a last digit decides whether z and x are parallel: no derivative.
  const Rigid3& from = adjusted.geometry.body_from_feature[13];
  const double steep = 10 * kRadPerDeg + 1e-8;
  adjusted.geometry.body_from_feature[0].translation =
      from.translation + from.rotation * Eigen::Vector3d(100 * std::sin(steep), 0, 100 * std::cos(steep));
  expect("its features are too weak to construct it", [](auto& f) { f.x.points = {{13, -1}, {0, -1}}; });
}

// Markers 12 to 17 lie on the end plate, the others on the sides; `off_mm` is how far each stands off the
// plate.
DatumFrame frame_of_plate(const std::vector<double>& off_mm, double tolerance_mm) {
  ObservationScene scene = twelve_sided_grip({});
  AdjustmentResult adjusted = adjust_network(scene.network, {});
  for (std::size_t i = 0; i < off_mm.size(); ++i) {
    Rigid3& marker = adjusted.geometry.body_from_feature[12 + i];
    marker.translation += marker.rotation * Eigen::Vector3d(0, 0, off_mm[i]);
  }
  FeatureFrame features;
  features.z = feature(Feature::Kind::plane, 12, 17);
  features.x = feature(Feature::Kind::line, 12, 13);
  features.origin = feature(Feature::Kind::point, 12, 12);
  features.tolerance_mm = tolerance_mm;
  return frame_from_features(scene.network, adjusted, kReferenceBody, features);
}

TEST(DatumFeatures, MostMarkersMustLieOnAFeatureAndTheirScatterIsInTheSigma) {
  const auto tilt_sigma = [](const DatumFrame& frame) {
    const Eigen::Matrix<double, 7, 7> covariance = frame.by_error * frame.by_error.transpose() + frame.own;
    return std::sqrt(covariance(3, 3) + covariance(4, 4));
  };
  const DatumFrame flat = frame_of_plate({0, 0, 0, 0, 0, 0}, 0);
  ASSERT_TRUE(flat.ok) << flat.reason;
  const DatumFrame thick = frame_of_plate({0.05, -0.06, 0.04, -0.07, 0.08, -0.03}, 0);
  ASSERT_TRUE(thick.ok) << thick.reason;
  // 0.06 mm on 35 mm.
  EXPECT_GT(tilt_sigma(thick), 5 * tilt_sigma(flat));
  EXPECT_GT(tilt_sigma(thick), 0.06 / 35 / std::sqrt(3.0));
  const DatumFrame minority = frame_of_plate({0, 0, 0, 3, -4, 5}, 0);
  EXPECT_FALSE(minority.ok);
  EXPECT_THAT(minority.reason,
              HasSubstr("its z feature: only 3 of its 6 markers lie on one plane within 0.5 mm"));
  EXPECT_TRUE(frame_of_plate({0, 0, 0, 3, -4, 5}, 6).ok);
  EXPECT_FALSE(frame_of_plate({0.05, -0.06, 0.04, -0.07, 0.08, -0.03}, 0.01).ok);
}

TEST(FeatureFit, WithoutASolutionSaysSo) {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, 8);
  points(0, 3) = std::numeric_limits<double>::quiet_NaN();
  for (const Feature::Kind kind : {Feature::Kind::plane, Feature::Kind::line, Feature::Kind::circle,
                                   Feature::Kind::cylinder, Feature::Kind::sphere}) {
    const FittedFeature fitted = fit_feature(kind, points, Eigen::VectorXd::Constant(8, 0.01), points, points,
                                             std::vector<char>(8, 1));
    EXPECT_FALSE(fitted.ok);
    EXPECT_EQ(fitted.reason, "the fit has no solution");
  }
}

// Nominal coordinates of the grip's markers from 0 on, as many as there are sigmas.
std::vector<NominalPoint> nominal_centres(const ObservationScene& scene,
                                          const std::vector<double>& sigma_mm) {
  std::vector<NominalPoint> nominal;
  for (std::size_t m = 0; m < sigma_mm.size(); ++m)
    nominal.push_back(
        {{scene.network.features[m].id, -1}, scene.body_from_marker[m].translation, sigma_mm[m]});
  return nominal;
}

TEST(DatumNominal, SaysWhyItsPointsMakeNoFrame) {
  const ObservationScene scene = twelve_sided_grip({});
  AdjustmentResult adjusted = adjust_network(scene.network, {});
  ASSERT_EQ(adjusted.status, AdjustmentStatus::ok) << adjusted.reason;
  const auto expect = [&](const std::string& words, const std::vector<NominalPoint>& nominal) {
    for (const bool with_scale : {false, true}) {
      const DatumFrame frame =
          frame_from_nominal(scene.network, adjusted, kReferenceBody, nominal, with_scale);
      EXPECT_EQ(frame.ok, words.empty()) << words;
      EXPECT_EQ(frame.reason, words);
    }
  };
  std::vector<NominalPoint> nominal = nominal_centres(scene, {0.01, 0.01, 0.01});
  expect("", nominal);
  nominal[1].point.id = 90;
  expect("only 2 of the 3 nominal points were measured, wanted at least 3", nominal);
  // What is promised to be exact is 3 mm off; without it there are two.
  nominal = nominal_centres(scene, {1e-4, 10, 10});
  nominal[0].xyz_mm.x() += 3;
  expect("fewer than 3 of its nominal points agree with the measurement", nominal);
  // Markers 0 to 3 in a row along the grip, as good as; the turn about it is left open.
  for (std::size_t m = 0; m < 4; ++m) {
    adjusted.geometry.body_from_feature[m].translation =
        adjusted.geometry.body_from_feature[12].translation +
        Eigen::Vector3d(12.3, 7.7, -3.1) * static_cast<double>(m) + Eigen::Vector3d(0, m == 1 ? 1e-3 : 0, 0);
  }
  nominal = nominal_centres(scene, {0.01, 0.01, 0.01, 0.01});
  for (std::size_t m = 0; m < 4; ++m)
    nominal[m].xyz_mm = Eigen::Vector3d(12.3, 7.7, -3.1) * static_cast<double>(m);
  expect("its nominal points lie on a line", nominal);
  nominal.push_back({{6, -1}, scene.body_from_marker[6].translation, 1e-4});
  nominal.back().xyz_mm += Eigen::Vector3d(40, -20, 30);
  for (std::size_t m = 0; m < 4; ++m) nominal[m].sigma_mm = 10;
  expect("those of its nominal points that agree with the measurement lie on a line", nominal);
}

TEST(DatumFrames, OfABodyWithoutAMeasuredMarkerIsNone) {
  const ObservationScene scene = twelve_sided_grip({});
  const AdjustmentResult adjusted = adjust_network(scene.network, {});
  EXPECT_TRUE(frame_from_first_marker(scene.network, adjusted, kReferenceBody).ok);
  const DatumFrame frame = frame_from_first_marker(scene.network, adjusted, kMovingBody);
  EXPECT_FALSE(frame.ok);
  EXPECT_EQ(frame.reason, "none of its markers was measured");
}

TEST(FeatureFit, RecoversEachKindExactly) {
  Eigen::Matrix3Xd points(3, 24);
  Eigen::Matrix3Xd normals(3, 24);
  const Rigid3 placed(quaternion_from_rotation_vector({0.4, -0.3, 0.2}), {10, -20, 30});
  const auto fill = [&](Feature::Kind kind) {
    for (int i = 0; i < 24; ++i) {
      const double a = 0.37 * i;
      const double h = 3.0 * (i % 5);
      const Eigen::Vector3d radial(std::cos(a), std::sin(a), 0);
      Eigen::Vector3d at = Eigen::Vector3d::Zero();
      if (kind == Feature::Kind::plane) at = (5.0 + i) * radial;
      if (kind == Feature::Kind::line) at = Eigen::Vector3d(0, 0, 2.0 * i);
      if (kind == Feature::Kind::circle) at = 40 * radial;
      if (kind == Feature::Kind::cylinder) at = 40 * radial + Eigen::Vector3d(0, 0, h);
      if (kind == Feature::Kind::sphere) {
        at = 40 *
             Eigen::Vector3d(radial.x() * std::cos(h / 10), radial.y() * std::cos(h / 10), std::sin(h / 10));
      }
      points.col(i) = placed * at;
      normals.col(i) = placed.rotation * radial;
    }
  };
  for (const Feature::Kind kind : {Feature::Kind::plane, Feature::Kind::line, Feature::Kind::circle,
                                   Feature::Kind::cylinder, Feature::Kind::sphere}) {
    fill(kind);
    const FittedFeature fitted = fit_feature(kind, points, Eigen::VectorXd::Constant(24, 0.01), normals,
                                             points, std::vector<char>(24, 1));
    ASSERT_TRUE(fitted.ok) << static_cast<int>(kind) << fitted.reason;
    EXPECT_LT(fitted.form_error_mm, 1e-6) << static_cast<int>(kind);
    if (kind != Feature::Kind::sphere) {
      EXPECT_NEAR(std::abs(fitted.direction.dot(placed.rotation_matrix().col(2))), 1, 1e-10);
    }
    if (kind == Feature::Kind::circle || kind == Feature::Kind::cylinder || kind == Feature::Kind::sphere) {
      EXPECT_NEAR(fitted.radius_mm, 40, 1e-6);
    }
  }
}

}  // namespace
}  // namespace hexcal
