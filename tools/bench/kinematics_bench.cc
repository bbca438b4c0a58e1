// Kinematics: times of one pose, beside the same solve by ceres::Solver, by Newton's method with numeric
// derivatives and by the paper's procedure; and, first, the accuracy over random poses of whole workspaces
// (--poses N, default 100000 per machine; 0 skips it).

#include <benchmark/benchmark.h>
#include <ceres/ceres.h>
#include <fmt/format.h>

#include <Eigen/LU>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "kinematics/assembly_modes.h"
#include "kinematics/certificate.h"
#include "kinematics/forward.h"
#include "kinematics/geometry/covariance.h"
#include "kinematics/newton.h"
#include "kinematics/sampling.h"
#include "tests/support/hexapods.h"

namespace hexcal {
namespace {

struct Problem {
  Rigid3 truth;
  Rigid3 start;  ///< 5 mm and 2 deg away
  LegVector lengths_mm;
};

const PlatformGeometry& machine() {
  static const PlatformGeometry geometry = nategh_agheli_hexapod();
  return geometry;
}

const std::vector<Problem>& problems() {
  static const std::vector<Problem> all = [] {
    SampleOptions options;
    options.kind = SampleKind::uniform;
    options.count = 256;
    options.box = default_certificate_box();
    std::vector<Problem> list;
    double turn = 0;
    for (const Pose& pose : sample_poses(machine(), options).poses) {
      turn += 1;
      const Eigen::Vector3d way(std::sin(turn), std::cos(turn) * std::sin(2 * turn),
                                std::cos(turn) * std::cos(2 * turn));
      const Eigen::Vector3d axis(std::cos(3 * turn), std::sin(3 * turn) * std::sin(turn),
                                 std::sin(3 * turn) * std::cos(turn));
      Vector6d away;
      away << 5 * way, 2 * kRadPerDeg * axis;
      const Rigid3 truth = machine().B_from_P(pose);
      list.push_back({truth, perturbed(truth, away), leg_lengths(machine(), truth)});
    }
    return list;
  }();
  return all;
}

// Runs `solve` over the problems in turn and reports the worst error of its answers and the share of them
// that are another pose.
template <class Solve>
void run(benchmark::State& state, const Solve& solve) {
  const std::vector<Problem>& all = problems();
  double worst_mm = 0;
  int wrong = 0;
  for (const Problem& problem : all) {
    const double mm = (solve(problem).translation - problem.truth.translation).norm();
    worst_mm = std::max(worst_mm, mm);
    wrong += mm > 0.1 ? 1 : 0;
  }
  std::size_t n = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(solve(all[n]));
    n = n + 1 == all.size() ? 0 : n + 1;
  }
  state.counters["worst_mm"] = worst_mm;
  state.counters["wrong"] = static_cast<double>(wrong) / static_cast<double>(all.size());
}

void inverse(benchmark::State& state) {
  const LegArray legs(machine());
  const std::vector<Problem>& all = problems();
  std::size_t n = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(leg_lengths(legs, all[n].truth));
    n = n + 1 == all.size() ? 0 : n + 1;
  }
}
BENCHMARK(inverse);

void forward_from_neighbour(benchmark::State& state) {
  const LegArray legs(machine());
  run(state, [&](const Problem& p) { return newton(legs, p.lengths_mm, p.start).B_from_P; });
}
BENCHMARK(forward_from_neighbour);

void forward_with_statuses(benchmark::State& state) {
  run(state, [](const Problem& p) { return *forward_kinematics(machine(), p.lengths_mm, p.start).B_from_P; });
}
BENCHMARK(forward_with_statuses);

void forward_from_home(benchmark::State& state) {
  run(state, [](const Problem& p) { return *forward_kinematics(machine(), p.lengths_mm).B_from_P; });
}
BENCHMARK(forward_from_home);

// What one would write in an afternoon: translation and roll, pitch, yaw, central differences, Eigen's LU.
void eigen_newton_numeric(benchmark::State& state) {
  run(state, [](const Problem& p) {
    const auto pose_of = [](const Vector6d& x) {
      return Rigid3(quaternion_from_rpy(x.tail<3>()), x.head<3>());
    };
    Vector6d x;
    x << p.start.translation, rpy_from_quaternion(p.start.rotation);
    for (int i = 0; i < 20; ++i) {
      const LegVector residual = p.lengths_mm - leg_lengths(machine(), pose_of(x));
      Matrix6d j;
      for (Eigen::Index k = 0; k < 6; ++k) {
        const double h = k < 3 ? 1e-4 : 1e-6;
        Vector6d up = x;
        Vector6d down = x;
        up[k] += h;
        down[k] -= h;
        j.col(k) = (leg_lengths(machine(), pose_of(up)) - leg_lengths(machine(), pose_of(down))) / (2 * h);
      }
      const Vector6d step = j.partialPivLu().solve(residual);
      x += step;
      if (step.norm() < 1e-12) break;
    }
    return pose_of(x);
  });
}
BENCHMARK(eigen_newton_numeric);

