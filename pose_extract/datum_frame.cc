#include "pose_extract/datum_frame.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "kinematics/geometry/covariance.h"
#include "kinematics/geometry/median.h"

namespace hexcal {
namespace {

constexpr int kIterations = 30;
constexpr double kOutlierSigmas = 5.0;
constexpr double kNarrowest = 0.01;  // least width over length of the points that set a frame

struct DatumPoint {
  const NominalPoint* nominal = nullptr;
  Eigen::Vector3d in_body;
  Eigen::Matrix3Xd by_error;
  Eigen::Matrix3d covariance;  // of in_body
  bool used = true;
};

using Matrix37d = Eigen::Matrix<double, 3, 7>;
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

std::vector<DatumPoint> collect_points(const Network& network, const AdjustmentResult& adjusted, int body,
                                       const std::vector<NominalPoint>& nominal) {
  std::vector<DatumPoint> points;
  for (const NominalPoint& known : nominal) {
    const int marker = measured_marker(network, adjusted, body, known.point.id);
    if (marker < 0) continue;
    DatumPoint point;
    point.nominal = &known;
    EstimatedPoint estimate = adjusted.point(marker, known.point.corner);
    point.in_body = estimate.in_body;
    point.covariance = estimate.covariance();
    point.by_error = std::move(estimate.by_error);
    points.push_back(std::move(point));
  }
  return points;
}

Matrix37d jacobian_at(const Rigid3& frame_from_body, double scale, const Eigen::Vector3d& in_body) {
  const Eigen::Vector3d turned = frame_from_body.rotation * (scale * in_body);
  Matrix37d j;
  j << Eigen::Matrix3d::Identity(), -skew(turned), turned;
  return j;
}

Eigen::Matrix3d weight_of(const DatumPoint& point, const Rigid3& frame_from_body) {
  const Eigen::Matrix3d r = frame_from_body.rotation_matrix();
  return (point.nominal->sigma_mm * point.nominal->sigma_mm * Eigen::Matrix3d::Identity() +
          r * point.covariance * r.transpose())
      .inverse();
}

// Start from every triple of a few spread points; the one with the least median residual wins, so that up to
// half of the nominal coordinates may be wrong. False if no triple spans a triangle.
bool start_robustly(const std::vector<DatumPoint>& points, bool with_scale, DatumFrame& frame) {
  const std::size_t n = points.size();
  const std::size_t stride = std::max<std::size_t>(1, n / 12);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < n; a += stride) {
    for (std::size_t b = a + 1; b < n; b += stride) {
      for (std::size_t c = b + 1; c < n; c += stride) {
        Eigen::Matrix3d from;
        Eigen::Matrix3d to;
        const std::size_t pick[3] = {a, b, c};
        for (int i = 0; i < 3; ++i) {
          from.col(i) = points[pick[i]].in_body;
          to.col(i) = points[pick[i]].nominal->xyz_mm;
        }
        const Eigen::Vector3d u = from.col(1) - from.col(0);
        const Eigen::Vector3d v = from.col(2) - from.col(0);
        if (u.cross(v).norm() < 0.05 * u.norm() * v.norm() || u.norm() < 1e-6) continue;
        const Eigen::Matrix4d t = Eigen::umeyama(from, to, with_scale);
        const double scale = std::cbrt(t.topLeftCorner<3, 3>().determinant());
        if (!(scale > 0)) continue;
        const Rigid3 motion(Eigen::Matrix3d(t.topLeftCorner<3, 3>() / scale), t.topRightCorner<3, 1>());
        std::vector<double> off;
        for (const DatumPoint& point : points) {
          off.push_back((motion * (scale * point.in_body) - point.nominal->xyz_mm).norm());
        }
        const double value = median(off);
        if (value >= least) continue;
        least = value;
        frame.frame_from_body = motion;
        frame.scale = scale;
      }
    }
  }
  return std::isfinite(least);
}

// The used points leave the turn about a line open, as good as.
bool on_a_line(const std::vector<DatumPoint>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double count = 0;
  for (const DatumPoint& point : points) {
    if (!point.used) continue;
    mean += point.in_body;
    count += 1;
  }
  mean /= count;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const DatumPoint& point : points) {
    if (point.used) scatter += (point.in_body - mean) * (point.in_body - mean).transpose();
  }
  const Eigen::Vector3d spread =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter, Eigen::EigenvaluesOnly).eigenvalues();
  return !(spread[1] > kNarrowest * kNarrowest * spread[2]);
}

}  // namespace

int measured_marker(const Network& network, const AdjustmentResult& adjusted, int body, int id) {
  for (std::size_t m = 0; m < network.features.size(); ++m) {
    if (network.features[m].id == id && network.features[m].body == body &&
        adjusted.geometry.has_feature[m]) {
      return static_cast<int>(m);
    }
  }
  return -1;
}

