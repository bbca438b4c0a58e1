// Usage: consumer hexapod.yaml. Readings at a pose and the pose at these readings, by the installed
// libraries.
#include <cstdio>

#include "kinematics/forward.h"
#include "kinematics/inverse.h"
#include "tools/io/hexapod_file.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const hexcal::PlatformGeometry machine = hexcal::read_hexapod_file(argv[1]);
  const hexcal::Pose pose{{5, -3, 2}, Eigen::Vector3d(2, -1, 3) * hexcal::kRadPerDeg};
  const hexcal::LegVector readings = hexcal::readings_at(machine, machine.B_from_P(pose));
  const auto forward = hexcal::forward_kinematics(machine, hexcal::lengths_from_readings(machine, readings));
  if (!forward.B_from_P) return 1;
  const hexcal::Vector6d back = machine.pose_from_B_from_P(*forward.B_from_P).vector();
  std::printf("readings %.3f %.3f %.3f %.3f %.3f %.3f\n", readings[0], readings[1], readings[2], readings[3],
              readings[4], readings[5]);
  return (back - pose.vector()).norm() < 1e-9 ? 0 : 1;
}
