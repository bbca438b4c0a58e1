// Time, memory and accuracy of the adjustment of very many poses, on synthetic observations:
// adjustment_scale POSES [MAP_POSES]; with MAP_POSES in two steps (marker_map.h).
#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstdlib>

#include "photogrammetry/adjustment/marker_map.h"
#include "tests/support/observation_scene.h"

namespace hexcal {
namespace {

double peak_mib() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

int run(int poses, int map_poses) {
  ObservationSceneOptions options;
  options.num_epochs = poses;
  options.noise_px = 0.01;
  options.interior_sigma = 1;
  const ObservationScene scene = make_observation_scene(options);
  const double before = peak_mib();
  const auto start = std::chrono::steady_clock::now();
  std::vector<int> map;
  for (int i = 0; i < map_poses; ++i)
    map.push_back(static_cast<int>(static_cast<long>(i) * poses / map_poses));
  const AdjustmentResult result =
      map_poses > 0 ? adjust_network_by_map(scene.network, map, {}) : adjust_network(scene.network, {});
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  // Motions from home, which do not depend on the fixed body's frame in length.
  double squares = 0;
  double variances = 0;
  const auto motion = [](const std::vector<Rigid3>& at, std::size_t e) { return at[0] * inverse(at[e]); };
  for (std::size_t e = 1; e < scene.fixed_from_moving.size(); ++e) {
    const double found = motion(result.geometry.reference_from_body[kMovingBody], e)
                             .rotation.angularDistance(Eigen::Quaterniond::Identity());
    const double truth =
        motion(scene.fixed_from_moving, e).rotation.angularDistance(Eigen::Quaterniond::Identity());
    squares += std::pow((found - truth) * kDegPerRad * 1e3, 2);
    variances +=
        result.pose_covariance(static_cast<int>(e), static_cast<int>(e)).topLeftCorner<3, 3>().trace();
  }
  const double count = poses - 1;
  fmt::print(
      "{} poses, {}: {:.1f} s, {:.0f} MiB ({:.0f} before), angle from home rms error {:.3f} mdeg, "
      "3D sigma of a position {:.3f} um; {}\n",
      poses, map_poses > 0 ? fmt::format("map of {}", map_poses) : "at once", took.count(), peak_mib(),
      before, std::sqrt(squares / count), std::sqrt(variances / count) * 1e3,
      result.status == AdjustmentStatus::ok ? "ok" : result.reason);
  return result.status == AdjustmentStatus::ok ? 0 : 1;
}

}  // namespace
}  // namespace hexcal

int main(int argc, char** argv) {
  const int poses = argc > 1 ? std::atoi(argv[1]) : 0;
  const int map_poses = argc > 2 ? std::atoi(argv[2]) : 0;
  if (poses < 2 || map_poses < 0 || map_poses > poses || argc > 3) {
    fmt::print(stderr, "usage: adjustment_scale POSES [MAP_POSES]\n");
    return 2;
  }
  return hexcal::run(poses, map_poses);
}
