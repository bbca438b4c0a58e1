#include "pose_extract/nominal_points.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "kinematics/geometry/chi_squared.h"
#include "kinematics/geometry/covariance.h"
#include "kinematics/geometry/median.h"
#include "pose_extract/datum_frame.h"

namespace hexcal {
namespace {

constexpr int kPlacementIterations = 60;
// Where no sigma is stated, points still differ by rounding and by the paper's thickness.
constexpr double kLeastSigmaMm = 1e-3;
// Stated sigmas hold unless chance makes such residuals so rarely.
constexpr double kContradictedProbability = 0.01;
constexpr std::size_t kFewestTelling = 3;  // stickers that tell how they were placed
constexpr double kFewestFreedom = 3;       // of a component, for Student's factor
constexpr double kLargestFactor = 3;       // of it, on the variance

using Matrix3X7d = Eigen::Matrix<double, Eigen::Dynamic, 7>;

Matrix3X7d jacobian_of(const NominalSticker& sticker, const NominalFit& fit) {
  Matrix3X7d j(3 * sticker.in_body.cols(), 7);
  for (Eigen::Index i = 0; i < sticker.in_body.cols(); ++i) {
    const Eigen::Vector3d turned = fit.frame_from_body.rotation * (fit.scale * sticker.in_body.col(i));
    j.middleRows<3>(3 * i) << Eigen::Matrix3d::Identity(), -skew(turned), turned;
  }
  if (!fit.with_scale) j.col(6).setZero();
  return j;
}

Eigen::VectorXd residuals_of(const NominalSticker& sticker, const NominalFit& fit) {
  Eigen::VectorXd r(3 * sticker.in_body.cols());
  for (Eigen::Index i = 0; i < sticker.in_body.cols(); ++i) {
    r.segment<3>(3 * i) = sticker.points[static_cast<std::size_t>(i)].xyz_mm -
                          fit.frame_from_body * (fit.scale * sticker.in_body.col(i));
  }
  return r;
}

// d(points)/d(shift of the sticker), 3m x 3, and by its turn about the mean of its points.
Eigen::MatrixXd by_shift(const NominalSticker& sticker) {
  Eigen::MatrixXd g(3 * sticker.in_body.cols(), 3);
  for (Eigen::Index i = 0; i < sticker.in_body.cols(); ++i) g.middleRows<3>(3 * i).setIdentity();
  return g;
}

Eigen::MatrixXd by_turn(const NominalSticker& sticker, const NominalFit& fit) {
  const Eigen::Vector3d middle = sticker.in_body.rowwise().mean();
  Eigen::MatrixXd g(3 * sticker.in_body.cols(), 3);
  for (Eigen::Index i = 0; i < sticker.in_body.cols(); ++i) {
    g.middleRows<3>(3 * i) =
        -skew(fit.frame_from_body.rotation * (fit.scale * (sticker.in_body.col(i) - middle)));
  }
  return g;
}

// Inverse of the whole covariance, zero for points that are not used.
Eigen::MatrixXd weight_of(const NominalSticker& sticker, const NominalFit& fit) {
  const Eigen::Index m = sticker.in_body.cols();
  const Eigen::Matrix3d r = fit.scale * fit.frame_from_body.rotation_matrix();
  Eigen::MatrixXd covariance = nominal_covariance(sticker, fit);
  for (Eigen::Index a = 0; a < m; ++a) {
    for (Eigen::Index b = 0; b < m; ++b)
      covariance.block<3, 3>(3 * a, 3 * b) +=
          r * sticker.covariance.block<3, 3>(3 * a, 3 * b) * r.transpose();
  }
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < 3 * m; ++i) {
    if (sticker.used[static_cast<std::size_t>(i / 3)]) kept.push_back(i);
  }
  Eigen::MatrixXd weight = Eigen::MatrixXd::Zero(3 * m, 3 * m);
  const Eigen::MatrixXd inverse = Eigen::MatrixXd(covariance(kept, kept)).inverse();
  weight(kept, kept) = inverse;
  return weight;
}

// Without what the seven (six) parameters of a motion of the whole body explain: the errors of far stickers
// otherwise hold those of the one that the body's frame hangs on.
void take_out_common_motion(std::vector<NominalSticker>& stickers) {
  NominalFit unit;
  unit.with_scale = true;
  Matrix7d normal = 1e-9 * Matrix7d::Identity();
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(7, stickers.front().by_error.cols());
  for (const NominalSticker& sticker : stickers) {
    const Matrix3X7d j = jacobian_of(sticker, unit);
    normal += j.transpose() * j;
    right += j.transpose() * sticker.by_error;
  }
  const Eigen::MatrixXd common = normal.ldlt().solve(right);
  for (NominalSticker& sticker : stickers) {
    const Eigen::MatrixXd own = sticker.by_error - jacobian_of(sticker, unit) * common;
    sticker.covariance = own * own.transpose();
  }
}

}  // namespace