// The same solve as one writes it with Ceres: a residual block per leg, automatic derivatives, DENSE_QR, the
// problem built for each pose, and tolerances at which it stops one step after rounding is reached.
struct LegCost {
  Eigen::Vector3d a, b;
  double length;
  template <class T>
  bool operator()(const T* q, const T* t, T* residual) const {
    const Eigen::Quaternion<T> rotation = Eigen::Map<const Eigen::Quaternion<T>>(q);
    const Eigen::Matrix<T, 3, 1> d =
        rotation * b.cast<T>() + Eigen::Map<const Eigen::Matrix<T, 3, 1>>(t) - a.cast<T>();
    residual[0] = d.norm() - T(length);
    return true;
  }
};

// All legs in one block.
struct SixLegsCost {
  const LegVector& length;
  template <class T>
  bool operator()(const T* q, const T* t, T* residual) const {
    const Eigen::Matrix<T, 3, 3> r = Eigen::Map<const Eigen::Quaternion<T>>(q).toRotationMatrix();
    for (std::size_t i = 0; i < 6; ++i) {
      const Eigen::Matrix<T, 3, 1> d = r * machine().platform_joints_mm[i].cast<T>() +
                                       Eigen::Map<const Eigen::Matrix<T, 3, 1>>(t) -
                                       machine().base_joints_mm[i].cast<T>();
      residual[i] = d.norm() - T(length[static_cast<Eigen::Index>(i)]);
    }
    return true;
  }
};

void minimise(ceres::Problem& problem, ceres::LinearSolverType linear_solver, Rigid3& x) {
  problem.SetManifold(x.rotation.coeffs().data(), new ceres::EigenQuaternionManifold);
  ceres::Solver::Options options;
  options.linear_solver_type = linear_solver;
  options.function_tolerance = 1e-30;
  options.gradient_tolerance = 1e-20;
  options.parameter_tolerance = 1e-15;
  options.initial_trust_region_radius = 1e16;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
}

void ceres_solver(benchmark::State& state) {
  run(state, [](const Problem& p) {
    Rigid3 x = p.start;
    ceres::Problem problem;
    for (std::size_t i = 0; i < 6; ++i) {
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<LegCost, 1, 4, 3>(
                                   new LegCost{machine().base_joints_mm[i], machine().platform_joints_mm[i],
                                               p.lengths_mm[static_cast<Eigen::Index>(i)]}),
                               nullptr, x.rotation.coeffs().data(), x.translation.data());
    }
    minimise(problem, ceres::DENSE_QR, x);
    return x;
  });
}
BENCHMARK(ceres_solver);

// The leanest form found: one block, and the normal equations, which square the condition.
void ceres_one_block_cholesky(benchmark::State& state) {
  run(state, [](const Problem& p) {
    Rigid3 x = p.start;
    ceres::Problem problem;
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<SixLegsCost, 6, 4, 3>(new SixLegsCost{p.lengths_mm}), nullptr,
        x.rotation.coeffs().data(), x.translation.data());
    minimise(problem, ceres::DENSE_NORMAL_CHOLESKY, x);
    return x;
  });
}
BENCHMARK(ceres_one_block_cholesky);

// The paper's procedure as described (Karmakar & Turner 2023): a database of poses of the workspace with
// their legs by inverse kinematics; the nearest entry; then a search around it on a grid that shrinks until
// the legs agree.
void paper_procedure(benchmark::State& state) {
  struct Entry {
    Vector6d pose;
    LegVector lengths_mm;
  };
  static const std::vector<Entry> database = [] {
    std::vector<Entry> entries;
    const auto level = [](int n) { return -1 + n / 2.0; };
    for (int n = 0; n < 15625; ++n) {  // five levels of each of six parameters
      Vector6d pose;
      int rest = n;
      for (Eigen::Index k = 0; k < 6; ++k, rest /= 5)
        pose[k] = level(rest % 5) * (k < 3 ? 150 : 20 * kRadPerDeg);
      entries.push_back({pose, leg_lengths(machine(), machine().B_from_P(Pose::from_vector(pose)))});
    }
    return entries;
  }();
  run(state, [](const Problem& p) {
    const auto off = [&p](const Vector6d& pose) {
      return (leg_lengths(machine(), machine().B_from_P(Pose::from_vector(pose))) - p.lengths_mm)
          .squaredNorm();
    };
    const Entry* nearest = &database[0];
    for (const Entry& entry : database) {
      if ((entry.lengths_mm - p.lengths_mm).squaredNorm() <
          (nearest->lengths_mm - p.lengths_mm).squaredNorm())
        nearest = &entry;
    }
    Vector6d pose = nearest->pose;
    double best = off(pose);
    Vector6d step;
    step << 37.5, 37.5, 37.5, Eigen::Vector3d::Constant(5 * kRadPerDeg);
    for (int round = 0; round < 4000 && best > 1e-12; ++round) {
      bool better = false;
      for (Eigen::Index k = 0; k < 6; ++k) {
        for (const double way : {-1.0, 1.0}) {
          Vector6d next = pose;
          next[k] += way * step[k];
          const double value = off(next);
          if (value < best) {
            best = value;
            pose = next;
            better = true;
          }
        }
      }
      if (!better) step *= 0.5;
    }
    return machine().B_from_P(Pose::from_vector(pose));
  });
}
BENCHMARK(paper_procedure)->Unit(benchmark::kMillisecond);

