#include "camera_calib/camera_advice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "camera_calib/marker_size.h"
#include "camera_calib/printed_marker.h"

namespace hexcal {
namespace {

// What a technician can reach with a printed sheet, and what still serves; px unless said otherwise.
constexpr double kGoodNoise = 0.1;
constexpr double kUsableNoise = 0.5;
constexpr double kGoodCorner = 0.1;
constexpr double kUsableCorner = 0.5;
constexpr double kBlurred = 1.6;
constexpr double kFrontalDeg = 10;
constexpr double kSmallSizeError = 0.002;  // of a tag's size for its spacing
constexpr double kInkSizeError = 0.01;     // ink spreads by some 0.05 mm at each edge of a tag
constexpr double kDisagreeing = 3;         // times their noise

class Advisor {
 public:
  Advisor(const std::vector<Sheet>& sheets, const CameraCalibration& calibration, const CameraReport& report)
      : sheets_(sheets), calibration_(calibration), report_(report) {}

  std::vector<Advice> all() {
    if (calibration_.status != CalibrationStatus::ok) {
      add(AdviceLevel::retake, calibration_.reason);
      blur();
      return out_;
    }
    numbers();
    tilt();
    coverage();
    blur();
    photographs();
    fit();
    sheets();
    ambiguity();
    uncertainty();
    std::stable_sort(out_.begin(), out_.end(),
                     [](const Advice& a, const Advice& b) { return a.level > b.level; });
    return out_;
  }

 private:
  void add(AdviceLevel level, std::string words) { out_.push_back({level, std::move(words)}); }

  void numbers() {
    const int used = report_.quality.photographs;
    if (used < 6) {
      add(AdviceLevel::retake, fmt::format("only {} photographs show the sheet: take 10 to 20", used));
    } else if (used < 9) {
      add(AdviceLevel::usable,
          fmt::format("{} photographs are few: 10 to 20 give a camera one can check", used));
    }
  }

  void tilt() {
    double largest = 0;
    double nearest = std::numeric_limits<double>::infinity();
    double farthest = 0;
    for (const PhotographRow& row : report_.photographs) {
      if (!row.used) continue;
      largest = std::max(largest, row.tilt_deg);
      nearest = std::min(nearest, row.distance_mm);
      farthest = std::max(farthest, row.distance_mm);
    }
    if (largest < kFrontalDeg) {
      add(AdviceLevel::retake,
          fmt::format("all photographs are within {:.0f} degrees of frontal, so that the focal "
                      "length is hardly determined: tilt the sheet 20 to 40 degrees",
                      std::ceil(largest)));
    } else if (largest < 20) {
      add(AdviceLevel::usable,
          fmt::format("no photograph is tilted more than {:.0f} degrees: tilt the sheet 20 to 40 degrees",
                      largest));
    }
  }

  void coverage() {
    static constexpr const char* kRows[] = {"top", "upper", "middle", "lower", "bottom"};
    static constexpr const char* kColumns[] = {"left edge", "left half", "centre", "right half",
                                               "right edge"};
    std::vector<std::string> empty;
    bool corner = false;
    for (int row = 0; row < Coverage::kSide; ++row) {
      for (int column = 0; column < Coverage::kSide; ++column) {
        if (report_.coverage.points[static_cast<std::size_t>(row * Coverage::kSide + column)] >= 4) continue;
        empty.push_back(fmt::format("{} {}", kRows[row], kColumns[column]));
        corner = corner || ((row == 0 || row == 4) && (column == 0 || column == 4));
      }
    }
    if (empty.empty()) return;
    const std::size_t shown = std::min<std::size_t>(empty.size(), 4);
    const std::string list =
        fmt::format("{}{}", fmt::join(empty.begin(), empty.begin() + static_cast<int>(shown), ", "),
                    empty.size() > shown ? fmt::format(" and {} more", empty.size() - shown) : "");
    const bool many = empty.size() > Coverage::kSide * Coverage::kSide / 2;
    add(many ? AdviceLevel::retake : AdviceLevel::usable,
        fmt::format(
            "no points in {} of 25 parts of the frame ({}): add two photographs with the sheet there{}",
            empty.size(), list, corner ? "; the lens bends most in the corners" : ""));
  }

