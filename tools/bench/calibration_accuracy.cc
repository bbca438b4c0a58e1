// Speed of identification and planning, the published benchmark, and what remains of a virtual machine's
// errors against noise and poses.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <random>
#include <string_view>

#include "calibration/compensation.h"
#include "calibration/identifiability.h"
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

// Nategh and Agheli's hexapod (github tabathaviso/hexapod-parallel-manipulator): nominal and "real" joints
// and leg offsets, the 42 numbers of the published benchmark.
struct Benchmark {
  PlatformGeometry nominal;
  MachineModel real;
};

Benchmark nategh_agheli() {
  using Six = std::array<double, 6>;
  const auto geometry = [](const Six& ux, const Six& uy, const Six& uz, const Six& sx, const Six& sy,
                           const Six& sz, const Six& offset_mm) {
    PlatformGeometry g;
    for (std::size_t i = 0; i < 6; ++i) {
      g.base_joints_mm[i] = {ux[i], uy[i], uz[i]};
      g.platform_joints_mm[i] = {sx[i], sy[i], sz[i]};
      g.actuators[i] = {offset_mm[i], 1, 604.8652, 1100};
    }
    g.B_from_UG = Rigid3::from_translation({0, 0, 800});
    return g;
  };
  Six offset_mm;
  offset_mm.fill(604.8652);
  return {geometry({305.4001, -56.4357, -248.9644, -248.9644, -56.4357, 305.4001},
                   {111.1565, 320.0625, 208.9060, -208.9060, -320.0625, -111.1565}, {},
                   {92.1597, 27.055, -119.2146, -119.2146, 27.055, 92.1597},
                   {84.4488, 122.037, 37.58822, -37.5882, -122.037, -84.4488}, {}, offset_mm),
          {.geometry = geometry({305.2599, -55.2814, -244.7954, -252.5755, -53.9678, 302.4266},
                                {115.0695, 322.9819, 208.0087, -211.8783, -320.6115, -109.4351},
                                {2.6210, 4.2181, 3.9365, -3.0128, 4.3181, 3.3812},
                                {96.6610, 22.2476, -122.4519, -120.6859, 24.7769, 91.3462},
                                {81.7602, 125.2511, 36.6453, -34.4565, -125.0489, -80.9866},
                                {1.0684, -0.5530, 4.3547, -4.9014, -4.8473, 0.2515},
                                {604.4299, 607.2473, 600.4441, 605.9031, 604.5251, 600.0616})}};
}

// Poses within x, y, z +-120 mm and +-angle.
std::vector<Pose> benchmark_poses(int count, double angle_deg, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Pose> poses;
  for (int i = 0; i < count; ++i) {
    Vector6d v;
    for (Eigen::Index k = 0; k < 6; ++k) v[k] = uniform(rng) * (k < 3 ? 120 : angle_deg * kRadPerDeg);
    poses.push_back(Pose::from_vector(v));
  }
  return poses;
}

ObservationSet observe_benchmark(const Benchmark& benchmark, const std::vector<Pose>& targets,
                                 const Noise& noise, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal;
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(noise.position_mm),
      Eigen::Vector3d::Constant(noise.angle_deg * kRadPerDeg);
  ObservationSet set;
  for (const Pose& target : targets) {
    PoseObservation pose;
    pose.target = target;
    pose.readings = commanded_readings(benchmark.nominal, target);
    Vector6d v = machine_pose(benchmark.real, pose.readings, target)->vector();
    for (Eigen::Index k = 0; k < 6; ++k) v[k] += sigma[k] * normal(rng);
    pose.measured = Pose::from_vector(v);
    pose.covariance = sigma.cwiseMax(1e-9).cwiseAbs2().asDiagonal();
    set.poses.push_back(pose);
  }
  return set;
}

ErrorStatistics benchmark_errors(const Benchmark& benchmark, const MachineModel& identified) {
  std::vector<PosePair> pairs;
  for (const Pose& target : benchmark_poses(400, 15, 7)) {
    const auto reached = machine_pose(benchmark.real, machine_readings(identified, target), target);
    if (reached) pairs.push_back({target, *reached});
  }
  return error_statistics(pairs);
}

