#include "camera_calib/detect_sheets.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <tuple>

#include "camera_calib/find_chessboard.h"
#include "camera_calib/find_dots.h"
#include "camera_calib/initial_camera.h"
#include "camera_calib/measure_point.h"
#include "camera_calib/robust_fit.h"
#include "camera_calib/sheet_image.h"
#include "photogrammetry/markers/detect.h"
#include "photogrammetry/markers/refine.h"

namespace hexcal {
namespace {

constexpr double kFrameMarginPx = 3;
constexpr int kPixelsOfRoughLook = 1000;  // a sixth of what a marker is measured with in the end

RefineOptions rough_look() {
  RefineOptions options;
  options.max_pixels = kPixelsOfRoughLook;
  return options;
}

FeatureObservation from_point(const PointObservation& point, int sheet, int first_point) {
  FeatureObservation feature;
  feature.sheet = sheet;
  feature.first_point = first_point;
  feature.status = point.status;
  feature.px = point.px;
  feature.covariance_px2 = point.covariance_px2;
  feature.blur_px = point.blur_px;
  feature.chi2_per_dof = point.chi2_per_dof;
  return feature;
}

void sort_features(std::vector<FeatureObservation>& features) {
  std::sort(features.begin(), features.end(), [](const FeatureObservation& a, const FeatureObservation& b) {
    return std::tie(a.sheet, a.first_point) < std::tie(b.sheet, b.first_point);
  });
}

// Pixels of all points of a sheet in one view; none outside the frame.
class PredictedSheet {
 public:
  PredictedSheet(const Sheet& sheet, const SheetShape& shape, const CameraModel& camera, const Rigid3& pose)
      : camera_(camera),
        pose_(pose),
        points_mm_(shaped_points(sheet, shape)),
        geometry_(sheet_geometry(sheet)) {}

  [[nodiscard]] std::optional<Eigen::Vector2d> at(const Eigen::Vector3d& point_mm) const {
    const auto px = camera_.project(pose_ * point_mm);
    return px && camera_.contains(*px, kFrameMarginPx) ? px : std::nullopt;
  }
  [[nodiscard]] const std::vector<Eigen::Vector3d>& points_mm() const { return points_mm_; }
  [[nodiscard]] const SheetGeometry& geometry() const { return geometry_; }
  [[nodiscard]] int first_saddle() const { return 4 * static_cast<int>(geometry_.markers.size()); }
  [[nodiscard]] int first_dot() const { return first_saddle() + static_cast<int>(geometry_.saddles.size()); }

  // Homography of the sheet's plane near a point, the lens linearised into it.
  [[nodiscard]] std::optional<Eigen::Matrix3d> local_homography(const Eigen::Vector3d& centre_mm,
                                                                double radius_mm) const {
    std::vector<Eigen::Vector2d> sheet;
    std::vector<Eigen::Vector2d> image;
    for (const double x : {-1.0, 0.0, 1.0}) {
      for (const double y : {-1.0, 0.0, 1.0}) {
        const Eigen::Vector3d point = centre_mm + 1.5 * radius_mm * Eigen::Vector3d(x, y, 0);
        const auto px = camera_.project(pose_ * point);
        if (!px) return std::nullopt;
        sheet.emplace_back(point.head<2>());
        image.push_back(*px);
      }
    }
    return homography_from_points(sheet, image);
  }

 private:
  const CameraModel& camera_;
  const Rigid3& pose_;
  std::vector<Eigen::Vector3d> points_mm_;
  SheetGeometry geometry_;
};

// What a board's drawing says of its inner corners.
class SaddleDrawing {
 public:
  explicit SaddleDrawing(const Sheet& sheet) : sheet_(sheet) {
    if (sheet.kind != SheetKind::charuco) return;
    const MarkerPattern& pattern =
        marker_family(sheet.family).patterns[static_cast<std::size_t>(sheet.first_id)];
    const int first = static_cast<int>(std::lround(0.5 * (pattern.cells - pattern.square_cells)));
    // Only a marker with a black border has an edge that is the same all along.
    if (pattern.white[static_cast<std::size_t>(first * pattern.cells + first)] != 0) return;
    gap_ = 0.5 * (1 - sheet.marker_mm / sheet.pitch_mm);
    border_ = sheet.marker_mm / pattern.square_cells / sheet.pitch_mm;
  }

