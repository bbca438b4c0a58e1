#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "photogrammetry/adjustment/adjustment.h"
#include "tests/support/observation_scene.h"

// Observations as no camera makes them: the adjustment names what is wrong or gives finite numbers, and what
// it gives while some observations are spoilt is what the healthy ones give.

namespace hexcal {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

ObservationScene small_scene() {
  ObservationSceneOptions options;
  options.num_epochs = 4;
  options.noise_px = 0.01;
  return make_observation_scene(options);
}

// Everything that would reach a file is finite, variances are not negative; or there is a reason.
void expect_sane(const AdjustmentResult& result) {
  if (result.status != AdjustmentStatus::ok) {
    EXPECT_NE(result.reason, "");
    EXPECT_NE(result.reason, "not run");
  }
  EXPECT_TRUE(std::isfinite(result.sigma0));
  EXPECT_TRUE(std::isfinite(result.rms_px));
  EXPECT_TRUE(std::isfinite(result.redundancy_total));
  EXPECT_TRUE(std::isfinite(result.interior_chi2));
  if (result.status == AdjustmentStatus::nothing_connected) return;
  for (std::size_t e = 0; e < result.geometry.has_pose[kMovingBody].size(); ++e) {
    if (!result.geometry.has_pose[kMovingBody][e]) continue;
    EXPECT_TRUE(result.geometry.reference_from_body[kMovingBody][e].translation.allFinite());
    EXPECT_TRUE(result.geometry.reference_from_body[kMovingBody][e].rotation.coeffs().allFinite());
    const Matrix6d covariance = result.pose_covariance(static_cast<int>(e), static_cast<int>(e));
    EXPECT_TRUE(covariance.allFinite());
    EXPECT_GE(covariance.diagonal().minCoeff(), 0) << "epoch " << e;
  }
  for (std::size_t p = 0; p < result.geometry.has_photo.size(); ++p) {
    if (!result.geometry.has_photo[p]) continue;
    EXPECT_TRUE(result.geometry.camera_from_reference[p].translation.allFinite());
  }
  for (const Vector8d& residual : result.residuals_px) EXPECT_TRUE(residual.allFinite());
  for (const double redundancy : result.redundancy) EXPECT_TRUE(std::isfinite(redundancy));
}

struct Torture {
  const char* name;
  std::function<void(Network&)> spoil;
  bool harmless;  // one marker of one photograph: the rest is as if it had not been there
};

Observation& victim(Network& network) { return network.photos[4].observations[2]; }

void scale_drawing(NetworkFeature& feature, double factor) {
  feature.drawn_mm *= factor;
  for (ShapeMode& mode : feature.modes) mode.displacement_mm *= factor;
}

const std::vector<Torture>& tortures() {
  static const std::vector<Torture> all{
      {"NanCorner", [](Network& n) { victim(n).px[2] = kNan; }, true},
      {"InfiniteCorner", [](Network& n) { victim(n).px[3] = kInfinity; }, true},
      {"FarCorner", [](Network& n) { victim(n).px.tail<2>() *= 1e12; }, true},
      {"AllCornersTheSame",
       [](Network& n) { victim(n).px = victim(n).px.head<2>().replicate<4, 1>().eval(); }, true},
      {"CollinearCorners",
       [](Network& n) {
         auto& px = victim(n).px;
         for (int i = 1; i < 4; ++i) px.segment<2>(2 * i) = px.head<2>() + i * Eigen::Vector2d(30, 20);
       },
       true},
      {"NanCovariance", [](Network& n) { victim(n).covariance_px2(3, 3) = kNan; }, true},
      {"NegativeCovariance", [](Network& n) { victim(n).covariance_px2 *= -1; }, true},
      {"HugeCovariance", [](Network& n) { victim(n).covariance_px2 *= 1e20; }, true},
      {"ZeroCovariance", [](Network& n) { victim(n).covariance_px2.setZero(); }, false},
      {"UnknownId", [](Network& n) { victim(n).id = 577; }, true},
      {"NoMarkersAtAll",
       [](Network& n) {
         for (NetworkPhoto& photo : n.photos) photo.observations.clear();
       },
       false},
      {"OnePhotograph", [](Network& n) { n.photos.resize(1); }, false},
      {"NoPhotograph", [](Network& n) { n.photos.clear(); }, false},
      {"EveryPhotographTwice",
       [](Network& n) {
         const std::vector<NetworkPhoto> once = n.photos;
         n.photos.insert(n.photos.end(), once.begin(), once.end());
       },
       false},
      {"OneStationOnly",
       [](Network& n) {
         std::vector<NetworkPhoto> kept;
         for (std::size_t p = 0; p < n.photos.size(); p += 3) kept.push_back(n.photos[p]);
         n.photos = kept;
       },
       false},
      {"TheSamePhotographInEveryEpoch",
       [](Network& n) {
         for (NetworkPhoto& photo : n.photos) photo.observations = n.photos[0].observations;
       },
       false},
      {"SizesInMetres",
       [](Network& n) {
         for (NetworkFeature& feature : n.features) scale_drawing(feature, 1e-3);
       },
       false},
      {"SizesInMicrometres",
       [](Network& n) {
         for (NetworkFeature& feature : n.features) scale_drawing(feature, 1e3);
       },
       false},
      {"OneSizeAThousandTimesTooLarge", [](Network& n) { scale_drawing(n.features[3], 1e3); }, false},
      {"FocalLengthAThousandTimesTooLong", [](Network& n) { n.cameras[0].model.parameters[0] *= 1000; },
       false},
      {"FocalLengthAThousandTimesTooShort", [](Network& n) { n.cameras[0].model.parameters[0] /= 1000; },
       false},
      {"CovariancesAMillionTimesTooSmall",
       [](Network& n) {
         for (NetworkPhoto& photo : n.photos)
           for (Observation& seen : photo.observations) seen.covariance_px2 *= 1e-6;
       },
       false},
      {"EveryMarkerTheSameId",
       [](Network& n) {
         for (NetworkPhoto& photo : n.photos)
           for (Observation& seen : photo.observations) seen.id = 0;
       },
       false},
  };
  return all;
}

class AdjustmentTorture : public ::testing::TestWithParam<std::size_t> {};

TEST_P(AdjustmentTorture, HasAReasonOrFiniteNumbers) {
  const Torture& torture = tortures()[GetParam()];
  ObservationScene scene = small_scene();
  torture.spoil(scene.network);
  const AdjustmentResult result = adjust_network(scene.network, {});
  expect_sane(result);
  if (!torture.harmless) return;
  ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  EXPECT_LT(result.rms_px, 0.02);
  EXPECT_LT(result.sigma0, 1.2);
}

INSTANTIATE_TEST_SUITE_P(Of, AdjustmentTorture, ::testing::Range(std::size_t{0}, tortures().size()),
                         [](const auto& torture) { return std::string(tortures()[torture.param].name); });

}  // namespace
}  // namespace hexcal