void print_benchmark() {
  const Benchmark benchmark = nategh_agheli();
  IdentifyOptions options;
  options.scales = false;
  fmt::print("Nategh and Agheli's hexapod, 42 numbers; rms at 400 other poses, mean of 12 draws\n");
  fmt::print("{:>8} {:>8} {:>6} {:>10} {:>10} {:>22}\n", "noise_mm", "noise_deg", "poses", "rms_mm",
             "rms_deg", "published_whitened");
  const ErrorStatistics none = benchmark_errors(benchmark, {.geometry = benchmark.nominal});
  fmt::print("{:>24} {:10.3f} {:10.4f} {:>22}\n", "nominal", none.position_rms_mm,
             none.orientation_rms_rad * kDegPerRad, "43.98 mm 5.54 deg");
  struct Row {
    Noise noise;
    int poses;
    const char* published;
  };
  constexpr int kDraws = 12;
  for (const Row& row :
       {Row{{0.05, 0.01}, 34, "0.050 mm 0.0098 deg"}, Row{{0.2, 0.05}, 12, "0.695 mm 0.142 deg"},
        Row{{0.2, 0.05}, 34, "0.196 mm 0.051 deg"}, Row{{0.425, 0.1}, 34, "0.427 mm 0.095 deg"}}) {
    double mm = 0;
    double deg = 0;
    for (std::uint64_t draw = 0; draw < kDraws; ++draw) {
      const IdentifyResult identified = identify(
          benchmark.nominal,
          observe_benchmark(benchmark, benchmark_poses(row.poses, 15, 100 + draw), row.noise, draw), options);
      const ErrorStatistics errors = benchmark_errors(benchmark, identified.machine);
      mm += errors.position_rms_mm / kDraws;
      deg += errors.orientation_rms_rad * kDegPerRad / kDraws;
    }
    fmt::print("{:8.3f} {:8.3f} {:6} {:10.4f} {:10.4f} {:>22}\n", row.noise.position_mm, row.noise.angle_deg,
               row.poses, mm, deg, row.published);
  }
  // Without noise the frames are those of the measurement, so that the numbers compare as they are.
  options.leg_sigma_mm = 1e-7;
  const IdentifyResult exact = identify(
      benchmark.nominal, observe_benchmark(benchmark, benchmark_poses(34, 15, 5), {0, 0}, 1), options);
  double farthest_mm = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    const PlatformGeometry& a = exact.machine.geometry;
    const PlatformGeometry& b = benchmark.real.geometry;
    farthest_mm = std::max({farthest_mm, (a.base_joints_mm[i] - b.base_joints_mm[i]).cwiseAbs().maxCoeff(),
                            (a.platform_joints_mm[i] - b.platform_joints_mm[i]).cwiseAbs().maxCoeff(),
                            std::abs(a.actuators[i].offset_mm - b.actuators[i].offset_mm)});
  }
  fmt::print("noise-free, 34 poses: the farthest of the 42 numbers is off by {:.1e} mm\n", farthest_mm);
  options.leg_sigma_mm = IdentifyOptions{}.leg_sigma_mm;
  for (const double angle_deg : {15.0, 0.0}) {
    // Rank is a matter of where the machine stands: it is told to have reached its targets.
    Benchmark perfect = benchmark;
    perfect.real = {.geometry = benchmark.nominal};
    ObservationSet set = observe_benchmark(perfect, benchmark_poses(40, angle_deg, 5), {0, 0}, 1);
    for (PoseObservation& pose : set.poses) pose.covariance = 1e-4 * Matrix6d::Identity();
    const IdentifyResult identified = identify(benchmark.nominal, set, options);
    const Identifiability judged = judge_identifiability(benchmark.nominal, identified);
    fmt::print("rank of 40 poses tilted by up to {:.0f} deg: {} of {}{}{}\n", angle_deg, judged.rank,
               judged.free_parameters, judged.advice.empty() ? "" : "; ", judged.advice);
  }
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

// What a leg does beyond geometry, of the size at which it is tested.
struct Fault {
  const char* name;
  double curve_mm = 0;  ///< of its own and per leg, P_2 and P_3 of the stroke
  double play_mm = 0;   ///< random, of each leg at each pose
  MachineErrors errors = {};
};

std::vector<Fault> faults() {
  const auto with = [](auto change) {
    MachineErrors errors;
    errors.draws = 1;
    change(errors);
    return errors;
  };
  const MachineErrors none = with([](MachineErrors&) {});
  return {{"none", 0, 0, none},
          {"curve 1 %", 2, 0, none},
          {"backlash 0.05", 0, 0, with([](MachineErrors& e) { e.backlash_mm = 0.05; })},
          {"sag 0.3", 0, 0, with([](MachineErrors& e) { e.leg_compliance_mm_per_n = 0.3 / 50; })},
          {"play 0.05", 0, 0.05, none},
          {"wave 0.05", 0, 0, with([](MachineErrors& e) { e.stroke_wave_mm = 0.05; })}};
}

