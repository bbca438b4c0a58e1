// Corner errors of several detectors on the same rendered photographs, beside the Cramer-Rao bound: folders
// written by `hexcal simulate`, whose truth/ holds the true corners. Then false ids in photographs without
// markers.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iterator>
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/median.h"
#include "photogrammetry/photograph/tone_response.h"
#include "tools/bench/accuracy_detectors.h"
#include "tools/bench/clutter.h"
#include "tools/bench/marker_bound.h"
#include "tools/io/camera_file.h"
#include "tools/io/csv_table.h"
#include "tools/synthetic/simulation_file.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

constexpr double kMinVisible = 0.98;
constexpr double kMaxIncidenceDeg = 75;
constexpr double kOutlierPx = 3;
constexpr std::array<double, 4> kSideLimitsPx{40, 150, 400, 1e9};
constexpr std::array<const char*, 4> kSideNames{"< 40 px", "40-150 px", "150-400 px", "> 400 px"};

struct TrueMarker {
  std::array<Eigen::Vector2d, 4> corners_px;
  double visible = 1;
  double incidence_deg = 0;

  [[nodiscard]] std::size_t bin() const {
    double side = 0;
    for (std::size_t i = 0; i < 4; ++i) side += 0.25 * (corners_px[(i + 1) % 4] - corners_px[i]).norm();
    std::size_t bin = 0;
    while (side > kSideLimitsPx[bin]) ++bin;
    return bin;
  }
  [[nodiscard]] bool wanted() const { return visible >= kMinVisible && incidence_deg <= kMaxIncidenceDeg; }
};
struct TruePhotograph {
  std::map<int, TrueMarker> markers;
  double blur_px = 0;
};

std::map<std::string, TruePhotograph> read_truth(const fs::path& campaign) {
  const CsvTable table = CsvTable::read(campaign / "truth" / "observations.csv");
  std::map<std::string, TruePhotograph> truth;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    TrueMarker& marker = truth[table.text(row, "photo")].markers[table.integer(row, "id")];
    marker.corners_px.at(static_cast<std::size_t>(table.integer(row, "corner"))) = {
        table.number(row, "x_px"), table.number(row, "y_px")};
    marker.visible = std::min(marker.visible, table.number(row, "visible_share"));
    marker.incidence_deg = table.number(row, "incidence_deg");
  }
  const CsvTable photos = CsvTable::read(campaign / "truth" / "photos.csv");
  for (std::size_t row = 0; row < photos.rows(); ++row) {
    const auto photograph = truth.find(photos.text(row, "photo"));
    if (photograph != truth.end()) photograph->second.blur_px = photos.number(row, "blur_px");
  }
  return truth;
}

// Black and white of a marker as light: the medians over the middles of its cells.
MarkerImage image_of(const TrueMarker& marker, double blur_px, const MarkerPattern& pattern,
                     const cv::Mat& grey) {
  std::vector<double> black;
  std::vector<double> white;
  const double border = 0.5 * (pattern.cells - pattern.square_cells);
  const auto& c = marker.corners_px;
  for (int y = 0; y < pattern.cells; ++y) {
    for (int x = 0; x < pattern.cells; ++x) {
      const double u = (x + 0.5 - border) / pattern.square_cells;
      const double v = (y + 0.5 - border) / pattern.square_cells;
      const Eigen::Vector2d px =
          (1 - u) * (1 - v) * c[0] + u * (1 - v) * c[1] + u * v * c[2] + (1 - u) * v * c[3];
      const cv::Point at(static_cast<int>(std::lround(px.x())), static_cast<int>(std::lround(px.y())));
      if (!cv::Rect(0, 0, grey.cols, grey.rows).contains(at)) continue;
      const bool is_white = pattern.white[static_cast<std::size_t>(y * pattern.cells + x)] != 0;
      (is_white ? white : black).push_back(grey.at<std::uint8_t>(at) / 255.0);
    }
  }
  const ToneResponse tone(ToneCurve::srgb);
  return {marker.corners_px, blur_px, tone.decode(median(black)), tone.decode(median(white))};
}

