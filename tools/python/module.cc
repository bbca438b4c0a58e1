#include <pybind11/pybind11.h>

#include "kinematics/geometry/input_error.h"
#include "tools/io/version.h"
#include "tools/python/arrays.h"

// NOLINTNEXTLINE: the macro declares what Python loads
PYBIND11_MODULE(_hexcal, module) {
  module.attr("__version__") = hexcal::kVersion;
  pybind11::register_exception<hexcal::InputError>(module, "InputError", PyExc_ValueError);
  hexcal::python::bind_kinematics(module);
  hexcal::python::bind_calibration(module);
  hexcal::python::bind_evaluation(module);
  hexcal::python::bind_measurement(module);
}
