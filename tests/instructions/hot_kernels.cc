// Runs each hot kernel twice on fixed input: once to fill its tables, once by its name (hot_kernel_*), for
// callgrind to count. Prints the names in their order; exit code 1 when a kernel did not do its work.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "calibration/identify.h"
#include "kinematics/forward.h"
#include "photogrammetry/adjustment/adjustment.h"
#include "photogrammetry/markers/blurred_pattern.h"
#include "photogrammetry/markers/detect.h"
#include "photogrammetry/markers/quad_finder.h"
#include "tests/calibration/virtual_machine.h"
#include "tests/support/hexapods.h"
#include "tests/support/observation_scene.h"

namespace hexcal {
namespace {

constexpr double kSizeMm = 24;
constexpr double kBlurPx = 0.8;

// A small camera whose lens uses every term.
CameraModel full_lens() {
  CameraModel camera(640, 480, 900, LensModel::rational);
  camera.parameters.tail<12>() << 0.05, -0.08, 2e-4, -3e-4, 0.02, 0.01, -0.02, 0.01, 1e-4, -1e-4, 2e-4, -1e-4;
  return camera;
}

struct PlacedMarker {
  int id;
  Rigid3 camera_from_marker;
};

// Two rows of markers, each tilted another way.
std::vector<PlacedMarker> place_markers(const CameraModel& camera) {
  std::vector<PlacedMarker> markers;
  for (int i = 0; i < 4; ++i) {
    const double tilt = 0.2 * (i - 1.5);
    // Upright in the photograph and towards the camera, then turned.
    const Eigen::Quaterniond facing(0, 1, 0, 0);
    const Eigen::Vector2d px(170 + 280 * (i % 2), 130 + 220 * (i / 2));
    const Eigen::Vector2d n = camera.normalised_from_image(px).value();
    markers.push_back(
        {7 * i + 3, Rigid3(facing * quaternion_from_rotation_vector({tilt, 0.3 - tilt, 0.2 * i}),
                           250 * Eigen::Vector3d(n.x(), n.y(), 1))});
  }
  return markers;
}

// The photometric model itself draws the photograph: cheap, and here only the work counts, not the truth.
cv::Mat photograph(const CameraModel& camera, const std::vector<PlacedMarker>& markers) {
  const MarkerFamily& family = marker_family("tag36h11");
  const ToneResponse tone(ToneCurve::srgb);
  cv::Mat_<std::uint8_t> grey(camera.height_px, camera.width_px);
  std::mt19937 random(1);
  const auto encoded = [&](double white_share) {
    const double noise = static_cast<double>(random() % 5) + static_cast<double>(random() % 5) - 4;
    return cv::saturate_cast<std::uint8_t>(255 * tone.encode(0.05 + 0.6 * white_share).value + noise);
  };
  for (std::uint8_t& pixel : grey) pixel = encoded(1);
  for (const PlacedMarker& marker : markers) {
    const MarkerPattern& shape = family.patterns[static_cast<std::size_t>(marker.id)];
    const BlurredPattern pattern(shape);
    const double cells_per_mm = shape.square_cells / kSizeMm;
    const Rigid3 marker_from_camera = inverse(marker.camera_from_marker);
    const auto cell_of = [&](const Eigen::Vector2d& px) -> Eigen::Vector2d {
      const Eigen::Vector2d n = camera.normalised_from_image(px).value();
      const Eigen::Vector3d ray = marker_from_camera.rotation * Eigen::Vector3d(n.x(), n.y(), 1);
      const Eigen::Vector3d at =
          marker_from_camera.translation - marker_from_camera.translation.z() / ray.z() * ray;
      return Eigen::Vector2d(at.x(), -at.y()) * cells_per_mm + Eigen::Vector2d::Constant(0.5 * shape.cells);
    };
    const Eigen::Vector2d middle = camera.project(marker.camera_from_marker.translation).value();
    constexpr int kReachPx = 85;
    for (int y = static_cast<int>(middle.y()) - kReachPx; y <= static_cast<int>(middle.y()) + kReachPx; ++y) {
      for (int x = static_cast<int>(middle.x()) - kReachPx; x <= static_cast<int>(middle.x()) + kReachPx;
           ++x) {
        if (x < 0 || y < 0 || x >= grey.cols || y >= grey.rows) continue;
        const Eigen::Vector2d px(x, y);
        const Eigen::Vector2d cell = cell_of(px);
        Eigen::Matrix2d by_px;
        by_px << cell_of(px + Eigen::Vector2d(1, 0)) - cell, cell_of(px + Eigen::Vector2d(0, 1)) - cell;
        const Eigen::Matrix2d blur = kBlurPx * kBlurPx * by_px * by_px.transpose();
        grey(y, x) = encoded(pattern.sample(cell.x(), cell.y(), {blur(0, 0), blur(0, 1), blur(1, 1)}).value);
      }
    }
  }
  return grey;
}

struct Inputs {
  CameraModel camera = full_lens();
  cv::Mat grey;
  std::vector<MarkerGuess> guesses;
  std::vector<Eigen::Vector3d> points;
  PlatformGeometry nominal = surrogate_hexapod();
  std::vector<LegVector> lengths_mm;
  Network network;
  ObservationSet observations;
};

Inputs make_inputs() {
  Inputs in;
  const std::vector<PlacedMarker> markers = place_markers(in.camera);
  in.grey = photograph(in.camera, markers);
  for (const PlacedMarker& marker : markers) {
    MarkerGuess guess{&marker_family("tag36h11").patterns[static_cast<std::size_t>(marker.id)], {}};
    static constexpr double kSquare[4][2] = {{-1, 1}, {1, 1}, {1, -1}, {-1, -1}};
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector3d corner(0.5 * kSizeMm * kSquare[i][0], 0.5 * kSizeMm * kSquare[i][1], 0);
      // As far off as detection leaves it.
      guess.corners_px[i] = in.camera.project(marker.camera_from_marker * corner).value() +
                            Eigen::Vector2d(i % 2 == 0 ? 0.7 : -0.4, i < 2 ? -0.6 : 0.5);
    }
    in.guesses.push_back(guess);
  }
  for (int i = 0; i < 1000; ++i) in.points.emplace_back(8 * (i % 25 - 12), 6 * (i / 25 - 20), 700 + i % 7);

