#include "camera_calib/sheet_image.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "camera_calib/initial_camera.h"

namespace hexcal {
namespace {

constexpr double kReach = 2.5;       // in distances between neighbouring markers
constexpr double kAgreement = 0.25;  // of a marker's side: half of what separates it from a neighbour's place
constexpr std::size_t kNearest = 4;  // markers that tell the plane around a place

// Distance of neighbouring markers: the least between any two.
double marker_distance(const std::vector<SheetMarker>& markers) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < markers.size(); ++a) {
    for (std::size_t b = a + 1; b < markers.size(); ++b) {
      least = std::min(least, (markers[a].centre_mm - markers[b].centre_mm).norm());
    }
  }
  return std::isfinite(least) ? least : 0;
}

}  // namespace

SheetImage::SheetImage(const SheetGeometry& geometry, const std::vector<FeatureObservation>& features)
    : agrees_(features.size(), 0), reach_mm_(kReach * marker_distance(geometry.markers)) {
  std::vector<Place> all;
  for (std::size_t f = 0; f < features.size(); ++f) {
    if (features[f].points() != 4) continue;
    const auto index = static_cast<std::size_t>(features[f].first_point / 4);
    if (index >= geometry.markers.size()) continue;
    const SheetMarker& marker = geometry.markers[index];
    Place place{marker.centre_mm, marker.size_mm, {}, {}, f};
    for (int i = 0; i < 4; ++i) {
      place.corners_mm[static_cast<std::size_t>(i)] = marker.corner_mm(i);
      place.corners_px[static_cast<std::size_t>(i)] = features[f].px.segment<2>(2 * i);
    }
    all.push_back(place);
  }
  for (std::size_t seed = 0; seed < all.size() && 2 * places_.size() < all.size() + 1; ++seed) {
    std::vector<Place> grown = grown_from(all, seed, reach_mm_);
    if (grown.size() > places_.size()) places_ = std::move(grown);
  }
  for (const Place& place : places_) agrees_[place.feature] = 1;
  for (const Place& place : all) {
    if (agrees_[place.feature] == 0 && has_marker_within(reach_mm_, place.centre_mm)) ++disagreeing_;
  }
}

std::vector<SheetImage::Place> SheetImage::grown_from(const std::vector<Place>& all, std::size_t seed,
                                                      double reach_mm) {
  std::vector<Place> set{all[seed]};
  std::vector<char> tried(all.size(), 0);
  tried[seed] = 1;
  for (;;) {
    // The one nearest to the set.
    double least = reach_mm;
    std::size_t next = all.size();
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (tried[i] != 0) continue;
      for (const Place& member : set) {
        const double distance = (member.centre_mm - all[i].centre_mm).norm();
        if (distance < least) {
          least = distance;
          next = i;
        }
      }
    }
    if (next == all.size()) return set;
    tried[next] = 1;
    const Place& place = all[next];
    const auto homography = homography_near(set, place.centre_mm, reach_mm);
    if (!homography) continue;
    const double side_px = 0.5 *
                           ((place.corners_px[2] - place.corners_px[0]).norm() +
                            (place.corners_px[3] - place.corners_px[1]).norm()) /
                           std::sqrt(2.0);
    double farthest = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d px = (*homography * place.corners_mm[i].homogeneous()).hnormalized();
      farthest = std::max(farthest, (px - place.corners_px[i]).norm());
    }
    // One marker alone tells its neighbour's place less well than several around it do.
    if (!(farthest < kAgreement * side_px)) continue;
    const bool taken = std::any_of(set.begin(), set.end(), [&place](const Place& member) {
      return (member.centre_mm - place.centre_mm).norm() < 0.1 * place.size_mm;
    });
    if (!taken) set.push_back(place);
  }
}

std::optional<Eigen::Matrix3d> SheetImage::homography_near(const std::vector<Place>& places,
                                                           const Eigen::Vector2d& sheet_mm, double reach_mm) {
  std::vector<std::pair<double, std::size_t>> near;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double distance = (places[i].centre_mm - sheet_mm).norm();
    if (distance < reach_mm) near.emplace_back(distance, i);
  }
  if (near.empty()) return std::nullopt;
  const std::size_t count = std::min(kNearest, near.size());
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count), near.end());
  std::vector<Eigen::Vector2d> sheet;
  std::vector<Eigen::Vector2d> image;
  for (std::size_t k = 0; k < count; ++k) {
    const Place& place = places[near[k].second];
    sheet.insert(sheet.end(), place.corners_mm.begin(), place.corners_mm.end());
    image.insert(image.end(), place.corners_px.begin(), place.corners_px.end());
  }
  return homography_from_points(sheet, image);
}

bool SheetImage::has_marker_within(double reach_mm, const Eigen::Vector2d& sheet_mm) const {
  return std::any_of(places_.begin(), places_.end(),
                     [&](const Place& place) { return (place.centre_mm - sheet_mm).norm() <= reach_mm; });
}

std::optional<Eigen::Matrix3d> SheetImage::around(const Eigen::Vector2d& sheet_mm) const {
  return homography_near(places_, sheet_mm, reach_mm_);
}

}  // namespace hexcal
