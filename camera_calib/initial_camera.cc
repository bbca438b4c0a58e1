#include "camera_calib/initial_camera.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "kinematics/geometry/nearest_rotation.h"

namespace hexcal {
namespace {

// Similarity that moves points to mean 0 and mean distance sqrt 2.
Eigen::Matrix3d normalisation(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  double distance = 0;
  for (const auto& p : points) distance += (p - mean).norm();
  const double scale = std::sqrt(2.0) * static_cast<double>(points.size()) / std::max(distance, 1e-12);
  Eigen::Matrix3d t;
  t << scale, 0, -scale * mean.x(), 0, scale, -scale * mean.y(), 0, 0, 1;
  return t;
}

struct ViewPoints {
  std::vector<Eigen::Vector2d> sheet_mm;
  std::vector<Eigen::Vector2d> image_px;
};

ViewPoints points_of(const std::vector<SheetPoint>& points, const SheetView& view) {
  ViewPoints out;
  for (std::size_t f = 0; f < view.features.size(); ++f) {
    if (view.rejected[f] != 0) continue;
    const FeatureObservation& feature = view.features[f];
    for (int i = 0; i < feature.points(); ++i) {
      out.sheet_mm.emplace_back(
          points[static_cast<std::size_t>(feature.first_point + i)].position_mm.head<2>());
      out.image_px.emplace_back(feature.px.segment<2>(2 * i));
    }
  }
  return out;
}

// Mean squared distance in px, each point's capped so that a view gone wrong cannot decide.
double misfit(const CameraModel& camera, const std::vector<ViewPoints>& views,
              const std::vector<Eigen::Matrix3d>& homographies) {
  const double cap = std::pow(0.02 * camera.width_px, 2);
  double sum = 0;
  double count = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Rigid3 pose = pose_from_homography(homographies[v], camera);
    for (std::size_t i = 0; i < views[v].sheet_mm.size(); ++i) {
      const auto px =
          camera.project(pose * Eigen::Vector3d(views[v].sheet_mm[i].x(), views[v].sheet_mm[i].y(), 0));
      sum += px ? std::min(cap, (*px - views[v].image_px[i]).squaredNorm()) : cap;
      count += 1;
    }
  }
  return sum / std::max(count, 1.0);
}

double best_focal_length(const CameraModel& frame, const std::vector<ViewPoints>& views,
                         const std::vector<Eigen::Matrix3d>& homographies, std::optional<double> hint) {
  std::vector<double> candidates;
  if (const auto closed = focal_length_from_homographies(homographies, {frame.cx_px(), frame.cy_px()})) {
    candidates.push_back(*closed);
  }
  for (double f = 0.5 * frame.width_px; f < 16.0 * frame.width_px; f *= 1.25) candidates.push_back(f);
  double best = candidates.front();
  double least = std::numeric_limits<double>::infinity();
  for (const double f : candidates) {
    const double cost = misfit(CameraModel(frame.width_px, frame.height_px, f), views, homographies);
    // The closed form stands first; a grid value must be clearly better to replace it.
    if (cost < 0.95 * least) {
      least = cost;
      best = f;
    }
  }
  if (hint) {
    const double cost = misfit(CameraModel(frame.width_px, frame.height_px, *hint), views, homographies);
    if (cost < 1.1 * least) best = *hint;
  }
  return best;
}

}  // namespace

std::optional<Eigen::Matrix3d> homography_from_points(const std::vector<Eigen::Vector2d>& sheet_mm,
                                                      const std::vector<Eigen::Vector2d>& image_px) {
  if (sheet_mm.size() < 4) return std::nullopt;
  const Eigen::Matrix3d from = normalisation(sheet_mm);
  const Eigen::Matrix3d to = normalisation(image_px);
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::size_t i = 0; i < sheet_mm.size(); ++i) {
    const Eigen::RowVector3d a = (from * sheet_mm[i].homogeneous()).transpose();
    const Eigen::Vector3d b = to * image_px[i].homogeneous();
    Eigen::Matrix<double, 2, 9> rows;
    rows << a, Eigen::RowVector3d::Zero(), -b.x() * a, Eigen::RowVector3d::Zero(), a, -b.y() * a;
    normal.noalias() += rows.transpose() * rows;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> eigen(normal);
  // Points on a line leave a second solution.
  if (!(eigen.eigenvalues()[1] > 1e-9 * eigen.eigenvalues()[8])) return std::nullopt;
  const Eigen::Matrix<double, 9, 1> h = eigen.eigenvectors().col(0);
  Eigen::Matrix3d normalised;
  normalised << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8];
  Eigen::Matrix3d out = to.inverse() * normalised * from;
  // The sheet's origin lies before the camera.
  if (out(2, 2) < 0) out = -out;
  return out / out.norm();
}

