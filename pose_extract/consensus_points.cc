// The only source that includes PCL.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_circle3d.h>
#include <pcl/sample_consensus/sac_model_line.h>
#include <pcl/sample_consensus/sac_model_plane.h>
#include <pcl/sample_consensus/sac_model_sphere.h>

#include "pose_extract/feature_fit.h"

namespace hexcal {
namespace {

constexpr int kMaxIterations = 2000;
constexpr std::size_t kExtraPoints = 2;  // beyond a minimal sample: fewer leave nothing to choose

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

std::vector<char> inliers_of(const pcl::SampleConsensusModel<pcl::PointXYZ>::Ptr& model, std::size_t count,
                             double tolerance_mm) {
  std::vector<char> used(count, 1);
  if (count < static_cast<std::size_t>(model->getSampleSize()) + kExtraPoints) return used;
  pcl::RandomSampleConsensus<pcl::PointXYZ> ransac(model, tolerance_mm);  // PCL seeds it with a constant
  ransac.setMaxIterations(kMaxIterations);
  ransac.setProbability(0.9999);
  if (!ransac.computeModel()) return used;
  pcl::Indices inliers;
  ransac.getInliers(inliers);
  used.assign(count, 0);
  for (const auto i : inliers) used[static_cast<std::size_t>(i)] = 1;
  return used;
}

}  // namespace

std::vector<char> consensus_points(Feature::Kind kind, const Eigen::Matrix3Xd& points, double tolerance_mm) {
  const auto count = static_cast<std::size_t>(points.cols());
  // PCL computes in float: coordinates go in relative to the centroid.
  const Eigen::Vector3d centroid = points.rowwise().mean();
  const Cloud::Ptr cloud(new Cloud);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3f p = (points.col(i) - centroid).cast<float>();
    cloud->push_back({p.x(), p.y(), p.z()});
  }
  switch (kind) {
    case Feature::Kind::plane:
      return inliers_of(std::make_shared<pcl::SampleConsensusModelPlane<pcl::PointXYZ>>(cloud), count,
                        tolerance_mm);
    case Feature::Kind::line:
      return inliers_of(std::make_shared<pcl::SampleConsensusModelLine<pcl::PointXYZ>>(cloud), count,
                        tolerance_mm);
    case Feature::Kind::circle:
      return inliers_of(std::make_shared<pcl::SampleConsensusModelCircle3D<pcl::PointXYZ>>(cloud), count,
                        tolerance_mm);
    case Feature::Kind::sphere:
      return inliers_of(std::make_shared<pcl::SampleConsensusModelSphere<pcl::PointXYZ>>(cloud), count,
                        tolerance_mm);
    case Feature::Kind::point:
    case Feature::Kind::cylinder:
      break;  // a cylinder is made robust by its residuals (datum_features.cc)
  }
  return std::vector<char>(count, 1);
}

}  // namespace hexcal
