#include "tools/python/arrays.h"

#include <fmt/format.h>

#include "kinematics/geometry/input_error.h"

namespace hexcal::python {
namespace {

Vector6d units() {
  Vector6d factor;
  factor << 1, 1, 1, kDegPerRad, kDegPerRad, kDegPerRad;
  return factor;
}

}  // namespace

pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast> array_in(
    pybind11::handle source, pybind11::ssize_t rows, pybind11::ssize_t columns) {
  using Numbers = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;
  Numbers array = Numbers::ensure(source);
  const std::string wanted =
      fmt::format("wanted numbers of shape ({}, {})", rows < 0 ? "N" : std::to_string(rows), columns);
  if (!array || source.is_none()) {  // numpy makes a NaN of None
    PyErr_Clear();
    throw InputError(fmt::format("found {}, {}", Py_TYPE(source.ptr())->tp_name, wanted));
  }
  if (rows < 0 && array.ndim() == 1 && array.shape(0) == columns)
    return array.reshape({pybind11::ssize_t{1}, columns});
  if (array.ndim() != 2 || array.shape(1) != columns || (rows >= 0 && array.shape(0) != rows)) {
    std::string found;
    for (pybind11::ssize_t i = 0; i < array.ndim(); ++i)
      found += fmt::format("{}{}", i > 0 ? ", " : "", array.shape(i));
    throw InputError(fmt::format("found an array of shape ({}), {}", found, wanted));
  }
  return array;
}

Vector6d row_of_pose(const Pose& pose) { return to_deg(pose.vector()); }
Pose pose_of_row(const Vector6d& mm_deg) { return {mm_deg.head<3>(), mm_deg.tail<3>() * kRadPerDeg}; }
Vector6d to_deg(const Vector6d& mm_rad) { return units().cwiseProduct(mm_rad); }
Matrix6d to_deg(const Matrix6d& mm_rad) { return units().asDiagonal() * mm_rad * units().asDiagonal(); }
Matrix6d to_rad(const Matrix6d& mm_deg) {
  const Vector6d inverse = units().cwiseInverse();
  return inverse.asDiagonal() * mm_deg * inverse.asDiagonal();
}

pybind11::array_t<double> stack_of(const std::vector<Matrix6d>& blocks) {
  pybind11::array_t<double> out(
      {static_cast<pybind11::ssize_t>(blocks.size()), pybind11::ssize_t{6}, pybind11::ssize_t{6}});
  auto cells = out.mutable_unchecked<3>();
  for (std::size_t n = 0; n < blocks.size(); ++n) {
    for (Eigen::Index r = 0; r < 6; ++r) {
      for (Eigen::Index c = 0; c < 6; ++c) cells(static_cast<pybind11::ssize_t>(n), r, c) = blocks[n](r, c);
    }
  }
  return out;
}

Rigid3 rigid_of_matrix(const Eigen::Matrix4d& matrix, const char* name) {
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const bool rigid = (rotation * rotation.transpose()).isIdentity(1e-9) && rotation.determinant() > 0 &&
                     matrix.row(3) == Eigen::RowVector4d(0, 0, 0, 1) && matrix.allFinite();
  if (!rigid)
    throw InputError(fmt::format("{}: found no rigid motion, wanted a rotation and translation", name));
  return {rotation, matrix.topRightCorner<3, 1>()};
}

}  // namespace hexcal::python