std::optional<double> focal_length_from_homographies(const std::vector<Eigen::Matrix3d>& image_from_sheet,
                                                     const Eigen::Vector2d& principal_point_px) {
  // Columns h1, h2 seen from the principal point satisfy p + f^2 d = 0 for two pairs (p, d): the scalar
  // products in the image plane and along the axis, and the differences of the squared lengths. Linear in
  // f^2; a frontal view has d = 0 and weighs nothing.
  Eigen::Matrix3d to_centre = Eigen::Matrix3d::Identity();
  to_centre.topRightCorner<2, 1>() = -principal_point_px;
  const double unit = principal_point_px.norm();
  double dd = 0;
  double pd = 0;
  for (const Eigen::Matrix3d& h : image_from_sheet) {
    Eigen::Matrix3d m = to_centre * h;
    m.topRows<2>() /= unit;
    const Eigen::Vector3d h1 = m.col(0);
    const Eigen::Vector3d h2 = m.col(1);
    const double squared_1 = h1.head<2>().squaredNorm();
    const double squared_2 = h2.head<2>().squaredNorm();
    const double scale = 1.0 / (squared_1 + squared_2);
    const Eigen::Vector2d p = scale * Eigen::Vector2d(h1.head<2>().dot(h2.head<2>()), squared_1 - squared_2);
    const Eigen::Vector2d d = scale * Eigen::Vector2d(h1.z() * h2.z(), h1.z() * h1.z() - h2.z() * h2.z());
    dd += d.squaredNorm();
    pd -= p.dot(d);
  }
  const double f2 = dd > 0 ? pd / dd : 0.0;
  if (!(f2 > 0.01) || !(f2 < 2500.0)) return std::nullopt;
  return unit * std::sqrt(f2);
}

Rigid3 pose_from_homography(const Eigen::Matrix3d& image_from_sheet, const CameraModel& camera) {
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  k(0, 0) = camera.fx_px();
  k(1, 1) = camera.fy_px();
  k(0, 2) = camera.cx_px();
  k(1, 2) = camera.cy_px();
  Eigen::Matrix3d m = k.inverse() * image_from_sheet;
  m /= 0.5 * (m.col(0).norm() + m.col(1).norm());
  if (m(2, 2) < 0) m = -m;
  Eigen::Matrix3d r;
  r << m.col(0), m.col(1), m.col(0).cross(m.col(1));
  return {nearest_rotation(r), m.col(2)};
}

CalibrationState initial_state(const std::vector<Sheet>& sheets,
                               const std::vector<SheetPhotograph>& photographs, int width_px, int height_px,
                               std::optional<double> f_hint_px) {
  CalibrationState state;
  state.camera = CameraModel(width_px, height_px, width_px);
  state.shapes.resize(sheets.size());
  std::vector<std::vector<SheetPoint>> points;
  for (const Sheet& sheet : sheets) points.push_back(sheet_points(sheet_geometry(sheet)));
  std::vector<ViewPoints> view_points;
  std::vector<Eigen::Matrix3d> homographies;
  for (std::size_t p = 0; p < photographs.size(); ++p) {
    for (std::size_t s = 0; s < sheets.size(); ++s) {
      SheetView view;
      view.photograph = static_cast<int>(p);
      view.sheet = static_cast<int>(s);
      for (const FeatureObservation& feature : photographs[p].features) {
        if (feature.sheet == view.sheet && feature.status == MarkerStatus::ok)
          view.features.push_back(feature);
      }
      view.rejected.assign(view.features.size(), 0);
      ViewPoints here = points_of(points[s], view);
      const auto homography = homography_from_points(here.sheet_mm, here.image_px);
      if (!homography) continue;
      homographies.push_back(*homography);
      view_points.push_back(std::move(here));
      state.views.push_back(std::move(view));
    }
  }
  if (state.views.empty()) return state;
  const double f = best_focal_length(state.camera, view_points, homographies, f_hint_px);
  state.camera = CameraModel(width_px, height_px, f);
  for (std::size_t v = 0; v < state.views.size(); ++v) {
    state.views[v].camera_from_sheet = pose_from_homography(homographies[v], state.camera);
  }
  return state;
}

void set_poses(const std::vector<Sheet>& sheets, CalibrationState& state) {
  CameraModel pinhole(state.camera.width_px, state.camera.height_px, 1.0);
  pinhole.parameters[2] = pinhole.parameters[3] = 0;
  for (SheetView& view : state.views) {
    ViewPoints here =
        points_of(sheet_points(sheet_geometry(sheets[static_cast<std::size_t>(view.sheet)])), view);
    ViewPoints straight;
    for (std::size_t i = 0; i < here.image_px.size(); ++i) {
      const auto normalised = state.camera.normalised_from_image(here.image_px[i]);
      if (!normalised) continue;
      straight.sheet_mm.push_back(here.sheet_mm[i]);
      straight.image_px.push_back(*normalised);
    }
    const auto homography = homography_from_points(straight.sheet_mm, straight.image_px);
    if (homography) view.camera_from_sheet = pose_from_homography(*homography, pinhole);
  }
}

}  // namespace hexcal
