#include "pose_extract/feature_fit.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "kinematics/geometry/rigid3.h"

namespace hexcal {
namespace {

constexpr int kFitIterations = 50;

// A feature as numbers for Gauss-Newton: place, direction turned about two axes square to it, radius.
struct Shape {
  Eigen::Vector3d place, direction;
  double radius;
};

bool has_direction(Feature::Kind kind) {
  return kind == Feature::Kind::plane || kind == Feature::Kind::line || kind == Feature::Kind::circle ||
         kind == Feature::Kind::cylinder;
}
bool has_radius(Feature::Kind kind) {
  return kind == Feature::Kind::circle || kind == Feature::Kind::cylinder || kind == Feature::Kind::sphere;
}

std::size_t fewest_points(Feature::Kind kind) {
  switch (kind) {
    case Feature::Kind::point:
      return 1;
    case Feature::Kind::line:
      return 2;
    case Feature::Kind::plane:
    case Feature::Kind::circle:
      return 3;
    case Feature::Kind::sphere:
      return 4;
    case Feature::Kind::cylinder:
      return 5;
  }
  return 1;
}

// Distances of a point from the feature: one or two numbers.
int distances(Feature::Kind kind, const Shape& shape, const Eigen::Vector3d& point,
              const Eigen::Vector3d& centre, double out[2]) {
  const Eigen::Vector3d d = point - shape.place;
  const double along = d.dot(shape.direction);
  const double across = (d - along * shape.direction).norm();
  switch (kind) {
    case Feature::Kind::plane:
      out[0] = along;
      return 1;
    case Feature::Kind::line: {
      // Two components square to the line.
      const Eigen::Vector3d u = shape.direction.unitOrthogonal();
      out[0] = d.dot(u);
      out[1] = d.dot(shape.direction.cross(u));
      return 2;
    }
    case Feature::Kind::circle:
      out[0] = along;
      out[1] = across - shape.radius;
      return 2;
    case Feature::Kind::cylinder: {
      const Eigen::Vector3d to_centre = centre - shape.place;
      const Eigen::Vector3d radial = to_centre - to_centre.dot(shape.direction) * shape.direction;
      out[0] = d.dot(radial.normalized()) - shape.radius;
      return 1;
    }
    case Feature::Kind::sphere:
      out[0] = d.norm() - shape.radius;
      return 1;
    case Feature::Kind::point:
      break;
  }
  return 0;
}

Shape moved(const Shape& shape, const Eigen::VectorXd& step, Feature::Kind kind) {
  Shape out = shape;
  out.place += step.head<3>();
  if (has_direction(kind)) {
    const Eigen::Vector3d u = shape.direction.unitOrthogonal();
    out.direction = (shape.direction + step[3] * u + step[4] * shape.direction.cross(u)).normalized();
  }
  out.radius += step[5];
  return out;
}

Shape start(Feature::Kind kind, const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& normals) {
  const Eigen::Vector3d centroid = points.rowwise().mean();
  const Eigen::Matrix3Xd centred = points.colwise() - centroid;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(centred * centred.transpose());
  Shape shape{centroid, spread.eigenvectors().col(kind == Feature::Kind::line ? 2 : 0), 0};
  if (kind == Feature::Kind::cylinder) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> faces(normals * normals.transpose());
    shape.direction = faces.eigenvectors().col(0);
  }
  if (!has_radius(kind)) return shape;
  // Algebraic circle or sphere (Kasa): |x|^2 = 2 c.x + k in the coordinates that count.
  Eigen::Matrix3d across = Eigen::Matrix3d::Identity();
  if (kind != Feature::Kind::sphere) across -= shape.direction * shape.direction.transpose();
  const Eigen::Matrix3Xd flat = across * centred;
  Eigen::MatrixXd a(points.cols(), 4);
  a << 2 * flat.transpose(), Eigen::VectorXd::Ones(points.cols());
  const Eigen::VectorXd b = flat.colwise().squaredNorm();
  const Eigen::Vector4d solution = Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(a).solve(b);
  const Eigen::Vector3d centre = across * solution.head<3>();
  shape.place += centre;
  shape.radius = std::sqrt(std::max(0.0, solution[3] + centre.squaredNorm()));
  return shape;
}

}  // namespace

