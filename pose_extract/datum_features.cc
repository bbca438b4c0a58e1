#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "kinematics/geometry/covariance.h"
#include "pose_extract/datum_frame.h"
#include "pose_extract/feature_fit.h"

namespace hexcal {
namespace {

constexpr double kFewestToleranceMm = 0.02;  // of a point from its feature; printed stickers are no flatter
constexpr double kToleranceSigmas = 6;
constexpr double kMostToleranceMm = 0.5;  // without a stated one; stickers and machined faces are no rougher
constexpr double kMajority = 0.7;         // of the markers, that a tolerance of its own must hold
constexpr double kDifferenceMm = 1e-4;    // step of the derivatives
constexpr double kSteepestDeg = 10;       // least angle between z and x

// The measured points of one feature.
struct FeaturePoints {
  Feature::Kind kind;
  std::vector<MarkerPoint> names;
  Eigen::Matrix3Xd points, normals, centres;
  Eigen::VectorXd sigma_mm;
  std::vector<Eigen::Matrix3Xd> by_error;
  std::vector<char> used;
  std::optional<Eigen::Vector3d> towards;
};

// Sigma of each point in the shape of its feature: a shift and a scale that all of its points share (a print
// whose scale nobody measured) take none of them off it.
std::vector<double> shape_sigmas(const std::vector<Eigen::Vector3d>& points,
                                 const std::vector<Eigen::Matrix3Xd>& by_error) {
  std::vector<double> sigmas;
  if (points.empty()) return sigmas;
  const double n = static_cast<double>(points.size());
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3Xd shift = Eigen::Matrix3Xd::Zero(3, by_error[0].cols());
  for (std::size_t i = 0; i < points.size(); ++i) {
    centre += points[i] / n;
    shift += by_error[i] / n;
  }
  Eigen::RowVectorXd scale = Eigen::RowVectorXd::Zero(shift.cols());
  double extent = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    scale += (points[i] - centre).transpose() * (by_error[i] - shift);
    extent += (points[i] - centre).squaredNorm();
  }
  if (extent > 0) scale /= extent;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double squares = (by_error[i] - shift - (points[i] - centre) * scale).squaredNorm();
    sigmas.push_back(std::sqrt(std::max(1e-10, squares / 3)));
  }
  return sigmas;
}

FeaturePoints gather(const Network& network, const AdjustmentResult& adjusted, int body,
                     const Feature& feature) {
  FeaturePoints out;
  out.kind = feature.kind;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> normals;
  std::vector<Eigen::Vector3d> centres;
  const auto add = [&](int marker, const MarkerPoint& name, bool single) {
    EstimatedPoint estimate = adjusted.point(marker, name.corner);
    points.push_back(estimate.in_body);
    normals.emplace_back(
        adjusted.geometry.body_from_feature[static_cast<std::size_t>(marker)].rotation_matrix().col(2));
    centres.push_back(name.corner >= 0 && single ? points.back() : adjusted.point(marker).in_body);
    out.names.push_back(name);
    out.by_error.push_back(std::move(estimate.by_error));
  };
  for (const MarkerPoint& name : feature.points) {
    const int marker = measured_marker(network, adjusted, body, name.id);
    if (marker < 0) continue;
    // A marker stands for its corners, except where single points are meant.
    const bool single =
        name.corner >= 0 || feature.kind == Feature::Kind::point || feature.kind == Feature::Kind::line;
    if (single) {
      add(marker, name, true);
    } else {
      for (int c = 0; c < 4; ++c) add(marker, {name.id, c}, false);
    }
  }
  out.points.resize(3, static_cast<Eigen::Index>(points.size()));
  out.normals.resize(3, static_cast<Eigen::Index>(points.size()));
  out.centres.resize(3, static_cast<Eigen::Index>(points.size()));
  out.sigma_mm.resize(static_cast<Eigen::Index>(points.size()));
  const std::vector<double> sigmas = shape_sigmas(points, out.by_error);
  for (std::size_t i = 0; i < points.size(); ++i) {
    out.points.col(static_cast<Eigen::Index>(i)) = points[i];
    out.normals.col(static_cast<Eigen::Index>(i)) = normals[i];
    out.centres.col(static_cast<Eigen::Index>(i)) = centres[i];
    out.sigma_mm[static_cast<Eigen::Index>(i)] = sigmas[i];
  }
  // Weights inside one feature follow the stickers, not the noise: the gauge's marker would otherwise count
  // for all.
  if (out.sigma_mm.size() > 0) out.sigma_mm.array() = std::max(1e-4, out.sigma_mm.mean());
  if (feature.towards) {
    const int marker = measured_marker(network, adjusted, body, feature.towards->id);
    if (marker >= 0) {
      out.towards = adjusted.point(marker, feature.towards->corner).in_body;
    }
  }
  return out;
}