  // From the pixels of the saddle and its neighbours to the right and below, in print.
  [[nodiscard]] SaddleGuess guess(const SheetSaddle& saddle, const Eigen::Vector2d& px,
                                  const Eigen::Vector2d& to_x_px, const Eigen::Vector2d& to_y_px) const {
    const bool top_left_black = ((saddle.column + saddle.row) % 2 == 0) != sheet_.top_left_white;
    return {px, to_x_px, to_y_px, gap_, border_, !top_left_black};
  }

 private:
  const Sheet& sheet_;
  double gap_ = 0, border_ = 0;
};

// At the places that a camera's view predicts. What was measured at the detection stays: no lens changes it.
void measure_saddles(const cv::Mat& grey, ToneCurve tone, const PredictedSheet& predicted,
                     const SheetView& view, const Sheet& description, std::vector<FeatureObservation>& out) {
  const SaddleDrawing drawing(description);
  const int first = predicted.first_saddle();
  const std::vector<SheetSaddle>& saddles = predicted.geometry().saddles;
  for (std::size_t i = 0; i < saddles.size(); ++i) {
    const int first_point = first + static_cast<int>(i);
    const FeatureObservation* before = nullptr;
    for (std::size_t f = 0; f < view.features.size(); ++f) {
      if (view.features[f].first_point == first_point && view.rejected[f] == 0) before = &view.features[f];
    }
    if (before != nullptr) {
      out.push_back(*before);
      continue;
    }
    const Eigen::Vector3d& point = predicted.points_mm()[static_cast<std::size_t>(first_point)];
    const double reach = description.pitch_mm;
    const auto px = predicted.at(point);
    const auto x = predicted.at(point + Eigen::Vector3d(reach, 0, 0));
    const auto y = predicted.at(point - Eigen::Vector3d(0, reach, 0));
    const auto x_back = predicted.at(point - Eigen::Vector3d(reach, 0, 0));
    const auto y_back = predicted.at(point + Eigen::Vector3d(0, reach, 0));
    if (!px || !(x || x_back) || !(y || y_back)) continue;
    const Eigen::Vector2d to_x = x ? *x - *px : *px - *x_back;
    const Eigen::Vector2d to_y = y ? *y - *px : *px - *y_back;
    out.push_back(from_point(measure_saddle(grey, tone, drawing.guess(saddles[i], *px, to_x, to_y)),
                             view.sheet, first_point));
  }
}

// By how much a rim that was fitted as a homography of its circle stands off from the image of the circle's
// centre, because the lens bends the rim in ways that no homography does, px. The fit moves and grows until
// the rim's normal distances are least.
std::optional<Eigen::Vector2d> bent_rim(const PredictedSheet& predicted, const Eigen::Matrix3d& homography,
                                        const Eigen::Vector3d& centre_mm, double radius_mm) {
  constexpr int kPoints = 24;
  const auto by_homography = [&](const Eigen::Vector3d& at) -> Eigen::Vector2d {
    return (homography * at.head<2>().homogeneous()).hnormalized();
  };
  const auto centre = predicted.at(centre_mm);
  if (!centre) return std::nullopt;
  Eigen::Matrix3d n = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  for (int i = 0; i < kPoints; ++i) {
    const double angle = 2 * std::numbers::pi * i / kPoints;
    const Eigen::Vector3d radial(std::cos(angle), std::sin(angle), 0);
    const Eigen::Vector3d tangent(-std::sin(angle), std::cos(angle), 0);
    const Eigen::Vector3d rim = centre_mm + radius_mm * radial;
    const auto px = predicted.at(rim);
    if (!px) return std::nullopt;
    const Eigen::Vector2d along =
        by_homography(rim + 0.01 * radius_mm * tangent) - by_homography(rim - 0.01 * radius_mm * tangent);
    const Eigen::Vector2d normal = Eigen::Vector2d(along.y(), -along.x()).normalized();
    const double growth = normal.dot(by_homography(rim) - by_homography(centre_mm));
    const Eigen::Vector3d row(normal.x(), normal.y(), growth);
    n += row * row.transpose();
    rhs += row * normal.dot(*px - by_homography(rim));
  }
  const Eigen::Vector3d moved = n.ldlt().solve(rhs);
  return *centre - by_homography(centre_mm) - moved.head<2>();
}

void measure_dots(const cv::Mat& grey, ToneCurve tone, const PredictedSheet& predicted, int sheet,
                  std::vector<FeatureObservation>& out) {
  const int first = predicted.first_dot();
  for (std::size_t i = 0; i < predicted.geometry().dots.size(); ++i) {
    const double radius = 0.5 * predicted.geometry().dots[i].diameter_mm;
    const Eigen::Vector3d& point = predicted.points_mm()[static_cast<std::size_t>(first) + i];
    const auto homography = predicted.local_homography(point, radius);
    if (!homography) continue;
    const auto bent = bent_rim(predicted, *homography, point, radius);
    if (!bent) continue;
    PointObservation dot = measure_dot(grey, tone, *homography, point.head<2>(), radius);
    dot.px += *bent;
    out.push_back(from_point(dot, sheet, first + static_cast<int>(i)));
  }
}

void detect_chessboard(const cv::Mat& grey, ToneCurve tone, const Sheet& sheet, int index,
                       SheetDetection& out) {
  const std::vector<Eigen::Vector2d> corners = find_chessboard(grey, sheet);
  if (corners.empty()) {
    out.reason = "the whole chessboard was not found";
    return;
  }
  const int columns = sheet.columns - 1;
  const int rows = sheet.rows - 1;
  const auto corner = [&corners, columns](int c, int r) {
    return corners[static_cast<std::size_t>(r * columns + c)];
  };
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const Eigen::Vector2d at = corner(c, r);
      const Eigen::Vector2d to_x = c + 1 < columns ? corner(c + 1, r) - at : at - corner(c - 1, r);
      const Eigen::Vector2d to_y = r + 1 < rows ? corner(c, r + 1) - at : at - corner(c, r - 1);
      out.features.push_back(
          from_point(measure_saddle(grey, tone, {at, to_x, to_y}), index, r * columns + c));
    }
  }
}

