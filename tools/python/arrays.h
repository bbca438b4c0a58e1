#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/stl/filesystem.h>

#include "kinematics/platform.h"

// What the module's numpy arrays hold: one pose or set of readings a row, in mm and deg, NaN where there is
// none.
namespace hexcal::python {

using Rows6 = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;
using RowsIn = Eigen::Ref<const Rows6>;

/// x, y, z in mm, roll, pitch, yaw in deg, and back.
[[nodiscard]] Vector6d row_of_pose(const Pose& pose);
[[nodiscard]] Pose pose_of_row(const Vector6d& mm_deg);

/// Vectors and covariances of (x .. yaw) from mm and rad to mm and deg, and back.
[[nodiscard]] Vector6d to_deg(const Vector6d& mm_rad);
[[nodiscard]] Matrix6d to_deg(const Matrix6d& mm_rad);
[[nodiscard]] Matrix6d to_rad(const Matrix6d& mm_deg);

/// N x 6 x 6 as numpy wants it.
[[nodiscard]] pybind11::array_t<double> stack_of(const std::vector<Matrix6d>& blocks);

/// The matrix of a motion, 4 x 4, and back. Throws InputError where it is no rigid motion.
[[nodiscard]] Rigid3 rigid_of_matrix(const Eigen::Matrix4d& matrix, const char* name);

void bind_kinematics(pybind11::module_& module);
void bind_calibration(pybind11::module_& module);
void bind_evaluation(pybind11::module_& module);
void bind_measurement(pybind11::module_& module);

}  // namespace hexcal::python
