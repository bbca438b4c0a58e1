#include "camera_calib/shared_error_factor.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "camera_calib/projection_difference.h"

namespace hexcal {
namespace {

constexpr int kLeastPhotographs = 5;  // fewer say nothing of their own spread
constexpr int kLeastKeys = 10;
constexpr int kCellsAcross = 12;
constexpr int kCellsDown = 8;

// Numbers 0, 1, ... in the order of first use.
template <typename Key>
class Numbering {
 public:
  int operator()(const Key& key) {
    return numbers_.try_emplace(key, static_cast<int>(numbers_.size())).first->second;
  }
  [[nodiscard]] int count() const { return static_cast<int>(numbers_.size()); }

 private:
  std::map<Key, int> numbers_;
};

int cell_of(const Eigen::Vector2d& px, const CameraModel& camera) {
  const auto along = [](double at, int length, int cells) {
    return std::clamp(static_cast<int>((at + 0.5) * cells / length), 0, cells - 1);
  };
  return along(px.y(), camera.height_px, kCellsDown) * kCellsAcross +
         along(px.x(), camera.width_px, kCellsAcross);
}

double mean_variance(const CameraModel& camera, const Eigen::MatrixXd& covariance) {
  const ProjectionUncertainty uncertainty = projection_uncertainty(camera, covariance, 12, 8);
  double sum = 0;
  for (const Eigen::Matrix2d& at : uncertainty.covariance_px2) sum += at.trace();
  return sum / static_cast<double>(uncertainty.covariance_px2.size());
}

// Keys of the system's rows.
struct RowKeys {
  std::vector<int> photograph, place, point;
  int photographs = 0, places = 0, points = 0;
};

RowKeys keys_of(const std::vector<UsedFeature>& used, const CameraModel& camera) {
  Numbering<int> photographs;
  Numbering<int> places;
  Numbering<std::pair<int, int>> points;
  RowKeys keys;
  for (const UsedFeature& at : used) {
    for (int i = 0; i < at.feature->points(); ++i) {
      for (int axis = 0; axis < 2; ++axis) {
        keys.photograph.push_back(photographs(at.photograph));
        keys.place.push_back(places(cell_of(at.feature->px.segment<2>(2 * i), camera)));
        keys.point.push_back(points({at.sheet, at.feature->first_point}));
      }
    }
  }
  keys.photographs = photographs.count();
  keys.places = places.count();
  keys.points = points.count();
  return keys;
}

std::optional<LeftOut> leave_photographs_out(const ReducedSystem& system,
                                             const std::vector<UsedFeature>& used) {
  Numbering<int> photographs;
  std::vector<int> photograph_of_row;
  for (const UsedFeature& at : used) {
    photograph_of_row.insert(photograph_of_row.end(), static_cast<std::size_t>(2 * at.feature->points()),
                             photographs(at.photograph));
  }
  if (photographs.count() < 2 || system.covariance.size() == 0) return std::nullopt;
  std::vector<int> photograph_of_block;
  for (const ReducedBlock& block : system.blocks) {
    photograph_of_block.push_back(photograph_of_row[static_cast<std::size_t>(block.rows.front())]);
  }
  return leave_groups_out(system, photograph_of_block);
}

}  // namespace

double SharedErrorFactors::largest() const { return std::max({1.0, photographs, places, points}); }

SharedErrorFactors shared_error_factors(
    const ReducedSystem& system, const std::vector<UsedFeature>& used, const CameraModel& camera,
    const std::function<Eigen::MatrixXd(const Eigen::MatrixXd&)>& camera_part, double variance) {
  const double expected = std::max(variance * mean_variance(camera, camera_part(system.covariance)), 1e-300);
  const auto factor = [&](const Eigen::MatrixXd& covariance) {
    return std::sqrt(mean_variance(camera, camera_part(covariance)) / expected);
  };
  const RowKeys keys = keys_of(used, camera);
  SharedErrorFactors out;
  if (keys.photographs >= kLeastPhotographs) {
    if (const auto left_out = leave_photographs_out(system, used)) {
      out.photographs = factor(jackknife_covariance(*left_out));
    }
  }
  if (keys.places >= kLeastKeys) out.places = factor(clustered_covariance(system, keys.place, keys.places));
  if (keys.points >= kLeastKeys) out.points = factor(clustered_covariance(system, keys.point, keys.points));
  return out;
}

std::vector<double> left_out_chi2(const ReducedSystem& system, const std::vector<UsedFeature>& used) {
  const auto left_out = leave_photographs_out(system, used);
  if (!left_out) return {};
  return {left_out->chi2.data(), left_out->chi2.data() + left_out->chi2.size()};
}

}  // namespace hexcal