// Homography of the sheet's plane near dot `at` from the dots found around it.
std::optional<Eigen::Matrix3d> homography_around(const std::vector<SheetDot>& dots,
                                                 const std::vector<std::optional<Eigen::Vector2d>>& found,
                                                 std::size_t at, double reach_mm) {
  std::vector<Eigen::Vector2d> sheet;
  std::vector<Eigen::Vector2d> image;
  for (std::size_t i = 0; i < dots.size(); ++i) {
    if (!found[i] || (dots[i].centre_mm - dots[at].centre_mm).norm() > reach_mm) continue;
    sheet.push_back(dots[i].centre_mm);
    image.push_back(*found[i]);
  }
  return sheet.size() >= 6 ? homography_from_points(sheet, image) : std::nullopt;
}

void detect_ringed_dots(const cv::Mat& grey, ToneCurve tone, const Sheet& sheet, int index,
                        SheetDetection& out) {
  const std::vector<std::optional<Eigen::Vector2d>> found = find_ringed_dots(grey, sheet);
  if (found.empty()) {
    out.reason = "the four ringed dots were not found";
    return;
  }
  const std::vector<SheetDot> dots = sheet_geometry(sheet).dots;
  for (std::size_t i = 0; i < dots.size(); ++i) {
    if (!found[i]) continue;
    const auto homography = homography_around(dots, found, i, 2.3 * sheet.pitch_mm);
    if (!homography) continue;
    out.features.push_back(
        from_point(measure_dot(grey, tone, *homography, dots[i].centre_mm, 0.5 * dots[i].diameter_mm), index,
                   static_cast<int>(i)));
  }
}