  const TargetBox box{};
  const std::vector<Pose> targets = random_poses(34, box, 3);
  for (const Pose& pose : targets)
    in.lengths_mm.push_back(leg_lengths(in.nominal, in.nominal.B_from_P(pose)));
  in.observations = measured(as_built(in.nominal, {}, 1), in.nominal, targets, {0.02, 0.01, 1});

  ObservationSceneOptions scene;
  scene.num_epochs = 3;
  scene.markers_per_body = 4;
  scene.noise_px = 0.02;
  scene.interior_sigma = 1;
  in.network = make_observation_scene(scene).network;
  return in;
}

}  // namespace

// Each says whether it did its work. Named as C functions, the way callgrind is told to find them.
extern "C" {

[[gnu::noinline]] bool hot_kernel_find_quads(const Inputs& in) {
  return find_quads(in.grey, RefineOptions{}.min_side_px).size() >= in.guesses.size();
}

[[gnu::noinline]] bool hot_kernel_detect_markers(const Inputs& in) {
  const auto markers = detect_markers(in.grey, ToneCurve::srgb, marker_family("tag36h11"), {}, &in.camera);
  bool good = markers.size() == in.guesses.size();
  for (const MarkerObservation& marker : markers) good = good && marker.status == MarkerStatus::ok;
  return good;
}

[[gnu::noinline]] bool hot_kernel_refine_markers(const Inputs& in) {
  const RefinedMarkers refined =
      refine_markers(in.grey, ToneResponse(ToneCurve::srgb), in.guesses, {}, &in.camera);
  bool good = true;
  for (const MarkerObservation& marker : refined.markers) good = good && marker.status == MarkerStatus::ok;
  return good;
}

[[gnu::noinline]] bool hot_kernel_refine_markers_without_camera(const Inputs& in) {
  const RefinedMarkers refined = refine_markers(in.grey, ToneResponse(ToneCurve::srgb), in.guesses);
  bool good = true;
  for (const MarkerObservation& marker : refined.markers) good = good && marker.status == MarkerStatus::ok;
  return good;
}

[[gnu::noinline]] bool hot_kernel_project_points(const Inputs& in) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& point : in.points) sum += in.camera.project(point).value();
  return sum.allFinite();
}