struct Figures {
  int wanted = 0, found = 0, refused = 0, outliers = 0;
  double squares = 0, outward = 0, normalised = 0;
  double bounded_squares = 0, bound = 0;  // of the markers whose bound is known
  std::vector<double> predicted;          // px^2
};

struct Tally {
  std::array<Figures, kSideNames.size()> bins;
  int false_ids = 0;
  double cpu_s = 0;
};

void compare(const TruePhotograph& truth, const std::map<int, double>& bounds,
             const std::vector<MarkerObservation>& seen, Tally& tally) {
  for (const auto& [id, marker] : truth.markers) {
    if (marker.wanted()) ++tally.bins[marker.bin()].wanted;
  }
  for (const auto& marker : seen) {
    const auto known = truth.markers.find(marker.id);
    if (known == truth.markers.end()) {
      ++tally.false_ids;
      continue;
    }
    Figures& figures = tally.bins[known->second.bin()];
    if (marker.status != MarkerStatus::ok) {
      ++figures.refused;
      continue;
    }
    if (!known->second.wanted()) continue;
    ++figures.found;
    Eigen::Matrix<double, 8, 1> error;
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const auto& corner : known->second.corners_px) middle += 0.25 * corner;
    double outward = 0;
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector2d& true_corner = known->second.corners_px[static_cast<std::size_t>(k)];
      error.segment<2>(2 * k) = marker.corners_px[static_cast<std::size_t>(k)] - true_corner;
      outward += 0.25 * error.segment<2>(2 * k).dot((true_corner - middle).normalized());
    }
    if (error.cwiseAbs().maxCoeff() > kOutlierPx) {
      ++figures.outliers;
      continue;
    }
    figures.squares += error.squaredNorm() / 8;
    figures.outward += outward;
    figures.normalised += error.dot(marker.covariance_px2.ldlt().solve(error)) / 8;
    figures.predicted.push_back(marker.covariance_px2.trace() / 8);
    if (const auto bound = bounds.find(marker.id); bound != bounds.end()) {
      figures.bounded_squares += error.squaredNorm() / 8;
      figures.bound += bound->second;
    }
  }
}

void print_tally(const std::string& scene, const Detector& detector, const Tally& tally, double imread_s) {
  bool first = true;
  for (std::size_t b = 0; b < tally.bins.size(); ++b) {
    const Figures& f = tally.bins[b];
    if (f.wanted == 0) continue;
    const double good = std::max(f.found - f.outliers, 1);
    const bool any = f.found > f.outliers;
    fmt::print("{:<14} {:<11} {:<14} {:>5} of {:>4} {:>7} {:>8} {:>7} {:>8} {:>8} {:>8} {:>10} {:>5} {:>8}\n",
               scene, kSideNames[b], detector.name, f.found, f.wanted, f.refused, f.outliers,
               any ? fmt::format("{:.4f}", std::sqrt(f.squares / good)) : "",
               any ? fmt::format("{:.4f}", f.outward / good) : "",
               any && detector.has_covariance ? fmt::format("{:.4f}", std::sqrt(median(f.predicted))) : "",
               any && detector.has_covariance ? fmt::format("{:.2f}", f.normalised / good) : "",
               any && f.bound > 0 ? fmt::format("{:.2f}", std::sqrt(f.bound / f.bounded_squares)) : "",
               first ? fmt::format("{}", tally.false_ids) : "",
               first ? fmt::format("{:.2f}", tally.cpu_s / imread_s) : "");
    first = false;
  }
}

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

