#include <pybind11/stl.h>

#include <limits>

#include "kinematics/forward.h"
#include "kinematics/inverse.h"
#include "tools/io/hexapod_file.h"
#include "tools/python/arrays.h"

namespace hexcal::python {
namespace py = pybind11;
namespace {

using Joints = Eigen::Matrix<double, 6, 3, Eigen::RowMajor>;
using JointsIn = ArrayIn<6, 3>;
using MotionIn = ArrayIn<4, 4>;

std::array<Eigen::Vector3d, 6> joints_of(const JointsIn& rows) {
  std::array<Eigen::Vector3d, 6> joints;
  for (std::size_t i = 0; i < 6; ++i) joints[i] = rows.row(static_cast<Eigen::Index>(i));
  return joints;
}

Joints rows_of(const std::array<Eigen::Vector3d, 6>& joints) {
  Joints rows;
  for (std::size_t i = 0; i < 6; ++i) rows.row(static_cast<Eigen::Index>(i)) = joints[i];
  return rows;
}

PlatformGeometry machine_of(const JointsIn& base, const JointsIn& platform, const MotionIn& B_from_UG,
                            const MotionIn& P_from_LG, double gd_mm, double min_mm, double max_mm) {
  PlatformGeometry geometry;
  geometry.base_joints_mm = joints_of(base);
  geometry.platform_joints_mm = joints_of(platform);
  geometry.B_from_UG = rigid_of_matrix(B_from_UG.numbers, "B_from_UG");
  geometry.P_from_LG = rigid_of_matrix(P_from_LG.numbers, "P_from_LG");
  geometry.gd_mm = gd_mm;
  for (Actuator& actuator : geometry.actuators) actuator = {0, 1, min_mm, max_mm};
  // Through the file's own checks, so that no machine gets in that hexapod.yaml would refuse.
  return parse_hexapod(hexapod_text("", geometry), "Machine");
}

Rows6 inverse(const PlatformGeometry& geometry, const RowsIn& poses) {
  Rows6 readings(poses.rows(), 6);
  for (Eigen::Index i = 0; i < poses.rows(); ++i) {
    readings.row(i) = readings_at(geometry, geometry.B_from_P(pose_of_row(poses.row(i).transpose())));
  }
  return readings;
}

Rows6 forward(const PlatformGeometry& geometry, const RowsIn& readings) {
  Rows6 poses(readings.rows(), 6);
  for (Eigen::Index i = 0; i < readings.rows(); ++i) {
    poses.row(i).setConstant(std::numeric_limits<double>::quiet_NaN());
    if (!readings.row(i).allFinite()) continue;
    const ForwardResult result =
        forward_kinematics(geometry, lengths_from_readings(geometry, readings.row(i).transpose()));
    if (result.B_from_P) poses.row(i) = row_of_pose(geometry.pose_from_B_from_P(*result.B_from_P));
  }
  return poses;
}

std::vector<std::string> verdicts(const PlatformGeometry& geometry, const RowsIn& poses) {
  const RestState rest(geometry);
  std::vector<std::string> words;
  for (Eigen::Index i = 0; i < poses.rows(); ++i) {
    const InverseResult result =
        inverse_kinematics(geometry, rest, geometry.B_from_P(pose_of_row(poses.row(i).transpose())));
    words.push_back(result.reachable() ? "ok" : std::string(name(result.verdict)) + ": " + reason(result));
  }
  return words;
}

}  // namespace

void bind_kinematics(py::module_& module) {
  py::class_<PlatformGeometry>(module, "Machine", R"(Geometry of a Stewart platform.

Joints in mm, base joints in frame B, platform joints in frame P; B_from_UG and P_from_LG are 4 x 4 motions.
A pose is (x, y, z) in mm and (roll, pitch, yaw) in deg of the lower grip relative to its home.)")
      .def(py::init(&machine_of), py::arg("base_joints_mm"), py::arg("platform_joints_mm"), py::kw_only(),
           py::arg("B_from_UG"), py::arg("P_from_LG"), py::arg("gd_mm"), py::arg("min_mm"), py::arg("max_mm"),
           "Actuators read their length in mm and reach from min_mm to max_mm.")
      .def_property_readonly("base_joints_mm",
                             [](const PlatformGeometry& g) { return rows_of(g.base_joints_mm); })
      .def_property_readonly("platform_joints_mm",
                             [](const PlatformGeometry& g) { return rows_of(g.platform_joints_mm); })
      .def_property_readonly("B_from_UG", [](const PlatformGeometry& g) { return g.B_from_UG.matrix(); })
      .def_property_readonly("P_from_LG", [](const PlatformGeometry& g) { return g.P_from_LG.matrix(); })
      .def_readonly("gd_mm", &PlatformGeometry::gd_mm)
      .def_property_readonly("offsets_mm",
                             [](const PlatformGeometry& g) {
                               Vector6d v;
                               for (std::size_t i = 0; i < 6; ++i)
                                 v[static_cast<Eigen::Index>(i)] = g.actuators[i].offset_mm;
                               return v;
                             })
      .def_property_readonly("mm_per_unit",
                             [](const PlatformGeometry& g) {
                               Vector6d v;
                               for (std::size_t i = 0; i < 6; ++i)
                                 v[static_cast<Eigen::Index>(i)] = g.actuators[i].mm_per_unit;
                               return v;
                             })
      .def("inverse", &inverse, py::arg("poses"), "Actuator readings (N, 6) at poses (N, 6).")
      .def("forward", &forward, py::arg("readings"),
           "Poses (N, 6) at readings (N, 6): the pose connected to home, NaN where there is none.")
      .def("verdicts", &verdicts, py::arg("poses"),
           "Per pose 'ok', or which limit it breaks and by how much.");
  module.def("read_hexapod", &read_hexapod_file, py::arg("path"), "Machine of a hexapod.yaml.");
}

}  // namespace hexcal::python
