#include "tools/report/scene_still.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tools/report/pdf_canvas.h"
#include "tools/report/svg_canvas.h"

namespace hexcal {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const Vector2d kStillSize(760, 560);
// Cameras farther off than so many radii are not brought into view.
constexpr double kFarthest = 2.2;
constexpr const char* kStillTitle = "Cameras, markers, grip frames and legs";

// The still shows the cameras too, so it fits its scale to everything it draws.
class StillView {
 public:
  StillView(const Scene3d& scene, const ScenePose* pose, double depth, const Vector2d& size) : size_(size) {
    const Vector3d towards_eye = Vector3d(std::cos(-0.9), std::sin(-0.9), 0.45).normalized();
    right_ = Vector3d::UnitZ().cross(towards_eye).normalized();
    up_ = towards_eye.cross(right_);
    low_ = Vector2d::Constant(std::numeric_limits<double>::infinity());
    high_ = -low_;
    for (const SceneFrame& frame : scene.frames) add(frame.scene_from_frame.translation);
    for (const SceneMarker& marker : scene.markers) add_all(marker.corners_mm);
    add_all(scene.base_joints_mm);
    if (pose != nullptr) {
      for (const SceneFrame& frame : pose->frames) add(frame.scene_from_frame.translation);
      for (const SceneMarker& marker : pose->markers) add_all(marker.corners_mm);
      add_all(pose->platform_joints_mm);
      for (const SceneCamera& camera : pose->cameras) {
        add(camera.scene_from_camera.translation);
        add_all(frustum_corners(camera, depth));
      }
    }
    if (!low_.allFinite() || !high_.allFinite()) low_ = high_ = Vector2d::Zero();
    const Vector2d extent = (high_ - low_).cwiseMax(Vector2d::Constant(1e-3));
    scale_ = ((size_ - Vector2d::Constant(70)).cwiseQuotient(extent)).minCoeff();
  }

  [[nodiscard]] Vector2d pixel(const Vector3d& point) const {
    const Vector2d off = scale_ * (flat(point) - 0.5 * (low_ + high_));
    return 0.5 * size_ + Vector2d(off.x(), -off.y());
  }
  [[nodiscard]] double mm_for_pixels(double pixels) const { return pixels / scale_; }

 private:
  [[nodiscard]] Vector2d flat(const Vector3d& point) const { return {right_.dot(point), up_.dot(point)}; }
  void add(const Vector3d& point) {
    low_ = low_.cwiseMin(flat(point));
    high_ = high_.cwiseMax(flat(point));
  }
  template <typename Points>
  void add_all(const Points& points) {
    for (const Vector3d& point : points) add(point);
  }

  Vector2d size_, low_, high_;
  Vector3d right_, up_;
  double scale_ = 1;
};

template <typename Points>
std::vector<Vector2d> outline(const StillView& view, const Points& points) {
  std::vector<Vector2d> out;
  for (const Vector3d& point : points) out.push_back(view.pixel(point));
  if (!out.empty()) out.push_back(out.front());
  return out;
}

void draw_frame(const StillView& view, const SceneFrame& frame, Canvas& canvas) {
  const Vector3d origin = frame.scene_from_frame.translation;
  const std::array names{"x", "y", "z"};
  const std::array inks{Ink::series1, Ink::series2, Ink::series0};
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3d axis = frame.scene_from_frame.rotation_matrix().col(static_cast<Eigen::Index>(i));
    const Vector2d tip = view.pixel(origin + view.mm_for_pixels(42) * axis);
    canvas.line(view.pixel(origin), tip, {{inks[i]}, 1.8});
    canvas.text(tip + Vector2d(3, 3), names[i], {10, Anchor::start, {inks[i]}});
  }
  canvas.text(view.pixel(origin) + Vector2d(-6, 14), frame.name, {11, Anchor::end, {}, true});
}

void draw_markers(const StillView& view, const std::vector<SceneMarker>& markers, Ink ink, Canvas& canvas) {
  for (const SceneMarker& marker : markers) {
    const std::vector<Vector2d> points = outline(view, marker.corners_mm);
    canvas.begin_tip("marker " + std::to_string(marker.id));
    canvas.polygon(points, {ink, 0.45});
    canvas.polyline(points, {{ink}, 0.8});
    canvas.end_tip();
  }
}

// Outline of the projected ellipsoid: the points of the unit sphere's shadow that lie farthest out.
void draw_ellipsoid(const StillView& view, const SceneEllipsoid& ellipsoid, double enlarged, Canvas& canvas) {
  const Vector2d centre = view.pixel(ellipsoid.centre_mm);
  Eigen::Matrix<double, 2, 3> axes;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Vector3d tip = ellipsoid.centre_mm + enlarged * ellipsoid.half_axes_mm.col(i);
    axes.col(i) = view.pixel(tip) - centre;
  }
  const Eigen::JacobiSVD<Eigen::Matrix<double, 2, 3>> svd(axes, Eigen::ComputeFullU);
  constexpr int kCorners = 32;
  std::vector<Vector2d> outline;
  for (int i = 0; i <= kCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCorners;
    const Vector2d circle(std::cos(angle), std::sin(angle));
    outline.push_back(centre + svd.matrixU() * svd.singularValues().cwiseProduct(circle));
  }
  canvas.polygon(outline, {Ink::series1, 0.35});
  canvas.polyline(outline, {{Ink::series1}, 0.8});
}