// Markers of all sheets of one family.
void detect_family(const cv::Mat& grey, ToneCurve tone, const std::vector<Sheet>& sheets,
                   const std::string& family, SheetDetection& out) {
  std::map<int, std::pair<int, int>> places;  // id -> sheet, first point
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    if (sheets[s].family != family) continue;
    int first = 0;
    for (const SheetMarker& marker : sheet_geometry(sheets[s]).markers) {
      places[marker.id] = {static_cast<int>(s), first};
      first += 4;
    }
  }
  for (const MarkerObservation& marker :
       detect_markers(grey, tone, marker_family(family), {{}, rough_look()})) {
    out.markers.push_back({family, marker.id, marker.corners_px});
    const auto place = places.find(marker.id);
    if (place == places.end()) {
      if (marker.status == MarkerStatus::ok) out.foreign_ids.push_back(marker.id);
    } else {
      out.features.push_back(feature_of_marker(marker, place->second.first, place->second.second));
    }
  }
}

// Dots at the places that the sheets' own markers predict.
void add_predicted_dots(const cv::Mat& grey, ToneCurve tone, const std::vector<Sheet>& sheets,
                        SheetDetection& out) {
  SheetPhotograph alone;
  alone.features = out.features;
  const CalibrationState start = initial_state(sheets, {alone}, grey.cols, grey.rows, std::nullopt);
  if (start.views.empty()) return;
  const RobustFitResult fit = first_fit(sheets, start);
  if (!fit.adjustment.converged) return;
  for (const SheetView& view : fit.adjustment.state.views) {
    const Sheet& sheet = sheets[static_cast<std::size_t>(view.sheet)];
    if (sheet.kind != SheetKind::dots) continue;
    const PredictedSheet predicted(sheet, {}, fit.adjustment.state.camera, view.camera_from_sheet);
    measure_dots(grey, tone, predicted, view.sheet, out.features);
  }
}

// Inner corners of a ChArUco board wherever the markers that agree predict them. Corners beside a marker that
// was read are in view: where most of them are not found, the markers do not lie as the sheet says (another
// board, turned by half a turn, false reads), and the sheet's features are refused.
void add_charuco_saddles(const cv::Mat& grey, ToneCurve tone, const Sheet& sheet, int index,
                         SheetDetection& out) {
  constexpr double kBeside = 0.75;  // of the pitch: a marker's centre is half a diagonal, 0.71, away
  constexpr double kLeastFound = 0.5;
  std::vector<FeatureObservation> markers;
  for (const FeatureObservation& feature : out.features) {
    if (feature.sheet == index) markers.push_back(feature);
  }
  const SheetGeometry geometry = sheet_geometry(sheet);
  const SheetImage image(geometry, markers);
  const auto refuse = [&](std::string reason) {
    for (FeatureObservation& feature : out.features) {
      if (feature.sheet == index) feature.status = MarkerStatus::misfit;
    }
    out.reason = std::move(reason);
  };
  if (image.contradicted()) {
    refuse(
        fmt::format("its {} markers do not lie as the template says: check its kind, first_id and which "
                    "squares are white",
                    markers.size()));
    return;
  }
  if (!image.known()) return;
  std::erase_if(out.features, [index](const FeatureObservation& f) { return f.sheet == index; });
  for (std::size_t f = 0; f < markers.size(); ++f) {
    if (image.agrees()[f] != 0) out.features.push_back(markers[f]);
  }
  const SaddleDrawing drawing(sheet);
  const int first = 4 * static_cast<int>(geometry.markers.size());
  int beside = 0;
  int found = 0;
  for (std::size_t i = 0; i < geometry.saddles.size(); ++i) {
    const Eigen::Vector2d& at = geometry.saddles[i].position_mm;
    const auto homography = image.around(at);
    if (!homography) continue;
    const auto pixel = [&](const Eigen::Vector2d& mm) -> Eigen::Vector2d {
      return (*homography * mm.homogeneous()).hnormalized();
    };
    const Eigen::Vector2d px = pixel(at);
    const double reach = 0.1 * sheet.pitch_mm;  // the plane's map at the corner itself
    const Eigen::Vector2d to_x =
        5 * (pixel(at + Eigen::Vector2d(reach, 0)) - pixel(at - Eigen::Vector2d(reach, 0)));
    const Eigen::Vector2d to_y =
        5 * (pixel(at - Eigen::Vector2d(0, reach)) - pixel(at + Eigen::Vector2d(0, reach)));
    const PointObservation point =
        measure_saddle(grey, tone, drawing.guess(geometry.saddles[i], px, to_x, to_y));
    out.features.push_back(from_point(point, index, first + static_cast<int>(i)));
    if (!image.has_marker_within(kBeside * sheet.pitch_mm, at) || point.status == MarkerStatus::too_small ||
        point.status == MarkerStatus::cut_by_frame) {
      continue;
    }
    ++beside;
    if (point.status == MarkerStatus::ok) ++found;
  }
  if (found >= kLeastFound * beside) return;
  refuse(fmt::format(
      "{} of {} corners of the board beside its markers are not where the template says: check its kind, "
      "sizes, first_id and which squares are white",
      beside - found, beside));
}

