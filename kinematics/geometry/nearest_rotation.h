#pragma once

#include <Eigen/Core>

namespace hexcal {

/// The rotation nearest to a matrix in the Frobenius norm: its projection on SO(3) by its SVD (Kabsch, Acta
/// Cryst. A32 (1976) 922; Umeyama 1991). Of a sum of to * from^T it is the rotation that takes the vectors
/// `from` nearest to those of `to`.
[[nodiscard]] Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m);

}  // namespace hexcal