void certificate(benchmark::State& state) {
  const std::vector<Problem>& all = problems();
  std::size_t n = 0;
  std::size_t proven = 0;
  std::size_t tried = 0;
  double longest_ms = 0;
  for (auto _ : state) {
    const std::clock_t start = std::clock();
    const Pose pose = machine().pose_from_B_from_P(all[n].truth);
    const Certificate c = certify(machine(), all[n].lengths_mm, pose, default_certificate_box());
    proven += c.status == CertificateStatus::unique ? 1 : 0;
    longest_ms = std::max(longest_ms, 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    ++tried;
    n = n + 1 == all.size() ? 0 : n + 1;
  }
  state.counters["longest_ms"] = longest_ms;  // of the processor
  state.counters["proven"] = static_cast<double>(proven) / static_cast<double>(tried);
}
BENCHMARK(certificate)->Unit(benchmark::kMillisecond)->Iterations(100);

void all_assembly_modes(benchmark::State& state) {
  (void)assembly_modes(machine(), problems()[0].lengths_mm);  // finds the generic platform once
  for (auto _ : state) benchmark::DoNotOptimize(assembly_modes(machine(), problems()[0].lengths_mm));
}
BENCHMARK(all_assembly_modes)->Unit(benchmark::kMillisecond);

// Legs -> pose from home, without a guess, over the whole workspace.
int accuracy_table(std::size_t count) {
  int wrong_in_all = 0;
  const std::array<const char*, 3> names{"surrogate", "Nategh-Agheli", "Jugglebot"};
  const std::array<PlatformGeometry, 3> machines{surrogate_hexapod(), nategh_agheli_hexapod(),
                                                 jugglebot_hexapod()};
  fmt::print("{:<14} {:>8} {:>9} {:>9} {:>6} {:>12} {:>12}\n", "machine", "poses", "returned", "singular",
             "wrong", "worst_mm", "worst_rad");
  for (std::size_t m = 0; m < machines.size(); ++m) {
    const PlatformGeometry& g = machines[m];
    SampleOptions options;
    options.kind = SampleKind::uniform;
    options.count = count;
    int returned = 0;
    int singular = 0;
    int wrong = 0;
    double worst_mm = 0;
    double worst_rad = 0;
    const SampleResult sample = sample_poses(g, options);
    for (const Pose& pose : sample.poses) {
      const Rigid3 truth = g.B_from_P(pose);
      const ForwardResult r = forward_kinematics(g, leg_lengths(g, truth));
      if (r.status == ForwardStatus::singular) {
        ++singular;
        continue;
      }
      const double mm = r.B_from_P ? (r.B_from_P->translation - truth.translation).norm() : 1e300;
      const double rad = r.B_from_P ? rotation_distance(r.B_from_P->rotation, truth.rotation) : 1e300;
      worst_mm = std::max(worst_mm, mm);
      worst_rad = std::max(worst_rad, rad);
      ++(mm <= 1e-9 && rad <= 1e-11 ? returned : wrong);
    }
    wrong_in_all += wrong;
    fmt::print("{:<14} {:>8} {:>9} {:>9} {:>6} {:>12.2e} {:>12.2e}\n", names[m], sample.poses.size(),
               returned, singular, wrong, worst_mm, worst_rad);
  }
  return wrong_in_all;
}

}  // namespace
}  // namespace hexcal

int main(int argc, char** argv) {
  std::size_t poses = 100000;
  for (int i = 1; i + 1 < argc; ++i) {
    if (std::strcmp(argv[i], "--poses") != 0) continue;
    poses = static_cast<std::size_t>(std::atoll(argv[i + 1]));
    for (int k = i; k + 2 < argc; ++k) argv[k] = argv[k + 2];
    argc -= 2;
  }
  const int wrong = poses > 0 ? hexcal::accuracy_table(poses) : 0;
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return wrong == 0 ? 0 : 1;
}