bool usable(const FeatureObservation& feature) { return feature.status == MarkerStatus::ok; }

// A charuco's saddles are free of the edge bleed that moves its markers' corners: with enough of them the
// markers only identify.
bool saddles_suffice(const std::vector<Sheet>& sheets, int sheet,
                     const std::vector<FeatureObservation>& features) {
  return sheets[static_cast<std::size_t>(sheet)].kind == SheetKind::charuco &&
         std::count_if(features.begin(), features.end(), [sheet](const FeatureObservation& f) {
           return f.sheet == sheet && f.points() == 1 && usable(f);
         }) >= 6;
}

void prefer_saddles(const std::vector<Sheet>& sheets, std::vector<FeatureObservation>& features) {
  for (int s = 0; s < static_cast<int>(sheets.size()); ++s) {
    if (!saddles_suffice(sheets, s, features)) continue;
    std::erase_if(features, [s](const FeatureObservation& f) { return f.sheet == s && f.points() == 4; });
  }
}

// Where a marker was detected or, if it was not, where it is predicted; none if that is not wholly in the
// frame.
std::optional<MarkerGuess> guess_at(const MarkerPattern& pattern, const PredictedSheet& predicted,
                                    int first_point, const SheetView& view) {
  MarkerGuess guess{&pattern, {}};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto px = predicted.at(predicted.points_mm()[static_cast<std::size_t>(first_point) + i]);
    if (!px) return std::nullopt;
    guess.corners_px[i] = *px;
  }
  for (std::size_t f = 0; f < view.features.size(); ++f) {
    const FeatureObservation& found = view.features[f];
    if (found.first_point != first_point || found.points() != 4 || view.rejected[f] != 0) continue;
    guess.corners_px = marker_corners(found);
    guess.blur_px = found.blur_px;
  }
  return guess;
}

// Features with the markers at the guesses measured in place of those that were there.
SheetMeasurement with_markers(const cv::Mat& grey, const CameraModel& camera, const RefineOptions& options,
                              SheetMeasurement out) {
  RefinedMarkers refined = refine_markers(grey, out.processing, out.guesses, options, &camera);
  std::erase_if(out.features, [](const FeatureObservation& feature) { return feature.points() == 4; });
  for (std::size_t k = 0; k < refined.markers.size(); ++k) {
    out.features.push_back(feature_of_marker(refined.markers[k], out.places[k].first, out.places[k].second));
  }
  out.guesses = std::move(refined.guesses);
  out.processing = refined.processing;
  sort_features(out.features);
  return out;
}

}  // namespace