const char* kind_name(Feature::Kind kind) {
  switch (kind) {
    case Feature::Kind::plane:
      return "plane";
    case Feature::Kind::line:
      return "line";
    case Feature::Kind::circle:
      return "circle";
    case Feature::Kind::sphere:
      return "sphere";
    case Feature::Kind::cylinder:
      return "cylinder";
    case Feature::Kind::point:
      break;
  }
  return "point";
}

// Numbers of a feature that its markers' distances set.
double free_numbers(Feature::Kind kind) {
  switch (kind) {
    case Feature::Kind::plane:
      return 3;
    case Feature::Kind::line:
      return 2;
    case Feature::Kind::circle:
    case Feature::Kind::sphere:
      return 4;
    case Feature::Kind::cylinder:
      return 5;
    case Feature::Kind::point:
      break;
  }
  return 0;
}

FittedFeature fit(const FeaturePoints& points) {
  FittedFeature fitted =
      fit_feature(points.kind, points.points, points.sigma_mm, points.normals, points.centres, points.used);
  if (!fitted.ok) return fitted;
  Eigen::Vector3d side = Eigen::Vector3d::Zero();
  if (points.towards) {
    side = *points.towards - fitted.place;
  } else if (points.kind == Feature::Kind::plane || points.kind == Feature::Kind::circle) {
    side = points.normals.rowwise().sum();
  }
  if (side.dot(fitted.direction) < 0) fitted.direction = -fitted.direction;
  return fitted;
}

// Distance of each marker from the feature. On a cylinder the corners of a flat sticker lie on either side of
// it by as much as it is glued off the middle of its face: only their mean tells whether it is lifted.
std::map<int, double> marker_distances(const FeaturePoints& points, const FittedFeature& fitted) {
  std::map<int, std::pair<double, int>> sums;
  for (std::size_t i = 0; i < points.names.size(); ++i) {
    auto& [sum, count] = sums[points.names[i].id];
    sum += fitted.distance_mm[i];
    ++count;
  }
  std::map<int, double> means;
  for (const auto& [id, sum] : sums) means[id] = sum.first / sum.second;
  return means;
}

std::size_t count_markers(const FeaturePoints& points, bool used_only) {
  std::set<int> ids;
  for (std::size_t i = 0; i < points.names.size(); ++i) {
    if (!used_only || points.used[i]) ids.insert(points.names[i].id);
  }
  return ids.size();
}

// Whole markers that do not lie on the feature within the tolerance: first the consensus, then the residuals
// of the fit.
void choose_within(FeaturePoints& points, double tolerance) {
  points.used = consensus_points(points.kind, points.points, tolerance);
  // A sticker lifts as a whole: a marker most of whose corners are out is out.
  std::map<int, std::pair<int, int>> per_marker;
  for (std::size_t i = 0; i < points.names.size(); ++i) {
    auto& [in, out] = per_marker[points.names[i].id];
    (points.used[i] ? in : out) += 1;
  }
  for (std::size_t i = 0; i < points.names.size(); ++i) {
    const auto& [in, out] = per_marker[points.names[i].id];
    points.used[i] = in > out;
  }
  if (points.kind != Feature::Kind::cylinder) return;
  // Leave out the worst marker as long as the fit says so.
  for (std::size_t round = 0; round + 3 < per_marker.size(); ++round) {
    const FittedFeature fitted = fit(points);
    if (!fitted.ok) return;
    double worst = tolerance;
    int id = -1;
    const std::map<int, double> distances = marker_distances(points, fitted);
    for (std::size_t i = 0; i < points.names.size(); ++i) {
      const double distance = std::abs(distances.at(points.names[i].id));
      if (!points.used[i] || distance <= worst) continue;
      worst = distance;
      id = points.names[i].id;
    }
    if (id < 0) return;
    for (std::size_t i = 0; i < points.names.size(); ++i) points.used[i] &= points.names[i].id != id;
  }
}