bool NominalSticker::any_used() const {
  return std::any_of(used.begin(), used.end(), [](char u) { return u != 0; });
}

std::vector<NominalSticker> nominal_stickers(const Network& network, const AdjustmentResult& adjusted,
                                             int body, const std::vector<NominalPoint>& nominal) {
  std::map<int, NominalSticker> by_id;
  for (const NominalPoint& point : nominal) {
    if (measured_marker(network, adjusted, body, point.point.id) < 0) continue;
    NominalSticker& sticker = by_id[point.point.id];
    sticker.id = point.point.id;
    sticker.points.push_back(point);
  }
  std::vector<NominalSticker> stickers;
  for (auto& [id, sticker] : by_id) {
    const auto m = static_cast<Eigen::Index>(sticker.points.size());
    sticker.used.assign(sticker.points.size(), 1);
    sticker.in_body.resize(3, m);
    sticker.by_error.resize(3 * m, adjusted.num_errors());
    const int marker = measured_marker(network, adjusted, body, id);
    for (Eigen::Index i = 0; i < m; ++i) {
      const EstimatedPoint point =
          adjusted.point(marker, sticker.points[static_cast<std::size_t>(i)].point.corner);
      sticker.in_body.col(i) = point.in_body;
      sticker.by_error.middleRows<3>(3 * i) = point.by_error;
    }
    stickers.push_back(std::move(sticker));
  }
  if (!stickers.empty()) take_out_common_motion(stickers);
  return stickers;
}

std::optional<RobustMotion> robust_motion(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                                          bool with_scale) {
  const Eigen::Index n = from.cols();
  const Eigen::Index stride = std::max<Eigen::Index>(1, n / 12);
  RobustMotion best;
  best.median_mm = std::numeric_limits<double>::infinity();
  std::vector<double> off(static_cast<std::size_t>(n));
  for (Eigen::Index a = 0; a < n; a += stride) {
    for (Eigen::Index b = a + 1; b < n; b += stride) {
      for (Eigen::Index c = b + 1; c < n; c += stride) {
        const std::vector<Eigen::Index> pick{a, b, c};
        const Eigen::Matrix3d three = from(Eigen::all, pick);
        const Eigen::Vector3d u = three.col(1) - three.col(0);
        const Eigen::Vector3d v = three.col(2) - three.col(0);
        if (u.cross(v).norm() < 0.05 * u.norm() * v.norm() || u.norm() < 1e-6) continue;
        const Eigen::Matrix4d t = Eigen::umeyama(three, Eigen::Matrix3d(to(Eigen::all, pick)), with_scale);
        const double scale = std::cbrt(t.topLeftCorner<3, 3>().determinant());
        if (!(scale > 0)) continue;
        const Rigid3 motion(Eigen::Matrix3d(t.topLeftCorner<3, 3>() / scale), t.topRightCorner<3, 1>());
        for (Eigen::Index i = 0; i < n; ++i)
          off[static_cast<std::size_t>(i)] = (motion * (scale * from.col(i)) - to.col(i)).norm();
        const double value = median(off);
        if (value >= best.median_mm) continue;
        std::sort(off.begin(), off.end());
        best = {motion, scale, value, off[(4 * off.size()) / 5]};
      }
    }
  }
  if (!std::isfinite(best.median_mm)) return std::nullopt;
  return best;
}

Eigen::MatrixXd nominal_covariance(const NominalSticker& sticker, const NominalFit& fit) {
  const Eigen::MatrixXd shift = fit.placement.shift_mm * by_shift(sticker);
  const Eigen::MatrixXd turn = fit.placement.turn_rad * by_turn(sticker, fit);
  Eigen::MatrixXd covariance = shift * shift.transpose() + turn * turn.transpose();
  for (std::size_t i = 0; i < sticker.points.size(); ++i) {
    const double sigma = std::hypot(std::max(kLeastSigmaMm, sticker.points[i].sigma_mm), fit.point_mm);
    covariance.diagonal().segment<3>(3 * static_cast<Eigen::Index>(i)).array() += sigma * sigma;
  }
  return covariance;
}

