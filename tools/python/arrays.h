#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/stl/filesystem.h>

#include "kinematics/platform.h"

// What the module's numpy arrays hold: one pose or set of readings a row, in mm and deg, NaN where there is
// none.
namespace hexcal::python {

using Rows6 = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;

/// An argument: numbers of this shape, whatever numpy makes of them; Eigen::Dynamic rows are N, and one
/// row need not be in a list. Another shape raises InputError, in one sentence.
template <int Rows, int Columns>
struct ArrayIn {
  Eigen::Matrix<double, Rows, Columns, Eigen::RowMajor> numbers;
  [[nodiscard]] Eigen::Index rows() const { return numbers.rows(); }
  [[nodiscard]] auto row(Eigen::Index i) const { return numbers.row(i); }
};
using RowsIn = ArrayIn<Eigen::Dynamic, 6>;

/// The argument as an array of two dimensions; throws InputError where it has another shape.
[[nodiscard]] pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast> array_in(
    pybind11::handle source, pybind11::ssize_t rows, pybind11::ssize_t columns);

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

namespace pybind11::detail {

template <int Rows, int Columns>
struct type_caster<hexcal::python::ArrayIn<Rows, Columns>> {
  using Array = hexcal::python::ArrayIn<Rows, Columns>;
  PYBIND11_TYPE_CASTER(Array, const_name("numpy.ndarray"));
  bool load(handle source, bool /*convert*/) {
    const auto array = hexcal::python::array_in(source, Rows == Eigen::Dynamic ? -1 : Rows, Columns);
    using Matrix = Eigen::Matrix<double, Rows, Columns, Eigen::RowMajor>;
    value.numbers = Eigen::Map<const Matrix>(array.data(), array.shape(0), array.shape(1));
    return true;
  }
};

}  // namespace pybind11::detail