  void blur() {
    std::vector<double> all;
    for (const PhotographRow& row : report_.photographs) {
      if (row.blur_px > 0) all.push_back(row.blur_px);
    }
    if (all.empty()) return;
    std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end());
    const double usual = all[all.size() / 2];
    if (usual > kBlurred) {
      add(AdviceLevel::usable,
          fmt::format("all photographs are blurred (usually {:.1f} px): focus on the sheet, stop "
                      "down, use a tripod",
                      usual));
    }
    for (const PhotographRow& row : report_.photographs) {
      if (row.blur_px > std::max(kBlurred, 1.5 * usual)) {
        add(AdviceLevel::note,
            fmt::format("{} is blurred ({:.1f} px): take it again", row.name, row.blur_px));
      }
    }
  }

  void photographs() {
    for (const PhotographRow& row : report_.photographs) {
      if (row.status != "ok") add(AdviceLevel::note, fmt::format("{}: {}", row.name, row.status));
    }
  }

  void fit() {
    const double noise = calibration_.fit.extra_sigma_px;
    if (noise > kGoodNoise) {
      add(noise > kUsableNoise ? AdviceLevel::retake : AdviceLevel::usable,
          fmt::format(
              "{:.2f} px per coordinate stay unexplained by any lens model and sheet shape that was tried "
              "({}): is the sheet flat and fixed, the lens untouched, the template the right one?",
              noise,
              calibration_.variant.board == BoardFreedom::points ? "printed points were free"
                                                                 : "printed points were not free"));
    }
    const SharedErrorFactors& shared = calibration_.fit.adjustment.shared_errors;
    if (shared.photographs > kDisagreeing && shared.photographs == shared.largest()) {
      add(AdviceLevel::usable,
          fmt::format("the photographs disagree about the camera {:.0f} times more than their noise, and the "
                      "sigmas are widened by it: focus, zoom or the sheet changed between them",
                      shared.photographs));
    }
    int rejected = 0;
    for (const PhotographRow& row : report_.photographs) rejected += row.rejected;
    if (rejected > 0.1 * report_.quality.points) {
      add(AdviceLevel::usable,
          fmt::format("{} of {} points are outliers", rejected, rejected + report_.quality.points));
    }
  }

  void sheets() {
    for (std::size_t s = 0; s < sheets_.size(); ++s) {
      const SheetShape& shape = calibration_.fit.adjustment.state.shapes[s];
      const std::string which = sheets_.size() > 1 ? fmt::format("sheet {}", s + 1) : "the sheet";
      shape_words(sheets_[s], shape, which);
      if (const auto size = marker_size_error(sheets_[s], static_cast<int>(s), calibration_.fit.adjustment)) {
        if (std::abs(size->relative) > kSmallSizeError && std::abs(size->relative) > 5 * size->sigma) {
          size_words(sheets_[s], size->relative, which);
        }
      }
    }
  }

  // Beyond what ink does to an edge it is a number of the description that is wrong, and which distances are
  // the right ones, and so the camera's focal length and the sheet's shape, is not known.
  void size_words(const Sheet& sheet, double relative, const std::string& which) {
    const bool wrong_number = std::abs(relative) > kInkSizeError;
    std::string instruction = "measure tag size and gap on the print";
    if (wrong_number && sheet.spacing_mm > 0) {
      const double printed = printed_marker_mm(sheet);
      instruction = fmt::format(
          "with tags of {:g} mm the gap is {:.2f} mm, sheet.yaml says {:g}; measure both on the print and "
          "write "
          "them into it",
          sheet.marker_mm, (printed + sheet.spacing_mm) / (1 + relative) - printed, sheet.spacing_mm);
    } else if (wrong_number) {
      instruction = fmt::format(
          "sheet.yaml says {:g} mm, {:.2f} mm fits the pitch; measure both on the print and "
          "write them into it",
          sheet.marker_mm, sheet.marker_mm * (1 + relative));
    }
    add(wrong_number ? AdviceLevel::retake : AdviceLevel::usable,
        fmt::format("the tags of {} are {:.2f} % {} for their spacing than the template says: {}", which,
                    100 * std::abs(relative), relative > 0 ? "larger" : "smaller", instruction));
  }