double improve_fit(const std::vector<NominalSticker>& stickers, NominalFit& fit,
                   std::vector<Eigen::MatrixXd>* gains) {
  Matrix7d normal = Matrix7d::Zero();
  Vector7d right = Vector7d::Zero();
  std::vector<Eigen::MatrixXd> weighted;  // J^T W
  fit.chi2 = 0;
  fit.redundancy = fit.with_scale ? -7 : -6;
  for (const NominalSticker& sticker : stickers) {
    const Matrix3X7d j = jacobian_of(sticker, fit);
    const Eigen::VectorXd r = residuals_of(sticker, fit);
    const Eigen::MatrixXd w = weight_of(sticker, fit);
    weighted.emplace_back(j.transpose() * w);
    normal += weighted.back() * j;
    right += weighted.back() * r;
    fit.chi2 += r.dot(w * r);
    fit.redundancy += 3 * static_cast<int>(std::count(sticker.used.begin(), sticker.used.end(), 1));
  }
  if (!fit.with_scale) normal(6, 6) = 1;
  fit.covariance = normal.inverse();
  if (!fit.with_scale) fit.covariance(6, 6) = 0;
  const Vector7d step = fit.covariance * right;
  fit.chi2 -= right.dot(step);
  if (gains != nullptr) {
    gains->clear();
    for (const Eigen::MatrixXd& jw : weighted) gains->emplace_back(fit.covariance * jw);
  }
  fit.frame_from_body = perturbed(fit.frame_from_body, step.head<6>());
  fit.scale *= std::exp(step[6]);
  return step.norm();
}

void fit_placement(const std::vector<NominalSticker>& stickers, NominalFit& fit) {
  std::size_t count = 0;
  bool turns = false;
  bool stated = true;
  double squares = 0;
  for (const NominalSticker& sticker : stickers) {
    if (!sticker.any_used()) continue;
    ++count;
    turns = turns || std::count(sticker.used.begin(), sticker.used.end(), 1) > 1;
    squares += residuals_of(sticker, fit).squaredNorm() / static_cast<double>(3 * sticker.points.size());
    for (const NominalPoint& point : sticker.points) stated = stated && point.sigma_mm > 0;
  }
  const bool contradicted =
      fit.redundancy > 0 && fit.chi2 > chi2_quantile(fit.redundancy, kContradictedProbability);
  if (stated && !contradicted) return;
  // From what is left, and from a turn that moves corners as much.
  fit.placement.shift_mm = std::max(1e-4, std::sqrt(squares / static_cast<double>(count)));
  fit.placement.turn_rad = turns ? std::max(1e-6, fit.placement.shift_mm / 20) : 0;
  // Single points show beside others of their sticker only.
  fit.point_mm = turns ? fit.placement.shift_mm / 3 : 0;
  double freedom_shift = 0, freedom_turn = 0, freedom_point = 0;
  for (int i = 0; i < kPlacementIterations; ++i) {
    for (int k = 0; k < 3; ++k) (void)improve_fit(stickers, fit);
    double squares_shift = 0, squares_turn = 0, squares_point = 0;
    double trace_shift = 0, trace_turn = 0, trace_point = 0;
    for (const NominalSticker& sticker : stickers) {
      if (!sticker.any_used()) continue;
      const Matrix3X7d j = jacobian_of(sticker, fit);
      const Eigen::MatrixXd w = weight_of(sticker, fit);
      const Eigen::VectorXd along = w * residuals_of(sticker, fit);
      const Eigen::MatrixXd projected = w - w * j * fit.covariance * j.transpose() * w;
      const Eigen::MatrixXd shift = by_shift(sticker);
      const Eigen::MatrixXd turn = by_turn(sticker, fit);
      squares_shift += (shift.transpose() * along).squaredNorm();
      squares_turn += (turn.transpose() * along).squaredNorm();
      squares_point += along.squaredNorm();
      trace_point += projected.trace();
      trace_shift += (shift.transpose() * projected * shift).trace();
      trace_turn += (turn.transpose() * projected * turn).trace();
    }
    freedom_shift = trace_shift * fit.placement.shift_mm * fit.placement.shift_mm;
    freedom_turn = trace_turn * fit.placement.turn_rad * fit.placement.turn_rad;
    freedom_point = trace_point * fit.point_mm * fit.point_mm;
    if (freedom_point > 1e-9) fit.point_mm *= std::pow(squares_point / trace_point, 0.25);
    if (freedom_shift > 1e-9) fit.placement.shift_mm *= std::pow(squares_shift / trace_shift, 0.25);
    if (freedom_turn > 1e-9) fit.placement.turn_rad *= std::pow(squares_turn / trace_turn, 0.25);
  }
  // The factor keeps the mean square of error over sigma at 1, as Student's t has it.
  const auto student = [](double freedom) {
    return std::sqrt(freedom > kFewestFreedom ? std::min(kLargestFactor, freedom / (freedom - 2))
                                              : kLargestFactor);
  };
  fit.placement.shift_mm *= student(freedom_shift);
  fit.placement.turn_rad *= student(freedom_turn);
  fit.point_mm *= student(freedom_point);
  if (!stated && count < kFewestTelling) {
    fit.placement.shift_mm = std::max(fit.placement.shift_mm, kHandPlacement.shift_mm);
    if (turns) fit.placement.turn_rad = std::max(fit.placement.turn_rad, kHandPlacement.turn_rad);
  }
  for (int k = 0; k < 3; ++k) (void)improve_fit(stickers, fit);
}

}  // namespace hexcal
