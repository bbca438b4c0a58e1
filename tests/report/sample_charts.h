#pragma once

#include <cmath>
#include <string>

#include "kinematics/geometry/pose.h"
#include "tools/report/chart.h"
#include "tools/report/scene.h"

namespace hexcal {

/// A chart with every kind of mark, with text that would break careless markup.
inline Chart sample_chart() {
  Chart chart;
  chart.id = "sample";
  chart.title = "Error ranges <before> & \"after\"";
  chart.caption = "made up";
  Panel bars;
  bars.title = "Position";
  bars.x.categories = {"x-tran", "y-tran", "<script>alert(1)</script>"};
  bars.y.title = "error range (mm)";
  bars.value_labels = true;
  bars.series = {
      {"before", Series::Kind::bars, Ink::series0, {}, {4.2, 3.7, 5.1}, {}, {}, false},
      {"after", Series::Kind::bars, Ink::series1, {}, {0.4, -0.3, 0.2}, {0.1, 0.1, 0.1}, {}, false}};
  Panel points;
  points.title = "Per pose";
  points.y.title = "absolute error (deg)";
  Series series{"x-rot", Series::Kind::points, Ink::series2, {}, {}, {}, {}, false};
  for (int i = 0; i < 34; ++i) {
    points.x.categories.push_back("pose_" + std::to_string(i + 1));
    series.y.push_back(i == 7 ? std::nan("") : std::abs(std::sin(i * 1.7)) * 0.4);
    series.sigma.push_back(0.02);
  }
  points.series.push_back(series);
  Panel heat;
  heat.photograph_frame = true;
  heat.x.title = "x (px)";
  heat.cells_title = "sigma (px)";
  heat.arrow_key = 0.1;
  heat.arrow_unit = "px";
  heat.arrow_scale = 2000;
  for (int i = 0; i < 12; ++i) {
    for (int j = 0; j < 8; ++j) {
      heat.cells.push_back({{i * 500.0, j * 500.0}, {i * 500.0 + 500, j * 500.0 + 500}, 0.01 * (i + j), ""});
    }
    heat.arrows.push_back({{i * 500.0 + 200, 1800}, {0.05, 0.1}, Ink::series1, "marker 7.2"});
  }
  Panel profile;
  profile.x.title = "radius (px)";
  profile.y.title = "distortion (px)";
  Series curve{"brown", Series::Kind::line, Ink::series0, {}, {}, {}, {}, false};
  for (int i = 0; i <= 30; ++i) {
    curve.x.push_back(i * 100.0);
    curve.y.push_back(-1e-9 * std::pow(i * 100.0, 3));
    curve.sigma.push_back(0.02 * i);
  }
  profile.series.push_back(curve);
  chart.panels = {bars, points, heat, profile};
  return chart;
}

inline Scene3d sample_scene() {
  Scene3d scene;
  scene.frames.push_back({"UG", {}});
  ScenePose pose;
  pose.id = "home </script>";
  pose.frames.push_back({"LG", Rigid3::from_translation({0, 0, -50})});
  for (int i = 0; i < 6; ++i) {
    const double base = (60 * (i / 2) * 2 + (i % 2 == 0 ? 10 : 110)) * kRadPerDeg;
    const double platform = (60 * (i / 2) * 2 + (i % 2 == 0 ? 50 : 70)) * kRadPerDeg;
    scene.base_joints_mm.push_back({250 * std::cos(base), 250 * std::sin(base), -550});
    pose.platform_joints_mm.push_back({150 * std::cos(platform), 150 * std::sin(platform), -120});
  }
  const auto square = [](int id, double angle, double z) {
    const Eigen::Vector3d out(std::cos(angle), std::sin(angle), 0);
    const Eigen::Vector3d side = Eigen::Vector3d::UnitZ().cross(out);
    const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d centre = 60 * out + z * up;
    return SceneMarker{id,
                       {centre - 12 * side + 12 * up, centre + 12 * side + 12 * up,
                        centre + 12 * side - 12 * up, centre - 12 * side - 12 * up}};
  };
  for (int i = 0; i < 12; ++i) {
    scene.markers.push_back(square(i, i * 30 * kRadPerDeg, 20));
    pose.markers.push_back(square(100 + i, i * 30 * kRadPerDeg, -80));
  }
  for (int i = 0; i < 3; ++i) {
    const double angle = (-60 + 60 * i) * kRadPerDeg;
    const Eigen::Vector3d centre(600 * std::cos(angle), 600 * std::sin(angle), 60);
    Eigen::Matrix3d axes;
    axes.col(2) = (Eigen::Vector3d(0, 0, -30) - centre).normalized();
    axes.col(0) = axes.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
    axes.col(1) = axes.col(2).cross(axes.col(0));
    pose.cameras.push_back({"DSC_000" + std::to_string(i),
                            {axes, centre},
                            {Eigen::Vector3d(-0.33, -0.22, 1), Eigen::Vector3d(0.33, -0.22, 1),
                             Eigen::Vector3d(0.33, 0.22, 1), Eigen::Vector3d(-0.33, 0.22, 1)}});
  }
  pose.ellipsoids.push_back({{0, 0, -50}, Eigen::Vector3d(4, 4, 9).asDiagonal()});
  scene.poses.push_back(pose);
  scene.ellipsoid_scale = 1000;
  return scene;
}

}  // namespace hexcal
