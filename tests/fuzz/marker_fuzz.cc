#include <tbb/global_control.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <opencv2/core.hpp>

#include "camera_calib/detect_sheets.h"
#include "photogrammetry/markers/detect.h"
#include "tests/fuzz/fuzz_input.h"

// Detection and measurement on any small picture. Six bytes say what to do and how wide the picture is, the
// rest are its pixels; where they end, they begin again.

namespace hexcal::fuzzing {
namespace {

void check(const MarkerObservation& marker) {
  if (marker.status != MarkerStatus::ok) return;
  for (const auto& corner : marker.corners_px) promise_finite(corner, "a corner");
  promise_finite(marker.covariance_px2, "a marker's covariance");
  promise(marker.covariance_px2.diagonal().minCoeff() > 0, "a marker's variance is more than 0");
  promise(std::isfinite(marker.chi2_per_dof) && std::isfinite(marker.side_px), "a marker's figures");
}

void check(const PointObservation& point) {
  if (point.status != MarkerStatus::ok) return;
  promise_finite(point.px, "a point");
  promise_finite(point.covariance_px2, "a point's covariance");
  promise(point.covariance_px2.diagonal().minCoeff() > 0, "a point's variance is more than 0");
}

Sheet sheet_of(int kind) {
  Sheet sheet;
  sheet.kind = kind == 0 ? SheetKind::charuco : kind == 1 ? SheetKind::chessboard : SheetKind::photomodeler;
  sheet.family = kind == 0 ? "DICT_4X4_50" : "";
  sheet.columns = 6;
  sheet.rows = kind == 2 ? 6 : 5;
  sheet.pitch_mm = 10;
  sheet.marker_mm = 7;
  sheet.dot_mm = 4;
  return sheet;
}

void look(const cv::Mat& grey, ToneCurve tone, std::uint8_t what, double a, double b) {
  const CameraModel camera(grey.cols, grey.rows, 1.5 * grey.cols);
  switch (what % 8) {
    case 0:
      for (const auto& marker : detect_markers(grey, tone, marker_family("tag36h11"))) check(marker);
      return;
    case 1:
      for (const auto& marker : detect_markers(grey, tone, marker_family("tag36h11"), {}, &camera))
        check(marker);
      return;
    case 2:
      for (const auto& marker : detect_markers(grey, tone, marker_family("DICT_4X4_50"))) check(marker);
      return;
    case 3:
      return check(refine_saddle(grey, tone, {{a, b}, {12, b / 8}, {-a / 8, 12}, a / 512, b / 512}));
    case 4: {
      Eigen::Matrix3d image_from_plane;
      image_from_plane << 1 + a / 256, 0.1, a, b / 256, 1, b, 1e-4 * a, 1e-5 * b, 1;
      return check(refine_dot(grey, tone, image_from_plane, {0, 0}, 2 + b / 32));
    }
    default:
      for (const auto& feature : detect_sheets(grey, tone, {sheet_of(what % 8 - 5)}).features) {
        if (feature.status != MarkerStatus::ok) continue;
        promise_finite(feature.px, "a feature");
        promise_finite(feature.covariance_px2, "a feature's covariance");
      }
  }
}

}  // namespace
}  // namespace hexcal::fuzzing

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hexcal;
  using namespace hexcal::fuzzing;
  static const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  constexpr std::size_t kHead = 6;
  if (size <= kHead) return 0;
  const bool wide = (data[1] & 1U) != 0;
  const ToneCurve tone = (data[1] & 2U) != 0 ? ToneCurve::linear : ToneCurve::srgb;
  cv::Mat grey(1 + data[3], 1 + data[2], wide ? CV_16UC1 : CV_8UC1);
  const std::size_t bytes = grey.total() * grey.elemSize();
  for (std::size_t i = 0; i < bytes; ++i) grey.data[i] = data[kHead + i % (size - kHead)];
  refused_or([&] { look(grey, tone, data[0], data[4], data[5]); });
  return 0;
}
