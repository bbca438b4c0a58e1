#include "camera_calib/measure_camera.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>

#include "camera_calib/bent_markers.h"
#include "camera_calib/detect_sheets.h"
#include "camera_calib/find_chessboard.h"
#include "camera_calib/robust_fit.h"
#include "camera_calib/sheet_slip.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

// Pixels kept in memory between the measurements; beyond, photographs are read again.
constexpr std::size_t kKeptBytes = std::size_t{1} << 31;
constexpr double kLeastRoughSigmaPx = 0.02;  // what a rough camera leaves unexplained at least

// Photographs kept in memory; those that do not fit are read again.
class Pixels {
 public:
  explicit Pixels(const std::vector<fs::path>& paths) : paths_(paths), kept_(paths.size()) {}

  void keep(std::size_t i, Photograph&& photograph) {
    const std::size_t bytes = photograph.grey.total() * photograph.grey.elemSize();
    if (bytes * paths_.size() <= kKeptBytes) kept_[i] = std::move(photograph);
  }
  [[nodiscard]] Photograph get(std::size_t i) const {
    return kept_[i].grey.empty() ? read_photograph(paths_[i]) : kept_[i];
  }

 private:
  const std::vector<fs::path>& paths_;
  std::vector<Photograph> kept_;
};

SheetPhotograph measure(const fs::path& path, const std::vector<Sheet>& sheets, Photograph& photograph) {
  photograph = read_photograph(path);
  SheetPhotograph out;
  out.name = path.filename().string();
  out.status = photograph.status;
  out.reason = photograph.reason;
  out.info = photograph.info;
  out.sha256 = photograph.sha256;
  if (photograph.status != PhotographStatus::ok) return out;
  out.info.width_px = photograph.grey.cols;
  out.info.height_px = photograph.grey.rows;
  SheetDetection detection = detect_sheets(photograph.grey, photograph.tone, sheets);
  out.features = std::move(detection.features);
  out.markers = std::move(detection.markers);
  out.reason = detection.reason;
  if (!detection.foreign_ids.empty() && detection.foreign_ids.size() * 4 > out.features.size()) {
    const auto [least, most] =
        std::minmax_element(detection.foreign_ids.begin(), detection.foreign_ids.end());
    out.reason =
        fmt::format("ids {} to {} are on no sheet of the template: check first_id and family", *least, *most);
    if (detection.foreign_ids.size() > out.features.size()) out.features.clear();
  }
  return out;
}

void leave_out(SheetPhotograph& photograph, std::string reason) {
  photograph.features.clear();
  photograph.reason = std::move(reason);
}

