// Times of the measuring stages on one photograph, beside cv::imread of the same file, and of the adjustment
// on synthetic observations: measure_bench PHOTOGRAPH [CAMERA.YAML] [benchmark flags].
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <cstring>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>

#include "photogrammetry/adjustment/adjustment.h"
#include "photogrammetry/markers/detect.h"
#include "photogrammetry/markers/quad_finder.h"
#include "tests/support/observation_scene.h"
#include "tools/io/camera_file.h"

namespace hexcal {
namespace {

std::filesystem::path file;
std::optional<CalibratedCamera> camera;

const Photograph& photograph() {
  static const Photograph read = read_photograph(file);
  return read;
}

std::vector<MarkerObservation> find_markers() {
  return detect_markers(photograph().grey, photograph().tone, marker_family("tag36h11"), {},
                        camera ? &camera->model : nullptr);
}

void imread_colour(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(cv::imread(file.string(), cv::IMREAD_COLOR));
}

void decode(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(read_photograph(file));
}

// Quadrilaterals only.
void detect(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(find_quads(photograph().grey, RefineOptions{}.min_side_px));
}

void detect_and_refine(benchmark::State& state) {
  std::size_t markers = 0;
  for (auto _ : state) markers = find_markers().size();
  state.counters["markers"] = static_cast<double>(markers);
}

void refine(benchmark::State& state) {
  const auto markers = find_markers();
  const MarkerFamily& family = marker_family("tag36h11");
  std::size_t at = 0;
  for (auto _ : state) {
    const MarkerObservation& marker = markers.at(at);
    const MarkerGuess guess{&family.patterns[static_cast<std::size_t>(marker.id)], marker.corners_px};
    benchmark::DoNotOptimize(refine_markers(photograph().grey, ToneResponse(photograph().tone), {guess}, {},
                                            camera ? &camera->model : nullptr));
    at = (at + 1) % markers.size();
  }
}

// Three photographs per pose, ten markers on each grip; with the covariance of every pose.
void adjust(benchmark::State& state) {
  ObservationSceneOptions options;
  options.num_epochs = static_cast<int>(state.range(0));
  options.noise_px = 0.01;
  options.interior_sigma = 1;
  const ObservationScene scene = make_observation_scene(options);
  for (auto _ : state) {
    const AdjustmentResult result = adjust_network(scene.network, {});
    if (result.status != AdjustmentStatus::ok) state.SkipWithError(result.reason.c_str());
    Matrix6d sum = Matrix6d::Zero();
    for (int epoch = 0; epoch < options.num_epochs; ++epoch) sum += result.pose_covariance(epoch, epoch);
    benchmark::DoNotOptimize(sum);
  }
  state.counters["photographs"] = static_cast<double>(scene.network.photos.size());
}

}  // namespace
}  // namespace hexcal

int main(int argc, char** argv) {
  using namespace hexcal;
  benchmark::Initialize(&argc, argv);
  if (argc > 3) {
    fmt::print(stderr, "usage: measure_bench [PHOTOGRAPH [CAMERA.YAML]] [--benchmark_...]\n");
    return 2;
  }
  // Everything on one thread, as imread is.
  cv::setNumThreads(1);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  if (argc > 1) {
    file = argv[1];
    if (argc > 2) camera = read_camera_file(argv[2]);
    if (photograph().status != PhotographStatus::ok || find_markers().empty()) {
      fmt::print(stderr, "measure_bench: {}: no photograph with markers\n", file.string());
      return 2;
    }
    benchmark::RegisterBenchmark("imread_colour", imread_colour)->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark("decode", decode)->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark("detect", detect)->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark("refine", refine)->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark("detect_and_refine", detect_and_refine)->Unit(benchmark::kMillisecond);
  }
  benchmark::RegisterBenchmark("adjust", adjust)
      ->Arg(12)
      ->Arg(35)
      ->Arg(100)
      ->Arg(1000)
      ->Unit(benchmark::kMillisecond)
      ->Iterations(1);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