void run_scene(const fs::path& campaign, const std::vector<Detector>& chosen) {
  const SimulationOptions options = read_simulation_file(campaign / "truth" / "simulation.yaml");
  const CameraModel camera = read_camera_file(campaign / "truth" / "camera.yaml").model;
  const MarkerFamily& family = marker_family(options.markers.family);
  std::vector<Tally> tallies(chosen.size());
  double imread_s = 0;
  for (const auto& [name, truth] : read_truth(campaign)) {
    const double start = cpu_s();
    if (cv::imread((campaign / name).string(), cv::IMREAD_COLOR).empty()) {
      throw InputError(fmt::format("{}: cannot be read", (campaign / name).string()));
    }
    imread_s += cpu_s() - start;
    const Photograph photograph = read_photograph(campaign / name);
    if (photograph.status != PhotographStatus::ok) {
      throw InputError(fmt::format("{}: {}", (campaign / name).string(), photograph.reason));
    }
    std::map<int, double> bounds;
    for (const auto& [id, marker] : truth.markers) {
      if (!marker.wanted()) continue;
      const MarkerPattern& pattern = family.patterns.at(static_cast<std::size_t>(id));
      const auto bound =
          corner_bound(pattern, image_of(marker, truth.blur_px, pattern, photograph.grey), options.sensor);
      if (bound) bounds[id] = bound->trace() / 8;
    }
    for (std::size_t k = 0; k < chosen.size(); ++k) {
      const double from = cpu_s();
      const auto seen = chosen[k].detect(photograph.grey, family, &camera);
      tallies[k].cpu_s += cpu_s() - from;
      compare(truth, bounds, seen, tallies[k]);
    }
  }
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    print_tally(campaign.filename().string(), chosen[k], tallies[k], imread_s);
  }
  std::fflush(stdout);
}

// Without a camera the detectors that use one are others over again.
void run_clutter(int photographs, std::vector<Detector> chosen) {
  std::erase_if(chosen, [](const Detector& detector) { return detector.uses_camera; });
  const MarkerFamily& family = marker_family("tag36h11");
  std::vector<int> trusted(chosen.size());
  std::vector<int> listed(chosen.size());
  for (int i = 0; i < photographs; ++i) {
    const cv::Mat grey = clutter_photograph(static_cast<std::uint64_t>(i));
    for (std::size_t k = 0; k < chosen.size(); ++k) {
      for (const auto& marker : chosen[k].detect(grey, family, nullptr)) {
        ++(marker.status == MarkerStatus::ok ? trusted : listed)[k];
      }
    }
  }
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    fmt::print("clutter: {:<14} {} false ids, {} refused, in {} photographs of {} x {} px\n", chosen[k].name,
               trusted[k], listed[k], photographs, kClutterWidthPx, kClutterHeightPx);
  }
}

}  // namespace
}  // namespace hexcal

int main(int argc, char** argv) {
  using namespace hexcal;
  CLI::App app{"Corner errors of several detectors on photographs rendered by `hexcal simulate`"};
  std::vector<std::filesystem::path> campaigns;
  std::vector<std::string> names;
  int clutter = 0;
  app.add_option("CAMPAIGN", campaigns, "folders written by hexcal simulate");
  app.add_option("--detectors", names, "only those whose names start so")->delimiter(',');
  app.add_option("--clutter", clutter, "count false ids in so many photographs without markers");
  CLI11_PARSE(app, argc, argv);
  try {
    std::vector<Detector> chosen;
    std::copy_if(detectors().begin(), detectors().end(), std::back_inserter(chosen),
                 [&names](const Detector& detector) {
                   return names.empty() ||
                          std::any_of(names.begin(), names.end(), [&detector](const std::string& name) {
                            return detector.name.starts_with(name);
                          });
                 });
    if (!campaigns.empty()) {
      fmt::print("{:<14} {:<11} {:<14} {:>13} {:>7} {:>8} {:>7} {:>8} {:>8} {:>8} {:>10} {:>5} {:>8}\n",
                 "scene", "side", "detector", "found", "refused", "outliers", "rms_px", "out_px", "sigma_px",
                 "norm_var", "efficiency", "false", "x imread");
    }
    for (const auto& campaign : campaigns) run_scene(campaign, chosen);
    if (clutter > 0) run_clutter(clutter, chosen);
    return 0;
  } catch (const InputError& error) {
    fmt::print(stderr, "accuracy: {}\n", error.what());
    return 2;
  }
}