// The value that most of the photographs have; the smaller of two equally frequent ones.
template <typename T>
T most_frequent(const std::map<T, int>& counts) {
  return std::max_element(counts.begin(), counts.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

// A camera is one image size and one zoom setting.
void leave_out_other_settings(std::vector<SheetPhotograph>& photographs) {
  std::map<std::pair<int, int>, int> sizes;
  for (const SheetPhotograph& p : photographs) {
    if (!p.features.empty()) ++sizes[{p.info.width_px, p.info.height_px}];
  }
  if (sizes.empty()) return;
  const auto size = most_frequent(sizes);
  std::map<double, int> focals;
  for (SheetPhotograph& p : photographs) {
    if (p.features.empty()) continue;
    if (std::pair(p.info.width_px, p.info.height_px) != size) {
      leave_out(p,
                fmt::format("is {} x {} px, the others {} x {} px: resized, cropped or turned by a program",
                            p.info.width_px, p.info.height_px, size.first, size.second));
    } else if (p.info.focal_length_mm) {
      ++focals[*p.info.focal_length_mm];
    }
  }
  if (focals.size() < 2) return;
  const double focal = most_frequent(focals);
  for (SheetPhotograph& p : photographs) {
    if (p.features.empty() || !p.info.focal_length_mm) continue;
    if (std::abs(*p.info.focal_length_mm - focal) > 0.01 * focal) {
      leave_out(p, fmt::format("was taken at {:g} mm, the others at {:g} mm: one zoom setting is one camera",
                               *p.info.focal_length_mm, focal));
    }
  }
}

// Each photograph's features at the places that the rough camera's views predict, through its lens.
std::vector<SheetMeasurement> measure_at_views(const std::vector<Sheet>& sheets, const Pixels& pixels,
                                               const CalibrationState& rough, std::size_t photographs,
                                               const std::function<void()>& on_photograph) {
  std::vector<SheetMeasurement> out(photographs);
  tbb::parallel_for(std::size_t{0}, photographs, [&](std::size_t i) {
    std::vector<SheetView> views;
    for (const SheetView& view : rough.views) {
      if (view.photograph == static_cast<int>(i)) views.push_back(view);
    }
    if (!views.empty()) {
      const Photograph photograph = pixels.get(i);
      out[i] = measure_sheets(photograph.grey, photograph.tone, sheets, rough.shapes, rough.camera, views);
    }
    if (on_photograph) on_photograph();
  });
  return out;
}

// A lens that was known only roughly bends corners where markers are large in the frame: with a camera from
// all corners the markers are measured again, until no lens bends them otherwise.
void measure_markers(const std::vector<Sheet>& sheets, const Pixels& pixels, CalibrationState state,
                     double sigma_px, std::vector<SheetMeasurement>& measured,
                     std::vector<SheetPhotograph>& photographs) {
  constexpr int kRounds = 3;
  const CameraVariant variant{LensModel::radial, all_but_affinity(LensModel::radial), BoardFreedom::warped};
  for (int round = 0; round < kRounds; ++round) {
    const CameraModel before = state.camera;
    const RobustFitResult fit = robust_fit(sheets, with_features(state, photographs), variant, sigma_px,
                                           {.rounds = 2, .with_covariance = false});
    if (!fit.adjustment.converged) return;
    state = fit.adjustment.state;
    sigma_px = std::max(fit.extra_sigma_px, kLeastRoughSigmaPx);
    std::atomic<int> count = 0;
    tbb::parallel_for(std::size_t{0}, photographs.size(), [&](std::size_t i) {
      if (measured[i].guesses.empty()) return;
      if (round > 0 && !bent_otherwise(measured[i].features, before, state.camera)) return;
      measured[i] = with_markers_measured(pixels.get(i).grey, state.camera, std::move(measured[i]));
      photographs[i].features = measured[i].features;
      ++count;
    });
    if (count == 0) return;
  }
}

// Where a chessboard is found in few photographs: whether another one, a usual slip away from the
// description, is in them. A handful of photographs tells.
std::optional<std::string> chessboard_slip(const std::vector<Sheet>& sheets,
                                           const std::vector<SheetPhotograph>& photographs,
                                           const Pixels& pixels) {
  constexpr std::size_t kLooked = 6;
  if (sheets.size() != 1 || sheets[0].kind != SheetKind::chessboard) return std::nullopt;
  std::vector<std::size_t> without;
  std::size_t readable = 0;
  for (std::size_t i = 0; i < photographs.size(); ++i) {
    if (photographs[i].status != PhotographStatus::ok) continue;
    ++readable;
    if (photographs[i].features.empty()) without.push_back(i);
  }
  if (without.empty() || 4 * (readable - without.size()) > readable) return std::nullopt;
  const std::size_t stride = (without.size() + kLooked - 1) / kLooked;
  std::vector<std::size_t> looked;
  for (std::size_t i = 0; i < without.size(); i += stride) looked.push_back(without[i]);
  std::vector<std::optional<std::pair<int, int>>> found(looked.size());
  tbb::parallel_for(std::size_t{0}, looked.size(),
                    [&](std::size_t i) { found[i] = chessboard_size(pixels.get(looked[i]).grey); });
  std::map<std::pair<int, int>, int> counts;
  for (const auto& one : found)
    if (one) ++counts[*one];
  if (counts.empty()) return std::nullopt;
  std::pair<int, int> size = most_frequent(counts);
  const int most_seen = counts[size];
  if (2 * most_seen < static_cast<int>(looked.size())) return std::nullopt;
  const std::pair<int, int> given(sheets[0].columns, sheets[0].rows);
  if (given.first < given.second) std::swap(size.first, size.second);
  if (size == given) return std::nullopt;
  const bool corners = size == std::pair(given.first + 1, given.second + 1);
  return fmt::format(
      "the sheet's description says columns: {}, rows: {}, the photographs show columns: {}, rows: {} ({} of "
      "{} "
      "looked at){}",
      given.first, given.second, size.first, size.second, most_seen, looked.size(),
      corners ? ": columns and rows count squares, not the corners between them" : "");
}

LensSetting common_setting(const std::vector<SheetPhotograph>& photographs,
                           const CameraCalibration& calibration) {
  for (const SheetView& view : calibration.fit.adjustment.state.views) {
    return lens_setting(photographs[static_cast<std::size_t>(view.photograph)].info);
  }
  return {};
}

}  // namespace

MeasuredCamera measure_camera(const std::vector<fs::path>& paths, const std::vector<Sheet>& sheets,
                              const CameraCalibrationOptions& options,
                              const std::function<void()>& on_photograph) {
  MeasuredCamera out;
  out.photographs.resize(paths.size());
  Pixels pixels(paths);
  tbb::parallel_for(std::size_t{0}, paths.size(), [&](std::size_t i) {
    Photograph photograph;
    out.photographs[i] = measure(paths[i], sheets, photograph);
    if (photograph.status == PhotographStatus::ok) pixels.keep(i, std::move(photograph));
    if (on_photograph) on_photograph();
  });
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const auto slip = sheet_slip(sheets, s, out.photographs);
    if (!slip) continue;
    out.calibration.status = CalibrationStatus::other_sheet;
    out.calibration.reason = *slip;
    return out;
  }
  if (const auto slip = chessboard_slip(sheets, out.photographs, pixels)) {
    out.calibration.status = CalibrationStatus::other_sheet;
    out.calibration.reason = *slip;
    return out;
  }
  leave_out_other_settings(out.photographs);
  out.calibration = rough_calibration(sheets, out.photographs, options);
  if (out.calibration.status != CalibrationStatus::ok) return out;
  const CalibrationState& rough = out.calibration.fit.adjustment.state;
  std::vector<SheetMeasurement> measured =
      measure_at_views(sheets, pixels, rough, paths.size(), on_photograph);
  for (std::size_t i = 0; i < paths.size(); ++i) {
    if (!measured[i].features.empty()) out.photographs[i].features = measured[i].features;
  }
  const double sigma_px = std::max(out.calibration.fit.extra_sigma_px, kLeastRoughSigmaPx);
  measure_markers(sheets, pixels, rough, sigma_px, measured, out.photographs);
  out.calibration = calibrate_camera(sheets, with_features(rough, out.photographs), sigma_px, options);
  out.setting = common_setting(out.photographs, out.calibration);
  return out;
}

}  // namespace hexcal