DatumFrame frame_from_nominal(const Network& network, const AdjustmentResult& adjusted, int body,
                              const std::vector<NominalPoint>& nominal, bool with_scale) {
  DatumFrame frame;
  std::vector<DatumPoint> points = collect_points(network, adjusted, body, nominal);
  if (points.size() < 3) {
    frame.reason = fmt::format("only {} of the {} nominal points were measured, wanted at least 3",
                               points.size(), nominal.size());
    return frame;
  }
  if (!start_robustly(points, with_scale, frame)) {
    frame.reason = "its nominal points lie on a line";
    return frame;
  }
  Matrix7d inverse_normal = Matrix7d::Zero();
  for (int i = 0; i < kIterations; ++i) {
    // Robust scale: nominal sigmas may promise too much.
    std::vector<double> normalised;
    std::vector<Eigen::Vector3d> residuals;
    for (const DatumPoint& point : points) {
      const Eigen::Vector3d r = point.nominal->xyz_mm - frame.frame_from_body * (frame.scale * point.in_body);
      residuals.push_back(r);
      normalised.push_back(std::sqrt(r.dot(weight_of(point, frame.frame_from_body) * r) / 3));
    }
    const double limit = kOutlierSigmas * std::max(1.0, median(normalised));
    Matrix7d normal = Matrix7d::Zero();
    Vector7d right = Vector7d::Zero();
    for (std::size_t p = 0; p < points.size(); ++p) {
      points[p].used = normalised[p] <= limit;
      if (!points[p].used) continue;
      const Matrix37d j = jacobian_at(frame.frame_from_body, frame.scale, points[p].in_body);
      const Eigen::Matrix3d w = weight_of(points[p], frame.frame_from_body);
      normal += j.transpose() * w * j;
      right += j.transpose() * w * residuals[p];
    }
    if (std::count_if(points.begin(), points.end(), [](const DatumPoint& p) { return p.used; }) < 3) {
      frame.reason = "fewer than 3 of its nominal points agree with the measurement";
      return frame;
    }
    if (on_a_line(points)) {
      frame.reason = "those of its nominal points that agree with the measurement lie on a line";
      return frame;
    }
    if (!with_scale) {
      normal.row(6).setZero();
      normal.col(6).setZero();
      normal(6, 6) = 1;
      right[6] = 0;
    }
    inverse_normal = normal.inverse();
    const Vector7d step = inverse_normal * right;
    frame.frame_from_body = perturbed(frame.frame_from_body, step.head<6>());
    frame.scale *= std::exp(step[6]);
    if (step.norm() < 1e-12) break;
  }
  frame.by_error = Eigen::Matrix<double, 7, Eigen::Dynamic>::Zero(7, adjusted.num_errors());
  const Eigen::Matrix3d rotation = frame.frame_from_body.rotation_matrix();
  for (const DatumPoint& point : points) {
    const Eigen::Vector3d measured = frame.frame_from_body * (frame.scale * point.in_body);
    const Eigen::Matrix3d w = weight_of(point, frame.frame_from_body);
    frame.residuals.push_back({point.nominal->point, measured - point.nominal->xyz_mm,
                               std::sqrt(w.inverse().trace() / 3), point.used});
    if (!point.used) {
      frame.notes.push_back(fmt::format(
          "nominal point {}{} is {:.3f} mm off and was left out", point.nominal->point.id,
          point.nominal->point.corner < 0 ? std::string() : fmt::format(".{}", point.nominal->point.corner),
          frame.residuals.back().residual_mm.norm()));
      continue;
    }
    Eigen::Matrix<double, 7, 3> gain =
        inverse_normal * jacobian_at(frame.frame_from_body, frame.scale, point.in_body).transpose() * w;
    if (!with_scale) gain.row(6).setZero();
    frame.by_error -= gain * (frame.scale * rotation) * point.by_error;
    frame.own += gain * (point.nominal->sigma_mm * point.nominal->sigma_mm) * gain.transpose();
  }
  frame.ok = true;
  frame.reason.clear();
  return frame;
}

DatumFrame frame_from_first_marker(const Network& network, const AdjustmentResult& adjusted, int body) {
  DatumFrame frame;
  frame.by_error = Eigen::Matrix<double, 7, Eigen::Dynamic>::Zero(7, adjusted.num_errors());
  for (std::size_t m = 0; m < network.features.size(); ++m) {
    if (network.features[m].body != body || !adjusted.geometry.has_feature[m]) continue;
    const Rigid3& body_from_marker = adjusted.geometry.body_from_feature[m];
    frame.frame_from_body = inverse(body_from_marker);
    frame.by_error.topRows<6>() =
        inverse_jacobian(body_from_marker) * adjusted.body_from_feature(static_cast<int>(m)).by_error;
    frame.ok = true;
    frame.reason.clear();
    return frame;
  }
  frame.reason = "none of its markers was measured";
  return frame;
}

}  // namespace hexcal