  void ambiguity() {
    for (const Sheet& sheet : sheets_) {
      if (sheet.kind != SheetKind::chessboard || (sheet.columns + sheet.rows) % 2 != 0) continue;
      add(AdviceLevel::note,
          fmt::format(
              "a chessboard of {} x {} squares looks the same upside down: the camera is right, but a pose "
              "of --poses may be turned by 180 degrees; one odd and one even number are not ambiguous",
              sheet.columns, sheet.rows));
    }
  }

  void shape_words(const Sheet& sheet, const SheetShape& shape, const std::string& which) {
    double lowest = 0;
    double highest = 0;
    const std::vector<SheetPoint> drawn = sheet_points(sheet_geometry(sheet));
    const std::vector<Eigen::Vector3d> real = shaped_points(sheet, shape);
    double stretch = shape.deformation[0];
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < real.size(); ++i) {
      lowest = std::min(lowest, real[i].z());
      highest = std::max(highest, real[i].z());
      const Eigen::Vector2d xy = drawn[i].position_mm.head<2>();
      const Eigen::Vector2d shift = real[i].head<2>() - xy;
      normal.diagonal() += xy.cwiseAbs2();
      right += xy.cwiseProduct(shift);
    }
    if (!shape.shift_mm.empty()) stretch = right.x() / normal(0, 0) - right.y() / normal(1, 1);
    const double bend = highest - lowest;
    if (bend > 0.1) {
      add(bend > 5 ? AdviceLevel::usable : AdviceLevel::note,
          fmt::format(
              "{} is out of flatness by {:.1f} mm; the camera was freed of it, but glue the sheet to a plate",
              which, bend));
    }
    if (std::abs(stretch) > 5e-4) {
      add(AdviceLevel::note, fmt::format("{} is printed {:.2f} % too long in {}; the camera was freed of it",
                                         which, 100 * std::abs(stretch), stretch > 0 ? "x" : "y"));
    }
  }

  void uncertainty() {
    const CameraQuality& quality = report_.quality;
    if (const int none = report_.uncertainty.unknown(); none > 0) {
      add(AdviceLevel::retake,
          fmt::format("in {:.0f} % of the frame the lens is not known at all, as no point of the sheet came "
                      "near: more "
                      "photographs with the sheet there",
                      100.0 * none / static_cast<double>(report_.uncertainty.px.size())));
    } else if (quality.uncertainty_corner_px > kGoodCorner) {
      add(quality.uncertainty_corner_px > kUsableCorner ? AdviceLevel::retake : AdviceLevel::usable,
          fmt::format(
              "projection is uncertain by {:.2f} px in a corner of the frame ({:.3f} px in its centre): more "
              "photographs, nearer, with the sheet in the corners",
              quality.uncertainty_corner_px, quality.uncertainty_centre_px));
    }
    if (report_.halves && report_.halves->rms_px > std::max(0.1, 4 * quality.uncertainty_corner_px)) {
      add(AdviceLevel::usable,
          fmt::format("two halves of the photographs give cameras that differ by {:.2f} px rms, more than "
                      "their noise "
                      "explains: something changed between the photographs, or no model fits",
                      report_.halves->rms_px));
    }
  }

  const std::vector<Sheet>& sheets_;
  const CameraCalibration& calibration_;
  const CameraReport& report_;
  std::vector<Advice> out_;
};

}  // namespace

std::vector<Advice> camera_advice(const std::vector<Sheet>& sheets, const CameraCalibration& calibration,
                                  const CameraReport& report) {
  return Advisor(sheets, calibration, report).all();
}

}  // namespace hexcal