void draw_pose(const StillView& view, const Scene3d& scene, const ScenePose& pose, double depth,
               Canvas& canvas) {
  for (const SceneCamera& camera : pose.cameras) {
    const auto corners = frustum_corners(camera, depth);
    const Vector2d apex = view.pixel(camera.scene_from_camera.translation);
    for (const Vector3d& corner : corners) canvas.line(apex, view.pixel(corner), {{Ink::series6}, 1});
    canvas.polyline(outline(view, corners), {{Ink::series6}, 1});
    canvas.text(apex + Vector2d(0, -5), camera.name, {9.5, Anchor::middle, {Ink::muted}});
  }
  const std::size_t legs = std::min(scene.base_joints_mm.size(), pose.platform_joints_mm.size());
  for (std::size_t i = 0; i < legs; ++i) {
    const Vector2d a = view.pixel(scene.base_joints_mm[i]);
    const Vector2d b = view.pixel(pose.platform_joints_mm[i]);
    canvas.line(a, b, {{Ink::series4}, 3});
    canvas.text(0.5 * (a + b) + Vector2d(5, 0), std::to_string(i + 1), {10, Anchor::start, {}});
  }
  canvas.polyline(outline(view, pose.platform_joints_mm), {{Ink::muted}, 1});
  draw_markers(view, pose.markers, Ink::series2, canvas);
  for (const SceneEllipsoid& ellipsoid : pose.ellipsoids)
    draw_ellipsoid(view, ellipsoid, scene.ellipsoid_scale, canvas);
  for (const SceneFrame& frame : pose.frames) draw_frame(view, frame, canvas);
}

}  // namespace

SceneBounds scene_bounds(const Scene3d& scene) {
  Eigen::AlignedBox3d box;
  const auto add_all = [&box](const auto& points) {
    for (const Vector3d& point : points) box.extend(point);
  };
  for (const SceneFrame& frame : scene.frames) box.extend(frame.scene_from_frame.translation);
  for (const SceneMarker& marker : scene.markers) add_all(marker.corners_mm);
  add_all(scene.base_joints_mm);
  for (const ScenePose& pose : scene.poses) {
    for (const SceneFrame& frame : pose.frames) box.extend(frame.scene_from_frame.translation);
    for (const SceneMarker& marker : pose.markers) add_all(marker.corners_mm);
    add_all(pose.platform_joints_mm);
  }
  if (box.isEmpty()) return {};
  SceneBounds bounds{box.center(), std::max(0.5 * box.diagonal().norm(), 1e-3), 0};
  for (const ScenePose& pose : scene.poses) {
    for (const SceneCamera& camera : pose.cameras)
      bounds.far = std::max(bounds.far, (camera.scene_from_camera.translation - bounds.centre).norm());
  }
  bounds.far = std::min(bounds.far, kFarthest * bounds.radius);
  return bounds;
}

std::size_t first_shown_pose(const Scene3d& scene) {
  const auto found =
      std::ranges::find_if(scene.poses, [](const ScenePose& pose) { return !pose.ellipsoids.empty(); });
  return found == scene.poses.end() ? 0 : static_cast<std::size_t>(found - scene.poses.begin());
}

double frustum_depth(const SceneBounds& bounds) { return 0.22 * bounds.radius; }

std::array<Vector3d, 4> frustum_corners(const SceneCamera& camera, double depth_mm) {
  std::array<Vector3d, 4> out;
  for (std::size_t i = 0; i < 4; ++i)
    out[i] = camera.scene_from_camera * Vector3d(depth_mm * camera.corner_directions[i]);
  return out;
}

void draw_scene_still(const Scene3d& scene, std::size_t index, const Vector2d& size, Canvas& canvas) {
  const double depth = frustum_depth(scene_bounds(scene));
  const ScenePose* pose = index < scene.poses.size() ? &scene.poses[index] : nullptr;
  const StillView view(scene, pose, depth, size);
  canvas.rectangle({0, 0}, size, {Ink::surface});
  canvas.polyline(outline(view, scene.base_joints_mm), {{Ink::muted}, 1});
  draw_markers(view, scene.markers, Ink::series0, canvas);
  for (const SceneFrame& frame : scene.frames) draw_frame(view, frame, canvas);
  if (pose != nullptr) draw_pose(view, scene, *pose, depth, canvas);
}

std::string scene_still_svg(const Scene3d& scene) {
  SvgCanvas canvas;
  draw_scene_still(scene, first_shown_pose(scene), kStillSize, canvas);
  return canvas.inline_svg(kStillSize, kStillTitle);
}

std::string scene_pdf_file(const Scene3d& scene) {
  PdfCanvas canvas(kStillSize, kStillTitle);
  draw_scene_still(scene, first_shown_pose(scene), kStillSize, canvas);
  return canvas.finish();
}

std::string scene_svg_file(const Scene3d& scene) {
  SvgCanvas canvas;
  draw_scene_still(scene, first_shown_pose(scene), kStillSize, canvas);
  return canvas.svg_file(kStillSize, kStillTitle);
}

}  // namespace hexcal
