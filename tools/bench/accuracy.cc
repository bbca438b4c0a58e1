// Corner errors of several detectors on the same rendered photographs: folders written by `hexcal simulate`,
// whose truth/observations.csv holds the true corners.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>

#include "kinematics/geometry/input_error.h"
#include "tools/bench/accuracy_detectors.h"
#include "tools/io/csv_table.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

constexpr double kMinVisible = 0.98;
constexpr double kMaxIncidenceDeg = 75;
constexpr double kOutlierPx = 3;

struct TrueMarker {
  std::array<Eigen::Vector2d, 4> corners_px;
  double visible = 1;
  double incidence_deg = 0;
};
using TruePhotograph = std::map<int, TrueMarker>;

std::map<std::string, TruePhotograph> read_truth(const fs::path& campaign) {
  const CsvTable table = CsvTable::read(campaign / "truth" / "observations.csv");
  std::map<std::string, TruePhotograph> truth;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    TrueMarker& marker = truth[table.text(row, "photo")][table.integer(row, "id")];
    marker.corners_px.at(static_cast<std::size_t>(table.integer(row, "corner"))) = {
        table.number(row, "x_px"), table.number(row, "y_px")};
    marker.visible = std::min(marker.visible, table.number(row, "visible_share"));
    marker.incidence_deg = table.number(row, "incidence_deg");
  }
  return truth;
}

struct Figures {
  int wanted = 0, found = 0, refused = 0, false_ids = 0, outliers = 0;
  double squares = 0, outward = 0, normalised = 0, predicted = 0, seconds = 0;
};

void compare(const TruePhotograph& truth, const std::vector<MarkerObservation>& seen, Figures& figures) {
  for (const auto& [id, marker] : truth) {
    if (marker.visible >= kMinVisible && marker.incidence_deg <= kMaxIncidenceDeg) ++figures.wanted;
  }
  for (const auto& marker : seen) {
    const auto known = truth.find(marker.id);
    if (known == truth.end()) {
      ++figures.false_ids;
      continue;
    }
    if (marker.status != MarkerStatus::ok) {
      ++figures.refused;
      continue;
    }
    if (known->second.visible < kMinVisible || known->second.incidence_deg > kMaxIncidenceDeg) continue;
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
    figures.predicted += marker.covariance_px2.trace() / 8;
  }
}

int run(const std::vector<fs::path>& campaigns) {
  fmt::print("{:<24} {:<15} {:>11} {:>7} {:>6} {:>8} {:>9} {:>10} {:>9} {:>8} {:>8}\n", "scene", "detector",
             "found", "refused", "false", "outliers", "rms_px", "outward_px", "sigma_px", "norm_var",
             "s/photo");
  const MarkerFamily& family = marker_family("tag36h11");
  for (const fs::path& campaign : campaigns) {
    const auto truth = read_truth(campaign);
    std::vector<Figures> figures(detectors().size());
    for (const auto& [name, markers] : truth) {
      const Photograph photograph = read_photograph(campaign / name);
      if (photograph.status != PhotographStatus::ok) {
        throw InputError(fmt::format("{}: {}", (campaign / name).string(), photograph.reason));
      }
      for (std::size_t k = 0; k < detectors().size(); ++k) {
        const auto start = std::chrono::steady_clock::now();
        const auto seen = detectors()[k].detect(photograph.grey, family);
        figures[k].seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        compare(markers, seen, figures[k]);
      }
    }
    for (std::size_t k = 0; k < detectors().size(); ++k) {
      const Figures& f = figures[k];
      const double good = std::max(f.found - f.outliers, 1);
      const bool has_covariance = k == 0;
      fmt::print("{:<24} {:<15} {:>5} of {:>3} {:>7} {:>6} {:>8} {:>9.4f} {:>10.4f} {:>9} {:>8} {:>8.2f}\n",
                 campaign.filename().string(), detectors()[k].name, f.found, f.wanted, f.refused, f.false_ids,
                 f.outliers, std::sqrt(f.squares / good), f.outward / good,
                 has_covariance ? fmt::format("{:.4f}", std::sqrt(f.predicted / good)) : "",
                 has_covariance ? fmt::format("{:.2f}", f.normalised / good) : "",
                 f.seconds / static_cast<double>(truth.size()));
    }
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace hexcal

int main(int argc, char** argv) {
  CLI::App app{"Corner errors of several detectors on photographs rendered by `hexcal simulate`"};
  std::vector<std::filesystem::path> campaigns;
  app.add_option("CAMPAIGN", campaigns, "folders written by hexcal simulate")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    return hexcal::run(campaigns);
  } catch (const hexcal::InputError& error) {
    fmt::print(stderr, "accuracy: {}\n", error.what());
    return 2;
  }
}
