#include "photogrammetry/adjustment/planar_pose.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "kinematics/geometry/covariance.h"
#include "kinematics/geometry/rigid3.h"

namespace hexcal {
namespace {

constexpr int kRefinements = 8;

// Homography from the marker's plane (mm, centred) to normalised image coordinates.
std::optional<Eigen::Matrix3d> plane_homography(const std::array<Eigen::Vector2d, 4>& image,
                                                const DrawnPoints& drawn_mm) {
  Eigen::Matrix<double, 8, 8> a = Eigen::Matrix<double, 8, 8>::Zero();
  Vector8d b;
  for (int c = 0; c < 4; ++c) {
    const Eigen::Vector3d corner = drawn_mm.col(c);
    const Eigen::Vector2d& n = image[static_cast<std::size_t>(c)];
    a.block<1, 8>(2 * c, 0) << corner.x(), corner.y(), 1, 0, 0, 0, -n.x() * corner.x(), -n.x() * corner.y();
    a.block<1, 8>(2 * c + 1, 0) << 0, 0, 0, corner.x(), corner.y(), 1, -n.y() * corner.x(),
        -n.y() * corner.y();
    b.segment<2>(2 * c) = n;
  }
  const Eigen::FullPivLU<Eigen::Matrix<double, 8, 8>> lu(a);
  if (!lu.isInvertible()) return std::nullopt;
  const Vector8d h = lu.solve(b);
  Eigen::Matrix3d homography;
  homography << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1;
  if (!homography.allFinite()) return std::nullopt;
  return homography;
}

// Translation that fits the corners best in the image for a given rotation (linear least squares).
Eigen::Vector3d translation_for(const Eigen::Matrix3d& rotation, const std::array<Eigen::Vector2d, 4>& image,
                                const DrawnPoints& drawn_mm) {
  Eigen::Matrix<double, 8, 3> a;
  Vector8d b;
  for (int c = 0; c < 4; ++c) {
    const Eigen::Vector3d x = rotation * drawn_mm.col(c);
    const Eigen::Vector2d& n = image[static_cast<std::size_t>(c)];
    a.row(2 * c) << 1, 0, -n.x();
    a.row(2 * c + 1) << 0, 1, -n.y();
    b[2 * c] = n.x() * x.z() - x.x();
    b[2 * c + 1] = n.y() * x.z() - x.y();
  }
  return (a.transpose() * a).ldlt().solve(a.transpose() * b);
}

std::vector<Rigid3> closed_form(const Eigen::Matrix3d& h, const std::array<Eigen::Vector2d, 4>& image,
                                const DrawnPoints& drawn_mm) {
  const double p = h(0, 2);
  const double q = h(1, 2);
  Eigen::Matrix2d jacobian;  // of the homography at the marker's centre
  jacobian << h(0, 0) - h(2, 0) * p, h(0, 1) - h(2, 1) * p, h(1, 0) - h(2, 0) * q, h(1, 1) - h(2, 1) * q;
  // The smallest rotation that takes the optical axis to the line of sight (p, q, 1), by Rodrigues' formula.
  const Eigen::Vector3d sight = Eigen::Vector3d(p, q, 1).normalized();
  const Eigen::Matrix3d axis = skew(Eigen::Vector3d::UnitZ().cross(sight));
  const Eigen::Matrix3d to_sight = Eigen::Matrix3d::Identity() + axis + axis * axis / (1 + sight.z());
  Eigen::Matrix<double, 2, 3> perspective;
  perspective << 1, 0, -p, 0, 1, -q;
  const Eigen::Matrix2d b = perspective * to_sight.leftCols<2>();
  const Eigen::Matrix2d a = b.inverse() * jacobian;
  const double gamma = a.jacobiSvd().singularValues()[0];
  if (!(gamma > 0) || !std::isfinite(gamma)) return {};
  const Eigen::Matrix2d r = a / gamma;
  const Eigen::Matrix2d rest = Eigen::Matrix2d::Identity() - r.transpose() * r;
  const double b1 = std::sqrt(std::max(0.0, rest(0, 0)));
  const double b2 = std::copysign(std::sqrt(std::max(0.0, rest(1, 1))), rest(0, 1));
  std::vector<Rigid3> poses;
  for (const double sign : {1.0, -1.0}) {
    Eigen::Matrix3d rotation;
    rotation.col(0) << r.col(0), sign * b1;
    rotation.col(1) << r.col(1), sign * b2;
    rotation.col(2) = rotation.col(0).cross(rotation.col(1));
    rotation = to_sight * rotation;
    const Eigen::Vector3d translation = translation_for(rotation, image, drawn_mm);
    // The marker must be in front and show its face.
    if (translation.z() > 0 && rotation.col(2).dot(translation) < 0)
      poses.emplace_back(rotation, translation);
  }
  return poses;
}

}  // namespace

std::vector<PlanarPose> planar_marker_poses(const CameraModel& camera, const Vector8d& corners_px,
                                            const NetworkFeature& square) {
  std::array<Eigen::Vector2d, 4> image;
  for (int c = 0; c < 4; ++c) {
    const auto normalised = camera.normalised_from_image(corners_px.segment<2>(2 * c));
    if (!normalised) return {};
    image[static_cast<std::size_t>(c)] = *normalised;
  }
  const auto homography = plane_homography(image, square.drawn_mm);
  if (!homography) return {};
  std::vector<PlanarPose> poses;
  for (Rigid3 pose : closed_form(*homography, image, square.drawn_mm)) {
    const Rigid3 marker;
    Vector8d px;
    FeatureJacobian jacobian;
    jacobian.with_shape = false;
    bool good = true;
    for (int i = 0; i < kRefinements && good; ++i) {
      good = project_drawn({camera, pose, nullptr, marker}, square, px, &jacobian);
      if (!good) break;
      const Vector6d step = (jacobian.station.transpose() * jacobian.station)
                                .ldlt()
                                .solve(jacobian.station.transpose() * (corners_px - px));
      good = step.allFinite();
      if (good) pose = perturbed(pose, step);
      if (step.head<3>().norm() < 1e-9 * pose.translation.norm() && step.tail<3>().norm() < 1e-9) break;
    }
    good = good && project_drawn({camera, pose, nullptr, marker}, square, px, nullptr);
    if (good) poses.push_back({pose, (corners_px - px).norm() / std::sqrt(8.0)});
  }
  std::stable_sort(poses.begin(), poses.end(),
                   [](const PlanarPose& a, const PlanarPose& b) { return a.rms_px < b.rms_px; });
  // Both may have run into the same minimum.
  if (poses.size() == 2 &&
      rotation_distance(poses[0].camera_from_marker.rotation, poses[1].camera_from_marker.rotation) < 1e-6) {
    poses.pop_back();
  }
  return poses;
}

}  // namespace hexcal
