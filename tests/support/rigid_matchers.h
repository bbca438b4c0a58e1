#pragma once

#include <gmock/gmock.h>

#include "kinematics/geometry/pose.h"

namespace hexcal {

/// Matches a Rigid3 within mm and deg, and prints how far off it is.
MATCHER_P3(RigidNear, expected, tolerance_mm, tolerance_deg, "") {
  const double off_mm = (arg.translation - expected.translation).norm();
  const double off_deg = rotation_distance(arg.rotation, expected.rotation) * kDegPerRad;
  *result_listener << "off by " << off_mm << " mm and " << off_deg << " deg";
  return off_mm <= tolerance_mm && off_deg <= tolerance_deg;
}

/// Matches an Eigen matrix or vector by its largest absolute difference, and prints it.
MATCHER_P2(MatrixNear, expected, tolerance, "") {
  if (arg.rows() != expected.rows() || arg.cols() != expected.cols()) {
    *result_listener << "of another shape";
    return false;
  }
  const double off = (arg - expected).cwiseAbs().maxCoeff();
  *result_listener << "off by " << off;
  return off <= tolerance;
}

}  // namespace hexcal
