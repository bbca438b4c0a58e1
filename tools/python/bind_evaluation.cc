#include <pybind11/stl.h>

#include "calibration/statistics.h"
#include "kinematics/geometry/input_error.h"
#include "tools/io/pose_table.h"
#include "tools/python/arrays.h"

namespace hexcal::python {
namespace py = pybind11;
namespace {

ErrorStatistics statistics_of(const RowsIn& targets, const RowsIn& poses) {
  if (targets.rows() != poses.rows()) {
    throw InputError("found " + std::to_string(targets.rows()) + " targets and " +
                     std::to_string(poses.rows()) + " poses, wanted as many of both");
  }
  std::vector<PosePair> pairs;
  for (Eigen::Index i = 0; i < poses.rows(); ++i) {
    if (targets.row(i).allFinite() && poses.row(i).allFinite())
      pairs.push_back({pose_of_row(targets.row(i).transpose()), pose_of_row(poses.row(i).transpose())});
  }
  return error_statistics(pairs);
}

struct PoseTable {
  std::vector<std::string> ids;
  std::vector<std::string> status;
  Rows6 poses;
  Rows6 sigmas;
};

PoseTable table_of(const std::filesystem::path& path) {
  const std::vector<PoseRecord> records = read_pose_table(path);
  PoseTable table;
  const auto n = static_cast<Eigen::Index>(records.size());
  table.poses.setConstant(n, 6, std::nan(""));
  table.sigmas.setConstant(n, 6, std::nan(""));
  for (Eigen::Index i = 0; i < n; ++i) {
    const PoseRecord& record = records[static_cast<std::size_t>(i)];
    table.ids.push_back(record.id);
    table.status.push_back(record.status);
    if (record.pose) table.poses.row(i) = row_of_pose(*record.pose);
    if (record.sigma) table.sigmas.row(i) = to_deg(*record.sigma);
  }
  return table;
}

}  // namespace

void bind_evaluation(py::module_& module) {
  const auto six = [](Vector6d ErrorStatistics::*member) {
    return [member](const ErrorStatistics& s) { return to_deg(s.*member); };
  };
  const auto degrees = [](double ErrorStatistics::*member) {
    return [member](const ErrorStatistics& s) { return s.*member * kDegPerRad; };
  };
  py::class_<ErrorStatistics>(module, "Errors", R"(Errors (actual minus target) over a set of poses.

Arrays of six are x, y, z in mm and roll, pitch, yaw in deg.)")
      .def_readonly("poses", &ErrorStatistics::poses, "How many poses count.")
      .def_property_readonly("range", six(&ErrorStatistics::range), "Largest minus smallest error.")
      .def_property_readonly("mean", six(&ErrorStatistics::mean))
      .def_property_readonly("rms", six(&ErrorStatistics::rms), "About zero.")
      .def_property_readonly("max_abs", six(&ErrorStatistics::max_abs))
      .def_readonly("position_magnitude_mm", &ErrorStatistics::position_magnitude_mm, "The paper's eq. 7.")
      .def_property_readonly("orientation_magnitude_deg",
                             degrees(&ErrorStatistics::orientation_magnitude_rad), "The paper's eq. 7.")
      .def_readonly("position_rms_mm", &ErrorStatistics::position_rms_mm)
      .def_readonly("position_max_mm", &ErrorStatistics::position_max_mm)
      .def_property_readonly("orientation_rms_deg", degrees(&ErrorStatistics::orientation_rms_rad))
      .def_property_readonly("orientation_max_deg", degrees(&ErrorStatistics::orientation_max_rad));
  module.def("errors", &statistics_of, py::arg("targets"), py::arg("poses"),
             "Errors of poses (N, 6) against targets (N, 6); rows with NaN do not count.");
  module.def("range_magnitude", &range_magnitude, py::arg("ranges"),
             "The paper's eq. 7: root mean square of three error ranges.");
  module.def("improvement_percent", &improvement_percent, py::arg("before"), py::arg("after"),
             "Negative where it got worse.");
  py::class_<PoseTable>(module, "PoseTable", "A table of poses as read from a file.")
      .def_readonly("ids", &PoseTable::ids)
      .def_readonly("status", &PoseTable::status, "'ok', or why there is no pose.")
      .def_readonly("poses", &PoseTable::poses, "(N, 6), mm and deg, NaN where there is none.")
      .def_readonly("sigmas", &PoseTable::sigmas, "(N, 6), mm and deg, NaN where none is known.");
  module.def("read_poses", &table_of, py::arg("path"),
             "Table of a targets.csv, poses.csv or predicted_poses.csv.");
}

}  // namespace hexcal::python