[[gnu::noinline]] bool hot_kernel_projection_jacobians(const Inputs& in) {
  double sum = 0;
  for (const Eigen::Vector3d& point : in.points) {
    Eigen::Matrix2d by_point;
    CameraModel::ByParameters by_parameters;
    sum += in.camera.image_from_normalised(point.hnormalized(), &by_point, &by_parameters).x();
    sum += by_point(0, 0) + by_parameters(0, 4);
  }
  return std::isfinite(sum);
}

[[gnu::noinline]] bool hot_kernel_invert_projection(const Inputs& in) {
  bool good = true;
  for (int i = 0; i < 1000; ++i)
    good = good && in.camera.normalised_from_image({16 * (i % 40), 19 * (i / 40)});
  return good;
}

[[gnu::noinline]] bool hot_kernel_forward_kinematics(const Inputs& in) {
  bool good = true;
  const Rigid3 home = in.nominal.home_B_from_P();
  for (const LegVector& lengths_mm : in.lengths_mm) {
    good = good && forward_kinematics(in.nominal, lengths_mm, home).status == ForwardStatus::converged;
  }
  return good;
}

[[gnu::noinline]] bool hot_kernel_feasible_forward_kinematics(const Inputs& in) {
  bool good = true;
  for (const LegVector& lengths_mm : in.lengths_mm) {
    good = good && forward_kinematics(in.nominal, lengths_mm).status == ForwardStatus::converged;
  }
  return good;
}

[[gnu::noinline]] bool hot_kernel_adjust_network(const Inputs& in) {
  return adjust_network(in.network, {}).status == AdjustmentStatus::ok;
}

[[gnu::noinline]] bool hot_kernel_identify(const Inputs& in) {
  return identify(in.nominal, in.observations).status == IdentifyStatus::identified;
}

}  // extern "C"
}  // namespace hexcal

int main() {
  using namespace hexcal;
  cv::setNumThreads(1);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  struct Kernel {
    const char* name;
    bool (*run)(const Inputs&);
  };
  const Kernel kernels[] = {
      {"find_quads", hot_kernel_find_quads},
      {"detect_markers", hot_kernel_detect_markers},
      {"refine_markers", hot_kernel_refine_markers},
      {"refine_markers_without_camera", hot_kernel_refine_markers_without_camera},
      {"project_points", hot_kernel_project_points},
      {"projection_jacobians", hot_kernel_projection_jacobians},
      {"invert_projection", hot_kernel_invert_projection},
      {"forward_kinematics", hot_kernel_forward_kinematics},
      {"feasible_forward_kinematics", hot_kernel_feasible_forward_kinematics},
      {"adjust_network", hot_kernel_adjust_network},
      {"identify", hot_kernel_identify},
  };
  const Inputs inputs = make_inputs();
  for (const Kernel& kernel : kernels) {
    for (int time = 0; time < 2; ++time) {
      if (!kernel.run(inputs)) {
        fmt::print(stderr, "hot_kernels: {} did not do its work\n", kernel.name);
        return 1;
      }
    }
    fmt::print("{}\n", kernel.name);
  }
  return 0;
}
