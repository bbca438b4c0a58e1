#include "tools/io/covariance_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "tools/io/csv_table.h"

namespace hexcal {
namespace {

void append_block(std::string& out, const CampaignResult& result, std::size_t a, std::size_t b) {
  out += csv_field(result.poses[a].id) + ',' + csv_field(result.poses[b].id);
  const Matrix6d covariance = result.pose_covariance(a, b);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) out += fmt::format(",{:.9g}", covariance(i, j));
  }
  out += '\n';
}

}  // namespace

std::string format_pose_covariances(const std::string& head, const CampaignResult& result) {
  std::string out = head + "pose_a,pose_b";
  for (int i = 1; i <= 6; ++i) {
    for (int j = 1; j <= 6; ++j) out += fmt::format(",c{}{}", i, j);
  }
  out += '\n';
  const bool correlated = result.poses.size() <= kMaxCorrelatedPoses;
  for (std::size_t a = 0; a < result.poses.size(); ++a) {
    if (!result.poses[a].pose) continue;
    for (std::size_t b = a; b < (correlated ? result.poses.size() : a + 1); ++b) {
      if (result.poses[b].pose) append_block(out, result, a, b);
    }
  }
  return out;
}

std::vector<PoseCovariance> read_pose_covariances(const std::filesystem::path& path) {
  const CsvTable table = CsvTable::read(path);
  std::vector<std::string> required{"pose_a", "pose_b"};
  std::vector<std::string> names;
  for (int i = 1; i <= 6; ++i) {
    for (int j = 1; j <= 6; ++j) names.push_back(fmt::format("c{}{}", i, j));
  }
  required.insert(required.end(), names.begin(), names.end());
  table.require_columns(required);
  std::set<std::pair<std::string, std::string>> seen;
  std::vector<PoseCovariance> blocks;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    PoseCovariance block{table.text(row, "pose_a"), table.text(row, "pose_b"), {}};
    for (std::size_t i = 0; i < 36; ++i)
      block.covariance(static_cast<Eigen::Index>(i / 6), static_cast<Eigen::Index>(i % 6)) =
          table.number(row, names[i]);
    if (!seen.emplace(std::minmax(block.a, block.b)).second)
      table.fail(row, "pose_a", fmt::format("poses '{}' and '{}' stand together twice", block.a, block.b));
    blocks.push_back(std::move(block));
  }
  return blocks;
}

}  // namespace hexcal
