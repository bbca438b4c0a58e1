// Speed of identification and planning, and what remains of a virtual machine's errors against noise and
// poses.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <random>

#include "calibration/compensation.h"
#include "calibration/plan_poses.h"
#include "calibration/statistics.h"
#include "tools/synthetic/machine.h"

namespace hexcal {
namespace {

struct Noise {
  double position_mm;
  double angle_deg;
};

ObservationSet observe(const VirtualMachine& machine, int count, const Noise& noise, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal;
  const double sigma_rad = noise.angle_deg * kRadPerDeg;
  ObservationSet set;
  for (const TargetPose& target : random_targets(machine, seed, count, 30, 12 * kRadPerDeg)) {
    PoseObservation pose;
    pose.id = target.id;
    pose.target = target.pose;
    pose.readings = commanded_readings(machine.nominal, target.pose);
    pose.measured = *true_pose(machine, pose.readings, machine.home_readings);
    for (Eigen::Index k = 0; k < 3; ++k) {
      pose.measured.position_mm[k] += noise.position_mm * normal(rng);
      pose.measured.rpy_rad[k] += sigma_rad * normal(rng);
    }
    Vector6d variance;
    variance << Eigen::Vector3d::Constant(noise.position_mm * noise.position_mm),
        Eigen::Vector3d::Constant(sigma_rad * sigma_rad);
    pose.covariance = variance.asDiagonal();
    set.poses.push_back(pose);
  }
  return set;
}

// At 200 other targets, with the readings that the identified machine asks for.
ErrorStatistics remaining(const VirtualMachine& machine, const IdentifyResult& identified) {
  std::vector<PosePair> pairs;
  for (const TargetPose& target : random_targets(machine, 4711, 200, 30, 12 * kRadPerDeg)) {
    const auto reached =
        true_pose(machine, machine_readings(identified.machine, target.pose), machine.home_readings);
    if (reached) pairs.push_back({target.pose, *reached});
  }
  return error_statistics(pairs);
}

template <typename Work>
double milliseconds(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

void print_accuracy() {
  fmt::print("{:>8} {:>8} {:>6} {:>10} {:>10} {:>12} {:>12}\n", "noise_mm", "noise_deg", "poses", "rms_mm",
             "rms_deg", "position_%", "orientation_%");
  constexpr int kMachines = 6;
  for (const Noise& noise : {Noise{0.004, 0.002}, Noise{0.05, 0.01}, Noise{0.2, 0.05}, Noise{0.425, 0.1}}) {
    for (const int count : {12, 34, 100}) {
      double before_mm2 = 0, before_rad2 = 0, after_mm2 = 0, after_rad2 = 0;
      for (std::uint64_t seed = 1; seed <= kMachines; ++seed) {
        const VirtualMachine machine = make_machine(seed, {});
        IdentifyResult nominal;
        nominal.machine.geometry = machine.nominal;
        const ErrorStatistics before = remaining(machine, nominal);
        const ErrorStatistics after =
            remaining(machine, identify(machine.nominal, observe(machine, count, noise, seed)));
        before_mm2 += std::pow(before.position_rms_mm, 2) / kMachines;
        before_rad2 += std::pow(before.orientation_rms_rad, 2) / kMachines;
        after_mm2 += std::pow(after.position_rms_mm, 2) / kMachines;
        after_rad2 += std::pow(after.orientation_rms_rad, 2) / kMachines;
      }
      fmt::print("{:8.3f} {:8.3f} {:6} {:10.4f} {:10.4f} {:12.3f} {:12.3f}\n", noise.position_mm,
                 noise.angle_deg, count, std::sqrt(after_mm2), std::sqrt(after_rad2) * kDegPerRad,
                 improvement_percent(std::sqrt(before_mm2), std::sqrt(after_mm2)),
                 improvement_percent(std::sqrt(before_rad2), std::sqrt(after_rad2)));
    }
  }
}

void print_speed() {
  const VirtualMachine machine = make_machine(1, {});
  for (const int count : {12, 34, 10000}) {
    const ObservationSet set = observe(machine, count, {0.05, 0.02}, 3);
    double best = 1e9;
    for (int i = 0; i < (count < 1000 ? 10 : 2); ++i)
      best = std::min(best, milliseconds([&] { (void)identify(machine.nominal, set); }));
    fmt::print("identify 48 numbers from {} poses: {:.1f} ms\n", count, best);
  }
  const std::vector<Pose> candidates = planning_candidates(machine.nominal, 2000, 1);
  for (const std::size_t count : {std::size_t{12}, std::size_t{34}}) {
    PlanOptions options;
    options.count = count;
    fmt::print("plan {} of {} poses: {:.0f} ms\n", count, candidates.size(),
               milliseconds([&] { (void)plan_poses(machine.nominal, candidates, {}, options); }));
  }
}

}  // namespace
}  // namespace hexcal

int main() {
  hexcal::print_speed();
  hexcal::print_accuracy();
}