// One machine with a fault of its own, as the controller moves it.
class FaultyMachine {
 public:
  FaultyMachine(const Fault& fault, std::uint64_t seed)
      : machine_(make_machine(seed, fault.errors)), fault_(fault), rng_(1000 + seed) {
    for (double& share : shares_) share = normal_(rng_);
  }

  std::optional<Pose> reach(const LegVector& readings) {
    LegVector moved = readings;
    for (std::size_t k = 0; k < 6; ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      const double s = (readings[i] - 480) / 100;
      moved[i] += fault_.curve_mm * (shares_[2 * k] * (1.5 * s * s - 0.5) / 2 +
                                     shares_[2 * k + 1] * (2.5 * s * s * s - 1.5 * s) / 3);
      moved[i] += fault_.play_mm * normal_(rng_);
    }
    return true_pose(machine_, moved, machine_.home_readings);
  }
  const VirtualMachine& machine() const { return machine_; }
  std::mt19937_64& rng() { return rng_; }

 private:
  VirtualMachine machine_;
  Fault fault_;
  std::mt19937_64 rng_;
  std::normal_distribution<double> normal_;
  std::array<double, 12> shares_{};
};

// Predicted sigmas of corrected commands against what the machine does there: mean square of the normalised
// errors and share within 1.96 sigma, over 30 machines and the method that `identify` is by default.
void print_honesty() {
  fmt::print("{:>14} {:>8} {:>6} {:>7} {:>10} {:>10} {:>6} {:>9}\n", "fault", "noise_mm", "poses", "sigmas",
             "rms_mm", "stated_mm", "z2", "within_%");
  for (const Fault& fault : faults()) {
    for (const Noise& noise : {Noise{0.005, 0.002}, Noise{0.05, 0.01}, Noise{0.425, 0.1}}) {
      for (const int count : {12, 24, 34}) {
        for (const bool known : {true, false}) {
          double z2 = 0, inside = 0, mm2 = 0, stated2 = 0, n = 0;
          for (std::uint64_t seed = 1; seed <= 30; ++seed) {
            FaultyMachine faulty(fault, seed);
            std::normal_distribution<double> normal;
            ObservationSet set = observe(faulty.machine(), count, noise, seed);
            set.covariance_known = known;
            std::vector<PoseObservation> reached;
            for (PoseObservation& pose : set.poses) {
              const auto actual = faulty.reach(pose.readings);
              if (!actual) continue;
              Vector6d v = actual->vector();
              for (Eigen::Index k = 0; k < 6; ++k)
                v[k] += normal(faulty.rng()) * (k < 3 ? noise.position_mm : noise.angle_deg * kRadPerDeg);
              pose.measured = Pose::from_vector(v);
              if (!known) pose.covariance = Vector6d(0.1 * 0.1 * Vector6d::Ones()).asDiagonal();
              if (!known) pose.covariance.bottomRightCorner<3, 3>() *= kRadPerDeg * kRadPerDeg;
              reached.push_back(pose);
            }
            set.poses = reached;
            const IdentifyResult identified = identify(faulty.machine().nominal, set);
            if (identified.status != IdentifyStatus::identified) continue;
            for (const TargetPose& target : random_targets(faulty.machine(), 4711, 20, 30, 12 * kRadPerDeg)) {
              const auto actual = faulty.reach(machine_readings(identified.machine, target.pose));
              if (!actual) continue;
              const Vector6d error = pose_error(*actual, target.pose);
              const Vector6d sigma = predicted_sigma(identified, target.pose);
              for (Eigen::Index k = 0; k < 6; ++k) {
                z2 += std::pow(error[k] / sigma[k], 2);
                inside += std::abs(error[k]) < 1.96 * sigma[k] ? 1 : 0;
                n += 1;
              }
              mm2 += error.head<3>().squaredNorm();
              stated2 += sigma.head<3>().squaredNorm();
            }
          }
          fmt::print("{:>14} {:8.3f} {:6} {:>7} {:10.4f} {:10.4f} {:6.2f} {:9.1f}\n", fault.name,
                     noise.position_mm, count, known ? "given" : "none", std::sqrt(6 * mm2 / n),
                     std::sqrt(6 * stated2 / n), z2 / n, 100 * inside / n);
          std::fflush(stdout);
        }
      }
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

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "--honesty") {
    hexcal::print_honesty();
    return 0;
  }
  hexcal::print_speed();
  hexcal::print_benchmark();
  hexcal::print_accuracy();
  hexcal::print_honesty();
}
