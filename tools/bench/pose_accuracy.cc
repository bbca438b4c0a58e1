// Errors of measured poses against the truth of `hexcal simulate`, and whether the stated covariances are
// honest: run `hexcal measure` on the folders first.
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <map>

#include "kinematics/geometry/input_error.h"
#include "tools/io/csv_table.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

std::map<std::string, Matrix6d> read_covariances(const fs::path& path) {
  const CsvTable table = CsvTable::read(path);
  std::map<std::string, Matrix6d> covariances;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const std::string id = table.text(row, "pose_a");
    if (table.text(row, "pose_b") != id) continue;
    Matrix6d& c = covariances[id];
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) c(i, j) = table.number(row, fmt::format("c{}{}", i + 1, j + 1));
    }
  }
  return covariances;
}

void run_campaign(const fs::path& campaign) {
  std::map<std::string, Pose> truth;
  for (const PoseRecord& record : read_pose_table(campaign / "truth" / "poses.csv")) {
    if (record.pose) truth[record.id] = *record.pose;
  }
  const auto covariances = read_covariances(campaign / "results" / "poses_covariance.csv");
  int poses = 0;
  int without = 0;
  double mm2 = 0;
  double rad2 = 0;
  double max_mm = 0;
  double max_rad = 0;
  double normalised = 0;
  Vector6d by_axis = Vector6d::Zero();
  for (const PoseRecord& record : read_pose_table(campaign / "results" / "poses.csv")) {
    if (!record.pose) {
      ++without;
      continue;
    }
    const Vector6d error = pose_error(*record.pose, truth.at(record.id));
    const Matrix6d& covariance = covariances.at(record.id);
    if (covariance.diagonal().minCoeff() <= 0) continue;  // home is zero by definition
    ++poses;
    mm2 += error.head<3>().squaredNorm();
    rad2 += error.tail<3>().squaredNorm();
    max_mm = std::max(max_mm, error.head<3>().norm());
    max_rad = std::max(max_rad, error.tail<3>().norm());
    normalised += error.dot(covariance.ldlt().solve(error)) / 6;
    by_axis += error.cwiseAbs2().cwiseQuotient(covariance.diagonal());
  }
  const double n = std::max(poses, 1);
  by_axis /= n;
  fmt::print(
      "{:<16} {:>5} {:>7} {:>7.2f} {:>7.2f} {:>8.5f} {:>8.5f} {:>9.2f}  {:.2f} {:.2f} {:.2f} {:.2f} {:.2f} "
      "{:.2f}\n",
      campaign.filename().string(), poses, without, 1e3 * std::sqrt(mm2 / n), 1e3 * max_mm,
      kDegPerRad * std::sqrt(rad2 / n), kDegPerRad * max_rad, normalised / n, by_axis[0], by_axis[1],
      by_axis[2], by_axis[3], by_axis[4], by_axis[5]);
}

}  // namespace
}  // namespace hexcal

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: pose_accuracy CAMPAIGN...\n");
    return 2;
  }
  try {
    fmt::print("{:<16} {:>5} {:>7} {:>7} {:>7} {:>8} {:>8} {:>9}  {}\n", "scene", "poses", "without",
               "rms_um", "max_um", "rms_deg", "max_deg", "norm_var", "x y z roll pitch yaw");
    for (int i = 1; i < argc; ++i) hexcal::run_campaign(argv[i]);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "pose_accuracy: {}\n", error.what());
    return 2;
  }
}
