#include "tools/report/scene.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "tools/io/json_text.h"
#include "tools/report/markup.h"
#include "tools/report/scene_still.h"

namespace hexcal {
namespace {

using Eigen::Vector3d;
using Json = nlohmann::ordered_json;

// A micrometre at most: the page stays small, the picture does not change.
Json json_of(const Vector3d& v) {
  Json list = Json::array();
  for (const double value : v) list.push_back(std::round(value * 1e3) / 1e3);
  return list;
}

template <typename Points>
Json json_of_points(const Points& points) {
  Json list = Json::array();
  for (const Vector3d& point : points) list.push_back(json_of(point));
  return list;
}

Json json_of(const SceneFrame& frame) {
  const Eigen::Matrix3d axes = frame.scene_from_frame.rotation_matrix();
  Json list = Json::array();
  for (Eigen::Index i = 0; i < 3; ++i) {
    Json axis = Json::array();
    for (const double value : axes.col(i)) axis.push_back(std::round(value * 1e6) / 1e6);
    list.push_back(axis);
  }
  return {{"name", clean_text(frame.name)},
          {"origin", json_of(frame.scene_from_frame.translation)},
          {"axes", list}};
}

Json json_of(const SceneMarker& marker) {
  return {{"id", marker.id}, {"corners", json_of_points(marker.corners_mm)}};
}

Json json_of(const SceneEllipsoid& ellipsoid, double scale) {
  Json axes = Json::array();
  for (Eigen::Index i = 0; i < 3; ++i)
    axes.push_back(json_of(Vector3d(scale * ellipsoid.half_axes_mm.col(i))));
  return {{"centre", json_of(ellipsoid.centre_mm)}, {"axes", axes}};
}

template <typename Items>
Json json_list(const Items& items) {
  Json list = Json::array();
  for (const auto& item : items) list.push_back(json_of(item));
  return list;
}

Json json_of_pose(const ScenePose& pose, double depth, double ellipsoid_scale) {
  Json cameras = Json::array();
  for (const SceneCamera& camera : pose.cameras) {
    cameras.push_back({{"name", clean_text(camera.name)},
                       {"centre", json_of(camera.scene_from_camera.translation)},
                       {"corners", json_of_points(frustum_corners(camera, depth))}});
  }
  Json ellipsoids = Json::array();
  for (const SceneEllipsoid& ellipsoid : pose.ellipsoids)
    ellipsoids.push_back(json_of(ellipsoid, ellipsoid_scale));
  return {{"id", clean_text(pose.id)},          {"frames", json_list(pose.frames)},
          {"markers", json_list(pose.markers)}, {"cameras", cameras},
          {"ellipsoids", ellipsoids},           {"joints", json_of_points(pose.platform_joints_mm)}};
}

Html button(const char* id, const char* words, const char* hint) {
  return html_element("button", html_text(words),
                      {{"type", "button"}, {"id", id}, {"title", hint}, {"aria-label", hint}});
}

}  // namespace

Eigen::Matrix3d ellipsoid_half_axes(const Eigen::Matrix3d& covariance_mm2) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(0.5 *
                                                              (covariance_mm2 + covariance_mm2.transpose()));
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
}

Html html_scene(const Scene3d& scene) {
  const SceneBounds bounds = scene_bounds(scene);
  Json poses = Json::array();
  for (const ScenePose& pose : scene.poses) {
    poses.push_back(json_of_pose(pose, frustum_depth(bounds), scene.ellipsoid_scale));
  }
  const Json data = {{"centre", json_of(bounds.centre)},
                     {"radius", std::round(bounds.radius * 1e3) / 1e3},
                     {"far", std::round(bounds.far * 1e3) / 1e3},
                     {"shown", first_shown_pose(scene)},
                     {"fixed",
                      {{"frames", json_list(scene.frames)},
                       {"markers", json_list(scene.markers)},
                       {"joints", json_of_points(scene.base_joints_mm)}}},
                     {"poses", poses}};
  Html options;
  for (std::size_t i = 0; i < scene.poses.size(); ++i) {
    options += html_element("option", html_text(scene.poses[i].id), {{"value", std::to_string(i)}});
  }
  Html controls = html_element(
      "label", {html_text("Pose ").source + html_element("select", options, {{"id", "scene-pose"}}).source});
  controls += button("scene-left", "\xE2\x86\xBA", "turn left");
  controls += button("scene-right", "\xE2\x86\xBB", "turn right");
  controls += button("scene-in", "+", "nearer");
  controls += button("scene-out", "\xE2\x88\x92", "farther");
  controls += button("scene-reset", "Reset", "first view");
  controls += html_element(
      "span", html_text("drag to turn, click and wheel to zoom, arrow keys, + and \xE2\x88\x92, 0"),
      {{"class", "scene-key"}});
  Html out = html_element("div", controls, {{"class", "scene-controls"}, {"id", "scene-controls"}});
  out += html_element("div", {}, {{"class", "scene"}, {"id", "scene"}});
  out +=
      html_element("p", html_text("This browser offers no WebGL; a still picture stands in for the 3D view."),
                   {{"id", "scene-note"}, {"hidden", "hidden"}});
  out += html_element("div", {scene_still_svg(scene)}, {{"class", "print-only"}, {"id", "scene-still"}});
  std::string key =
      "Blue squares: fixed markers; green: moving markers; purple: camera stations; orange: legs 1 to 6";
  key += scene.ellipsoid_scale == 1
             ? "."
             : fmt::format("; vermilion: one-sigma error ellipsoids, {} times enlarged.",
                           significant_text(scene.ellipsoid_scale, 1));
  out += html_element("p", html_text(key), {{"class", "scene-key"}});
  out += Html{"<script type=\"application/json\" id=\"scene-data\">" + script_escaped(json_text(data)) +
              "</script>\n"};
  return out;
}

}  // namespace hexcal