// By the tolerance stated, or by the least that most markers keep. The reason why too few do, or nothing.
std::string choose_points(FeaturePoints& points, double stated_mm) {
  const auto all = static_cast<double>(count_markers(points, false));
  double tolerance =
      stated_mm > 0 ? stated_mm : std::max(kFewestToleranceMm, kToleranceSigmas * points.sigma_mm.mean());
  choose_within(points, tolerance);
  const double most = std::max(kMostToleranceMm, tolerance);
  while (!(stated_mm > 0) && tolerance < most &&
         static_cast<double>(count_markers(points, true)) < kMajority * all) {
    tolerance = std::min(most, 1.5 * tolerance);
    choose_within(points, tolerance);
  }
  const std::size_t used = count_markers(points, true);
  if (2 * static_cast<double>(used) > all) return "";
  return fmt::format("only {} of its {:.0f} markers lie on one {} within {:.2g} mm", used, all,
                     kind_name(points.kind), tolerance);
}

// Covariance of the distance of a marker from the feature, beyond the noise: what the used ones scatter, with
// Student's factor. Zero where they do not scatter or leave nothing to tell it.
double form_variance(const FeaturePoints& points) {
  const FittedFeature fitted = fit(points);
  if (!fitted.ok || points.kind == Feature::Kind::point) return 0;
  const std::map<int, double> distances = marker_distances(points, fitted);
  double squares = 0;
  double count = 0;
  for (const auto& [id, distance] : distances) {
    for (std::size_t i = 0; i < points.names.size(); ++i) {
      if (points.names[i].id != id || !points.used[i]) continue;
      squares += distance * distance;
      count += 1;
      break;
    }
  }
  const double freedom = count - free_numbers(points.kind);
  if (!(freedom > 0)) return 0;
  return squares / freedom * (freedom > 3 ? freedom / (freedom - 2) : 3);
}

struct FeatureSet {
  FeaturePoints z, x, origin;
};

std::optional<Rigid3> construct(const FeatureSet& set, const Eigen::Vector3d& offset_mm,
                                std::string& reason) {
  const FittedFeature z = fit(set.z);
  const FittedFeature x = fit(set.x);
  const FittedFeature origin = fit(set.origin);
  for (const auto& [name, feature] : {std::pair{"z", &z}, std::pair{"x", &x}, std::pair{"origin", &origin}}) {
    if (feature->ok) continue;
    reason = fmt::format("its {} feature: {}", name, feature->reason);
    return std::nullopt;
  }
  if (z.direction.isZero() || x.direction.isZero()) {
    reason = "z and x must be a plane, line, circle or cylinder: a point or sphere has no direction";
    return std::nullopt;
  }
  const Eigen::Vector3d across = x.direction - x.direction.dot(z.direction) * z.direction;
  if (across.norm() < std::sin(kSteepestDeg * kRadPerDeg)) {
    reason = "its z and x directions are nearly parallel";
    return std::nullopt;
  }
  Eigen::Matrix3d body_frame;
  body_frame.col(2) = z.direction;
  body_frame.col(0) = across.normalized();
  body_frame.col(1) = body_frame.col(2).cross(body_frame.col(0));
  // The origin lies on the z feature when that is an axis and the origin's feature is a plane: where they
  // meet.
  Eigen::Vector3d place = origin.place;
  if (set.origin.kind == Feature::Kind::plane && set.z.kind == Feature::Kind::cylinder) {
    place = z.place +
            (origin.place - z.place).dot(origin.direction) / z.direction.dot(origin.direction) * z.direction;
  }
  return inverse(Rigid3(body_frame, place + body_frame * offset_mm));
}

const char* form_name(Feature::Kind kind) {
  switch (kind) {
    case Feature::Kind::plane:
      return "flatness";
    case Feature::Kind::line:
      return "straightness";
    case Feature::Kind::circle:
    case Feature::Kind::sphere:
      return "roundness";
    case Feature::Kind::cylinder:
      return "cylindricity";
    case Feature::Kind::point:
      break;
  }
  return "form";
}

