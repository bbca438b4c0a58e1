#include "kinematics/leg_array.h"

namespace hexcal {

LegArray::LegArray(const PlatformGeometry& geometry) {
  for (std::size_t i = 0; i < 6; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d& a = geometry.base_joints_mm[i];
    const Eigen::Vector3d& b = geometry.platform_joints_mm[i];
    ax[k] = a.x();
    ay[k] = a.y();
    az[k] = a.z();
    bx[k] = b.x();
    by[k] = b.y();
    bz[k] = b.z();
  }
}

}  // namespace hexcal