FeatureObservation feature_of_marker(const MarkerObservation& marker, int sheet, int first_point) {
  FeatureObservation feature;
  feature.sheet = sheet;
  feature.first_point = first_point;
  feature.status = marker.status;
  feature.px.resize(8);
  for (Eigen::Index i = 0; i < 4; ++i) {
    feature.px.segment<2>(2 * i) = marker.corners_px[static_cast<std::size_t>(i)];
  }
  feature.covariance_px2 = marker.covariance_px2;
  feature.blur_px = marker.blur_px;
  feature.chi2_per_dof = marker.chi2_per_dof;
  return feature;
}

std::array<Eigen::Vector2d, 4> marker_corners(const FeatureObservation& feature) {
  return {feature.px.segment<2>(0), feature.px.segment<2>(2), feature.px.segment<2>(4),
          feature.px.segment<2>(6)};
}

SheetDetection detect_sheets(const cv::Mat& grey, ToneCurve tone, const std::vector<Sheet>& sheets) {
  SheetDetection out;
  std::set<std::string> families;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    if (sheets[s].kind == SheetKind::chessboard)
      detect_chessboard(grey, tone, sheets[s], static_cast<int>(s), out);
    if (sheets[s].kind == SheetKind::photomodeler) {
      detect_ringed_dots(grey, tone, sheets[s], static_cast<int>(s), out);
    }
    if (!sheets[s].family.empty()) families.insert(sheets[s].family);
  }
  for (const std::string& family : families) detect_family(grey, tone, sheets, family, out);
  sort_features(out.features);
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    if (sheets[s].kind == SheetKind::charuco)
      add_charuco_saddles(grey, tone, sheets[s], static_cast<int>(s), out);
  }
  const bool dots = std::any_of(sheets.begin(), sheets.end(),
                                [](const Sheet& sheet) { return sheet.kind == SheetKind::dots; });
  if (dots) add_predicted_dots(grey, tone, sheets, out);
  prefer_saddles(sheets, out.features);
  sort_features(out.features);
  if (std::none_of(out.features.begin(), out.features.end(), usable) && out.reason.empty()) {
    out.reason = out.features.empty() ? "no sheet was found" : "no feature of the sheet can be measured";
  }
  return out;
}

SheetMeasurement measure_sheets(const cv::Mat& grey, ToneCurve tone, const std::vector<Sheet>& sheets,
                                const std::vector<SheetShape>& shapes, const CameraModel& camera,
                                const std::vector<SheetView>& views) {
  SheetMeasurement out;
  out.processing = ToneResponse(tone);
  for (const SheetView& view : views) {
    const Sheet& sheet = sheets[static_cast<std::size_t>(view.sheet)];
    const PredictedSheet predicted(sheet, shapes[static_cast<std::size_t>(view.sheet)], camera,
                                   view.camera_from_sheet);
    measure_saddles(grey, tone, predicted, view, sheet, out.features);
    measure_dots(grey, tone, predicted, view.sheet, out.features);
    if (saddles_suffice(sheets, view.sheet, out.features)) continue;
    const std::vector<SheetMarker>& markers = predicted.geometry().markers;
    for (std::size_t m = 0; m < markers.size(); ++m) {
      const int first_point = 4 * static_cast<int>(m);
      const auto guess =
          guess_at(marker_family(sheet.family).patterns[static_cast<std::size_t>(markers[m].id)], predicted,
                   first_point, view);
      if (!guess) continue;
      out.guesses.push_back(*guess);
      out.places.emplace_back(view.sheet, first_point);
    }
  }
  return with_markers(grey, camera, rough_look(), std::move(out));
}

SheetMeasurement with_markers_measured(const cv::Mat& grey, const CameraModel& camera,
                                       SheetMeasurement before) {
  return with_markers(grey, camera, {}, std::move(before));
}

}  // namespace hexcal
