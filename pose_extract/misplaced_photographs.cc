#include "pose_extract/misplaced_photographs.h"

#include <cmath>
#include <limits>

namespace hexcal {
namespace {

// The epoch that is shown fits so many times better than the photograph's own, and than any other.
constexpr double kShownFitsBetter = 10;
constexpr double kNextFitsWorse = 3;
constexpr double kShownPx = 3;  // where the photograph's own epoch was not measured at all
constexpr int kFewestRejected = 2;

struct BodyCount {
  int used = 0;
  std::vector<const Sighting*> rejected;
};

struct PhotoBodies {
  BodyCount fixed, moving;
};

// Root mean square of the corners' residuals of `sightings`, in px, if the photograph showed `epoch`. The
// camera stands where the body that fits puts it.
double rms_if_shown(const CampaignResult& result, std::size_t photo,
                    const std::vector<const Sighting*>& sightings, bool moving_rejected, std::size_t epoch) {
  const NetworkGeometry& geometry = result.adjusted.geometry;
  const NetworkPhoto& taken = result.network.photos[photo];
  const CameraModel& camera = geometry.cameras[static_cast<std::size_t>(taken.camera)];
  const Rigid3& fixed_from_moving = geometry.reference_from_body[kMovingBody][epoch];
  const Rigid3& camera_from_fixed = geometry.camera_from_reference[photo];
  const Rigid3 camera_from_body =
      moving_rejected ? camera_from_fixed * fixed_from_moving
                      : camera_from_fixed *
                            geometry.reference_from_body[kMovingBody][static_cast<std::size_t>(taken.epoch)] *
                            inverse(fixed_from_moving);
  double squares = 0;
  for (const Sighting* sighting : sightings) {
    const DrawnPoints corners = feature_points_in_body(result.network, geometry, sighting->feature);
    for (Eigen::Index c = 0; c < corners.cols(); ++c) {
      const auto px = camera.project(camera_from_body * Eigen::Vector3d(corners.col(c)));
      if (!px) return std::numeric_limits<double>::infinity();
      squares += (sighting->px.segment<2>(2 * c) - *px).squaredNorm();
    }
  }
  return std::sqrt(squares / (8.0 * static_cast<double>(sightings.size())));
}

std::optional<std::size_t> epoch_shown(const CampaignResult& result, std::size_t photo,
                                       const std::vector<const Sighting*>& rejected, bool moving_rejected) {
  const auto own = static_cast<std::size_t>(result.network.photos[photo].epoch);
  const bool own_measured = result.adjusted.geometry.has_pose[kMovingBody][own] != 0;
  const double own_px = own_measured ? rms_if_shown(result, photo, rejected, moving_rejected, own)
                                     : kShownFitsBetter * kShownPx;
  double best_px = std::numeric_limits<double>::infinity();
  double next_px = best_px;
  std::size_t best = own;
  for (std::size_t e = 0; e < result.adjusted.geometry.has_pose[kMovingBody].size(); ++e) {
    if (e == own || !result.adjusted.geometry.has_pose[kMovingBody][e]) continue;
    const double px = rms_if_shown(result, photo, rejected, moving_rejected, e);
    if (px < best_px) {
      next_px = best_px;
      best_px = px;
      best = e;
    } else {
      next_px = std::min(next_px, px);
    }
  }
  const bool clear = kShownFitsBetter * best_px < own_px && kNextFitsWorse * best_px < next_px;
  return clear ? std::optional(best) : std::nullopt;
}

}  // namespace

std::vector<MisplacedPhotograph> misplaced_photographs(const CampaignResult& result) {
  const NetworkGeometry& geometry = result.adjusted.geometry;
  std::vector<PhotoBodies> photos(result.network.photos.size());
  for (const Sighting& sighting : result.adjusted.sightings) {
    if (sighting.feature < 0) continue;
    const auto m = static_cast<std::size_t>(sighting.feature);
    PhotoBodies& bodies = photos[static_cast<std::size_t>(sighting.photo)];
    BodyCount& body = result.network.features[m].body == kReferenceBody ? bodies.fixed : bodies.moving;
    if (sighting.status == SightingStatus::used) ++body.used;
    const bool rejected =
        sighting.status == SightingStatus::outlier || sighting.status == SightingStatus::unoriented;
    if (rejected && geometry.has_feature[m]) body.rejected.push_back(&sighting);
  }
  std::vector<MisplacedPhotograph> misplaced;
  for (std::size_t p = 0; p < photos.size(); ++p) {
    const auto epoch = static_cast<std::size_t>(result.network.photos[p].epoch);
    if (!geometry.has_photo[p]) continue;
    const auto& [fixed, moving] = photos[p];
    const auto contradicts = [](const BodyCount& body, const BodyCount& other) {
      return body.used == 0 && static_cast<int>(body.rejected.size()) >= kFewestRejected && other.used > 0;
    };
    const bool measured = geometry.has_pose[kMovingBody][epoch] != 0;
    if (contradicts(moving, fixed)) {
      const auto shown = epoch_shown(result, p, moving.rejected, true);
      // Of an epoch without a pose every photograph is out; only those that show another are misplaced.
      if (measured || shown) misplaced.push_back({p, shown});
    }
    if (measured && contradicts(fixed, moving))
      misplaced.push_back({p, epoch_shown(result, p, fixed.rejected, false)});
  }
  return misplaced;
}

}  // namespace hexcal
