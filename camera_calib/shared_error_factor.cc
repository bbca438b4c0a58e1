#include "camera_calib/shared_error_factor.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <type_traits>
#include <utility>

#include "camera_calib/projection_difference.h"

namespace hexcal {
namespace {

constexpr int kLeastPhotographs = 5;  // fewer say nothing of their own spread
constexpr int kLeastKeys = 10;
constexpr int kCellsAcross = 12;
constexpr int kCellsDown = 8;

int cell_of(const Eigen::Vector2d& px, const CameraModel& camera) {
  const auto along = [](double at, int length, int cells) {
    return std::clamp(static_cast<int>((at + 0.5) * cells / length), 0, cells - 1);
  };
  return along(px.y(), camera.height_px, kCellsDown) * kCellsAcross +
         along(px.x(), camera.width_px, kCellsAcross);
}

double mean_variance(const CameraModel& camera, const Eigen::MatrixXd& covariance) {
  return projection_uncertainty(camera, covariance, 12, 8).mean_variance_px2();
}

// Rows of the system that share something, numbered 0, 1, ... in the order of first use.
struct RowGroups {
  std::vector<int> of_row;
  int count = 0;
};

// `key` tells of a feature and one of its points what its rows share with others.
template <typename KeyOf>
RowGroups row_groups(const std::vector<UsedFeature>& used, const KeyOf& key) {
  std::map<std::invoke_result_t<KeyOf, const UsedFeature&, int>, int> numbers;
  RowGroups groups;
  for (const UsedFeature& at : used) {
    for (int i = 0; i < at.feature->points(); ++i) {
      const int number = numbers.try_emplace(key(at, i), static_cast<int>(numbers.size())).first->second;
      groups.of_row.insert(groups.of_row.end(), 2, number);
    }
  }
  groups.count = static_cast<int>(numbers.size());
  return groups;
}

RowGroups photographs_of(const std::vector<UsedFeature>& used) {
  return row_groups(used, [](const UsedFeature& at, int) { return at.photograph; });
}

std::optional<LeftOut> leave_photographs_out(const ReducedSystem& system, const RowGroups& photographs) {
  if (photographs.count < 2 || system.covariance.size() == 0) return std::nullopt;
  std::vector<int> photograph_of_block;
  for (const ReducedBlock& block : system.blocks) {
    photograph_of_block.push_back(photographs.of_row[static_cast<std::size_t>(block.rows.front())]);
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
  const RowGroups photographs = photographs_of(used);
  const RowGroups places = row_groups(used, [&camera](const UsedFeature& at, int i) {
    return cell_of(at.feature->px.segment<2>(2 * i), camera);
  });
  const RowGroups points = row_groups(
      used, [](const UsedFeature& at, int) { return std::pair(at.sheet, at.feature->first_point); });
  SharedErrorFactors out;
  if (photographs.count >= kLeastPhotographs) {
    if (const auto left_out = leave_photographs_out(system, photographs)) {
      out.photographs = factor(jackknife_covariance(*left_out));
    }
  }
  if (places.count >= kLeastKeys)
    out.places = factor(clustered_covariance(system, places.of_row, places.count));
  if (points.count >= kLeastKeys)
    out.points = factor(clustered_covariance(system, points.of_row, points.count));
  return out;
}

std::vector<double> left_out_chi2(const ReducedSystem& system, const std::vector<UsedFeature>& used) {
  const auto left_out = leave_photographs_out(system, photographs_of(used));
  if (!left_out) return {};
  return {left_out->chi2.data(), left_out->chi2.data() + left_out->chi2.size()};
}

}  // namespace hexcal