void report(const FeaturePoints& points, const char* name, DatumFrame& frame) {
  const FittedFeature fitted = fit(points);
  if (!fitted.ok || points.kind == Feature::Kind::point) return;
  const bool by_marker = points.kind == Feature::Kind::cylinder;
  const std::map<int, double> means = marker_distances(points, fitted);
  double form_error_mm = fitted.form_error_mm;
  if (by_marker) {
    double least = 0;
    double most = 0;
    for (std::size_t i = 0; i < points.names.size(); ++i) {
      if (!points.used[i]) continue;
      least = std::min(least, means.at(points.names[i].id));
      most = std::max(most, means.at(points.names[i].id));
    }
    form_error_mm = most - least;
  }
  frame.notes.push_back(fmt::format("{}: {} {:.4f} mm", name, form_name(points.kind), form_error_mm));
  std::map<int, double> lifted;
  for (std::size_t i = 0; i < points.names.size(); ++i) {
    const double distance = by_marker ? means.at(points.names[i].id) : fitted.distance_mm[i];
    frame.residuals.push_back({points.names[i], distance * fitted.direction,
                               points.sigma_mm[static_cast<Eigen::Index>(i)], points.used[i] != 0});
    if (!points.used[i] && std::abs(distance) > std::abs(lifted[points.names[i].id])) {
      lifted[points.names[i].id] = distance;
    }
  }
  for (const auto& [id, distance] : lifted) {
    frame.notes.push_back(fmt::format("{}: marker {} lies {:.3f} mm off and was left out (a lifted sticker?)",
                                      name, id, distance));
  }
}

}  // namespace

DatumFrame frame_from_features(const Network& network, const AdjustmentResult& adjusted, int body,
                               const FeatureFrame& features) {
  DatumFrame frame;
  FeatureSet set{gather(network, adjusted, body, features.z), gather(network, adjusted, body, features.x),
                 gather(network, adjusted, body, features.origin)};
  for (FeaturePoints* points : {&set.z, &set.x, &set.origin}) {
    if (points->points.cols() == 0) {
      frame.reason = "none of a feature's markers was measured";
      return frame;
    }
  }
  for (const auto& [name, points] :
       {std::pair{"z", &set.z}, std::pair{"x", &set.x}, std::pair{"origin", &set.origin}}) {
    const std::string why = choose_points(*points, features.tolerance_mm);
    if (why.empty()) continue;
    frame.reason = fmt::format("its {} feature: {}", name, why);
    frame.instruction =
        "look for markers that are not on it or are lifted, and name others, or state tolerance_mm";
    return frame;
  }
  const auto found = construct(set, features.offset_mm, frame.reason);
  if (!found) return frame;
  frame.frame_from_body = *found;
  frame.by_error = Eigen::Matrix<double, 7, Eigen::Dynamic>::Zero(7, adjusted.num_errors());
  // Derivatives of the frame by each point, through the fits, then by the errors of the adjustment.
  for (FeaturePoints* points : {&set.z, &set.x, &set.origin}) {
    const double form = form_variance(*points);
    std::map<int, Eigen::Matrix<double, 6, 3>> by_marker;
    for (Eigen::Index i = 0; i < points->points.cols(); ++i) {
      if (!points->used[static_cast<std::size_t>(i)]) continue;
      Eigen::Matrix<double, 6, 3> by_point;
      for (int c = 0; c < 3; ++c) {
        const double kept = points->points(c, i);
        std::string ignored;
        points->points(c, i) = kept + kDifferenceMm;
        const auto plus = construct(set, features.offset_mm, ignored);
        points->points(c, i) = kept - kDifferenceMm;
        const auto minus = construct(set, features.offset_mm, ignored);
        points->points(c, i) = kept;
        if (!plus || !minus) {
          frame.reason = "its features are too weak to construct it";
          return frame;
        }
        by_point.col(c) = perturbation_between(*minus, *plus) / (2 * kDifferenceMm);
      }
      frame.by_error.topRows<6>() += by_point * points->by_error[static_cast<std::size_t>(i)];
      auto& sum =
          by_marker
              .try_emplace(points->names[static_cast<std::size_t>(i)].id, Eigen::Matrix<double, 6, 3>::Zero())
              .first->second;
      sum += by_point;
    }
    // A sticker stands off with all of its corners.
    for (const auto& [id, by_all] : by_marker)
      frame.own.topLeftCorner<6, 6>() += by_all * form * by_all.transpose();
  }
  report(set.z, "z", frame);
  report(set.x, "x", frame);
  report(set.origin, "origin", frame);
  frame.ok = true;
  frame.reason.clear();
  return frame;
}

}  // namespace hexcal