FittedFeature fit_feature(Feature::Kind kind, const Eigen::Matrix3Xd& points, const Eigen::VectorXd& sigma_mm,
                          const Eigen::Matrix3Xd& normals, const Eigen::Matrix3Xd& centres,
                          const std::vector<char>& used) {
  FittedFeature fitted;
  fitted.used = used;
  std::vector<Eigen::Index> kept;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) kept.push_back(static_cast<Eigen::Index>(i));
  }
  if (kept.size() < fewest_points(kind)) {
    fitted.reason = "too few of its points were measured";
    return fitted;
  }
  Eigen::Matrix3Xd chosen(3, static_cast<Eigen::Index>(kept.size()));
  Eigen::Matrix3Xd faces(3, static_cast<Eigen::Index>(kept.size()));
  double weights = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < kept.size(); ++i) {
    chosen.col(static_cast<Eigen::Index>(i)) = points.col(kept[i]);
    faces.col(static_cast<Eigen::Index>(i)) = normals.col(kept[i]);
    const double weight = 1 / (sigma_mm[kept[i]] * sigma_mm[kept[i]]);
    mean += weight * points.col(kept[i]);
    weights += weight;
  }
  mean /= weights;
  fitted.distance_mm.assign(used.size(), 0);
  if (kind == Feature::Kind::point) {
    fitted.place = mean;
    fitted.ok = true;
    return fitted;
  }
  Shape shape = start(kind, chosen, faces);
  for (int iteration = 0; iteration < kFitIterations; ++iteration) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(6, 6);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(6);
    for (const Eigen::Index i : kept) {
      double r[2] = {0, 0};
      const int rows = distances(kind, shape, points.col(i), centres.col(i), r);
      for (int k = 0; k < rows; ++k) {
        // Central differences: the distances are smooth and cheap, the step far above rounding.
        Eigen::Matrix<double, 6, 1> j = Eigen::Matrix<double, 6, 1>::Zero();
        for (int c = 0; c < 6; ++c) {
          const double h = c == 3 || c == 4 ? 1e-6 : 1e-4;
          double plus[2];
          double minus[2];
          (void)distances(kind, moved(shape, h * Eigen::VectorXd::Unit(6, c), kind), points.col(i),
                          centres.col(i), plus);
          (void)distances(kind, moved(shape, -h * Eigen::VectorXd::Unit(6, c), kind), points.col(i),
                          centres.col(i), minus);
          j[c] = (plus[k] - minus[k]) / (2 * h);
        }
        const double weight = 1 / (sigma_mm[i] * sigma_mm[i]);
        normal += weight * j * j.transpose();
        right -= weight * r[k] * j;
      }
    }
    if (!normal.allFinite() || !right.allFinite()) {
      fitted.reason = "the fit has no solution";
      return fitted;
    }
    // The place may slide along a plane, line or axis: the smallest step is taken.
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
    decomposition.setThreshold(1e-10);
    decomposition.compute(normal);
    const Eigen::VectorXd step = decomposition.solve(right);
    shape = moved(shape, step, kind);
    if (step.norm() < 1e-12) break;
  }
  // A sliding place is brought next to the weighted centroid.
  if (kind == Feature::Kind::plane)
    shape.place = mean - (mean - shape.place).dot(shape.direction) * shape.direction;
  if (kind == Feature::Kind::line || kind == Feature::Kind::cylinder) {
    shape.place += (mean - shape.place).dot(shape.direction) * shape.direction;
  }
  if (kind == Feature::Kind::line && shape.direction.dot(chosen.rightCols<1>() - chosen.leftCols<1>()) < 0) {
    shape.direction = -shape.direction;
  }
  double least = 0;
  double most = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    double r[2] = {0, 0};
    const int rows = distances(kind, shape, points.col(i), centres.col(i), r);
    const bool by_radius = kind == Feature::Kind::circle && std::abs(r[1]) > std::abs(r[0]);
    const double distance = kind == Feature::Kind::line ? std::hypot(r[0], r[1])
                            : rows == 2 && by_radius    ? r[1]
                                                        : r[0];
    fitted.distance_mm[static_cast<std::size_t>(i)] = distance;
    if (!used[static_cast<std::size_t>(i)]) continue;
    least = std::min(least, distance);
    most = std::max(most, distance);
  }
  fitted.form_error_mm = most - least;
  fitted.place = shape.place;
  fitted.direction = has_direction(kind) ? shape.direction : Eigen::Vector3d::Zero();
  fitted.radius_mm = shape.radius;
  fitted.ok = fitted.place.allFinite() && fitted.direction.allFinite();
  if (fitted.ok) fitted.reason.clear();
  return fitted;
}

}  // namespace hexcal
