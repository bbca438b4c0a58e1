#include "kinematics/leg_elimination.h"

#include <cmath>

namespace hexcal {

LegArray::Lanes in_order(const LegArray::Lanes& lanes, const LegOrder& order) {
  LegArray::Lanes out;
  for (std::size_t lane = 0; lane < 6; ++lane) out[static_cast<Eigen::Index>(lane)] = lanes[order[lane]];
  return out;
}

bool is_odd(const LegOrder& order) {
  bool odd = false;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i + 1; j < 6; ++j) odd ^= order[i] > order[j];
  }
  return odd;
}

LegOrder LegElimination::spanning_order(const Columns& columns) {
  std::array<Eigen::Vector3d, 6> unit;
  for (std::size_t i = 0; i < 6; ++i) unit[i] = direction(columns, static_cast<Eigen::Index>(i)).normalized();
  LegOrder order{0, 1, 2, 3, 4, 5};
  double largest = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i + 1; j < 6; ++j) {
      const Eigen::Vector3d normal = unit[i].cross(unit[j]);
      for (std::size_t k = j + 1; k < 6; ++k) {
        const double volume = std::abs(normal.dot(unit[k]));
        if (!(volume > largest)) continue;
        largest = volume;
        std::size_t first = 0;
        std::size_t other = 1;
        for (std::size_t n = 0; n < 6; ++n) {
          std::size_t& lane = n == i || n == j || n == k ? first : other;
          order[lane] = static_cast<Eigen::Index>(n);
          lane += 2;
        }
      }
    }
  }
  return order;
}

}  // namespace hexcal
