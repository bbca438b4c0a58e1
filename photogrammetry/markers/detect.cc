#include "photogrammetry/markers/detect.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/markers/marker_decoder.h"
#include "photogrammetry/markers/quad_finder.h"

namespace hexcal {
namespace {

constexpr double kFrameMarginPx = 2;

// For finding and reading only: 16 bits become 8, linear light through a square root.
cv::Mat eight_bit(const cv::Mat& grey, ToneCurve tone) {
  if (grey.depth() == CV_8U) return grey;
  std::vector<std::uint8_t> table(65536);
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double share = static_cast<double>(i) / 65535;
    table[i] =
        static_cast<std::uint8_t>(std::lround(255 * (tone == ToneCurve::linear ? std::sqrt(share) : share)));
  }
  cv::Mat result(grey.rows, grey.cols, CV_8UC1);
  for (int y = 0; y < grey.rows; ++y) {
    const std::uint16_t* from = grey.ptr<std::uint16_t>(y);
    std::uint8_t* to = result.ptr(y);
    for (int x = 0; x < grey.cols; ++x) to[x] = table[from[x]];
  }
  return result;
}

Eigen::Vector2d middle_of(const DecodedMarker& marker) {
  return 0.25 * (marker.corners_px[0] + marker.corners_px[1] + marker.corners_px[2] + marker.corners_px[3]);
}

double side_of(const DecodedMarker& marker) {
  return 0.5 *
         ((marker.corners_px[2] - marker.corners_px[0]).norm() +
          (marker.corners_px[3] - marker.corners_px[1]).norm()) /
         std::sqrt(2.0);
}

// Better read first. The tiles of the search see only the rim of a large black border, so that its inner
// outline reads as well as the true one: of a dark square the outer outline counts, of a bright one the
// inner.
double rank(const DecodedMarker& marker, bool dark_square) {
  return marker.wrong_cells + (marker.mirrored ? 1 : 0) - 2 * marker.clarity -
         (dark_square ? 40 : -40) * std::log(side_of(marker));
}

// One reading per place: of overlapping ones the clearest.
std::vector<DecodedMarker> without_overlaps(std::vector<DecodedMarker> markers, bool dark_square) {
  std::stable_sort(markers.begin(), markers.end(), [dark_square](const auto& a, const auto& b) {
    return rank(a, dark_square) < rank(b, dark_square);
  });
  std::vector<DecodedMarker> kept;
  for (const auto& marker : markers) {
    const bool overlaps = std::any_of(kept.begin(), kept.end(), [&](const DecodedMarker& other) {
      return (middle_of(marker) - middle_of(other)).norm() < 0.5 * std::max(side_of(marker), side_of(other));
    });
    if (!overlaps) kept.push_back(marker);
  }
  std::stable_sort(kept.begin(), kept.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  return kept;
}

std::vector<DecodedMarker> read_markers(const cv::Mat& grey, const std::vector<Quad>& quads,
                                        const MarkerFamily& family, const std::vector<int>& ids) {
  const MarkerDecoder decoder(family, ids);
  std::vector<std::optional<DecodedMarker>> read(quads.size());
  tbb::parallel_for(std::size_t{0}, quads.size(),
                    [&](std::size_t i) { read[i] = decoder.decode(grey, quads[i]); });
  std::vector<DecodedMarker> markers;
  for (auto& marker : read) {
    if (marker) markers.push_back(*marker);
  }
  const MarkerPattern& pattern = family.patterns.front();
  const int first = static_cast<int>(std::lround(0.5 * (pattern.cells - pattern.square_cells)));
  const bool dark_square = pattern.white[static_cast<std::size_t>(first * pattern.cells + first)] == 0;
  return without_overlaps(std::move(markers), dark_square);
}

bool touches_frame(const DecodedMarker& marker, const cv::Mat& grey) {
  return std::any_of(marker.corners_px.begin(), marker.corners_px.end(), [&grey](const Eigen::Vector2d& c) {
    return c.x() < kFrameMarginPx || c.y() < kFrameMarginPx || c.x() > grey.cols - 1 - kFrameMarginPx ||
           c.y() > grey.rows - 1 - kFrameMarginPx;
  });
}

// Statuses that are known before any fit.
MarkerStatus status_as_read(const DecodedMarker& marker, const cv::Mat& grey) {
  if (marker.mirrored) return MarkerStatus::mirrored;
  if (marker.inverted) return MarkerStatus::inverted;
  if (touches_frame(marker, grey)) return MarkerStatus::cut_by_frame;
  return MarkerStatus::ok;
}

MarkerObservation observation_as_read(const DecodedMarker& marker, MarkerStatus status) {
  MarkerObservation observation;
  observation.id = marker.id;
  observation.status = status;
  observation.corners_px = marker.corners_px;
  observation.side_px = side_of(marker);
  return observation;
}

}  // namespace

void DetectionOptions::validate() const {
  refine.validate();
  for (const int id : ids) {
    if (id < 0) throw InputError(fmt::format("ids has {}, wanted none below 0", id));
  }
}

std::vector<MarkerObservation> detect_markers(const cv::Mat& grey, ToneCurve tone, const MarkerFamily& family,
                                              const DetectionOptions& options, const CameraModel* camera) {
  options.validate();
  CV_Assert(grey.type() == CV_8UC1 || grey.type() == CV_16UC1);
  const cv::Mat eight = eight_bit(grey, tone);
  const std::vector<DecodedMarker> markers =
      read_markers(eight, find_quads(eight, options.refine.min_side_px), family, options.ids);
  std::vector<MarkerObservation> observations;
  std::vector<std::size_t> measured;
  std::vector<MarkerGuess> guesses;
  for (std::size_t i = 0; i < markers.size(); ++i) {
    observations.push_back(observation_as_read(markers[i], status_as_read(markers[i], grey)));
    if (observations.back().status != MarkerStatus::ok) continue;
    measured.push_back(i);
    guesses.push_back({&family.patterns[static_cast<std::size_t>(markers[i].id)], markers[i].corners_px});
  }
  const RefinedMarkers refined = refine_markers(grey, ToneResponse(tone), guesses, options.refine, camera);
  for (std::size_t k = 0; k < measured.size(); ++k) {
    observations[measured[k]] = refined.markers[k];
    observations[measured[k]].id = markers[measured[k]].id;
  }
  for (std::size_t i = 0; i + 1 < observations.size(); ++i) {
    if (observations[i].id != observations[i + 1].id) continue;
    observations[i].status = observations[i + 1].status = MarkerStatus::duplicate;
  }
  return observations;
}

std::vector<FamilyReading> read_families(const cv::Mat& grey, ToneCurve tone,
                                         const std::vector<std::string>& families) {
  CV_Assert(grey.type() == CV_8UC1 || grey.type() == CV_16UC1);
  const cv::Mat eight = eight_bit(grey, tone);
  const std::vector<Quad> quads = find_quads(eight, RefineOptions().min_side_px);
  std::vector<FamilyReading> readings;
  for (const std::string& name : families) {
    FamilyReading reading{name, {}};
    for (const DecodedMarker& marker : read_markers(eight, quads, marker_family(name), {})) {
      const MarkerStatus status = status_as_read(marker, grey);
      if (marker.wrong_cells == 0 && status == MarkerStatus::ok)
        reading.markers.push_back(observation_as_read(marker, status));
    }
    readings.push_back(std::move(reading));
  }
  return readings;
}

PhotographObservations observe_photograph(const Photograph& photograph, const MarkerFamily& family,
                                          const DetectionOptions& options, const CameraModel* camera) {
  PhotographObservations observations;
  observations.name = photograph.path.filename().string();
  observations.sha256 = photograph.sha256;
  observations.status = photograph.status;
  observations.reason = photograph.reason;
  observations.info = photograph.info;
  if (photograph.status != PhotographStatus::ok) return observations;
  if (camera != nullptr &&
      (camera->width_px != photograph.grey.cols || camera->height_px != photograph.grey.rows)) {
    throw InputError(fmt::format("{}: is {} x {} pixels, the camera file is for {} x {}",
                                 photograph.path.string(), photograph.grey.cols, photograph.grey.rows,
                                 camera->width_px, camera->height_px));
  }
  observations.markers = detect_markers(photograph.grey, photograph.tone, family, options, camera);
  return observations;
}

}  // namespace hexcal
