#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "kinematics/geometry/rigid3.h"
#include "tools/report/chart.h"
#include "tools/report/html_page.h"

namespace hexcal {

/// All of a scene in one frame, mm, z up.
struct SceneFrame {
  std::string name;
  Rigid3 scene_from_frame;
};

struct SceneMarker {
  int id = 0;
  std::array<Eigen::Vector3d, 4> corners_mm;
};

/// A camera station, drawn as a pyramid from the centre to the frame's four corners.
struct SceneCamera {
  std::string name;
  Rigid3 scene_from_camera;
  /// Directions (x, y, 1) of the frame's corners in the camera.
  std::array<Eigen::Vector3d, 4> corner_directions;
};

/// The error ellipsoid of a point: the columns are its half axes in mm, true to scale.
struct SceneEllipsoid {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d half_axes_mm = Eigen::Matrix3d::Zero();
};

/// One position of the moving body and what was photographed there.
struct ScenePose {
  std::string id;
  std::vector<SceneFrame> frames;
  std::vector<SceneMarker> markers;
  std::vector<SceneCamera> cameras;
  std::vector<SceneEllipsoid> ellipsoids;
  std::vector<Eigen::Vector3d> platform_joints_mm;  ///< six, or none when the machine is not known
};

struct Scene3d {
  std::vector<SceneFrame> frames;
  std::vector<SceneMarker> markers;             ///< of the fixed body
  std::vector<Eigen::Vector3d> base_joints_mm;  ///< six or none
  std::vector<ScenePose> poses;
  double ellipsoid_scale = 1;  ///< ellipsoids are drawn this many times larger
};

/// Half axes of the one-sigma ellipsoid of a 3x3 covariance in mm^2, as columns.
[[nodiscard]] Eigen::Matrix3d ellipsoid_half_axes(const Eigen::Matrix3d& covariance_mm2);

/// The view that turns, its controls, and a still picture for print and for browsers without WebGL. The page
/// must have `with_scene`.
[[nodiscard]] Html html_scene(const Scene3d& scene);

/// The still picture: the pose shown first, seen from the front, a little to the right and above.
[[nodiscard]] std::string scene_svg_file(const Scene3d& scene);
[[nodiscard]] std::string scene_pdf_file(const Scene3d& scene);

}  // namespace hexcal
