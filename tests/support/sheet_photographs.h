#pragma once

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "camera_calib/sheet.h"
#include "kinematics/geometry/rigid3.h"
#include "photogrammetry/camera/camera_model.h"
#include "photogrammetry/markers/marker.h"

namespace hexcal {

/// How photographs of a printed sheet are drawn: by a pinhole without a lens, flat paper in even light.
struct SheetLight {
  double white = 0.7, black = 0.04;  ///< light; above 1 the sensor clips
  double blur_px = 0.6;
  double noise = 1.0;  ///< of encoded 8-bit values
};

constexpr double kDrawnPxPerMm = 16;
constexpr double kPaperMarginMm = 10;

/// White paper with a margin around the pattern; edges of markers that are multiples of 1/16 mm are exact.
[[nodiscard]] inline cv::Mat drawn_sheet(const Sheet& sheet) {
  const SheetGeometry geometry = sheet_geometry(sheet);
  const Eigen::Vector2d top_left_mm(-0.5 * geometry.extent_mm.x() - kPaperMarginMm,
                                    0.5 * geometry.extent_mm.y() + kPaperMarginMm);
  const Eigen::Vector2d size = -2 * kDrawnPxPerMm * top_left_mm;
  cv::Mat ink(cvRound(-size.y()), cvRound(size.x()), CV_8UC1, cv::Scalar(255));
  const auto from_top_left_px = [&](const Eigen::Vector2d& mm) -> Eigen::Vector2d {
    return kDrawnPxPerMm * (mm - top_left_mm).cwiseProduct(Eigen::Vector2d(1, -1));
  };
  const auto block = [&](const Eigen::Vector2d& top_left, double edge) {
    const Eigen::Vector2d from = from_top_left_px(top_left);
    const Eigen::Vector2d to = from_top_left_px(top_left + Eigen::Vector2d(edge, -edge));
    ink(cv::Rect(cv::Point(cvRound(from.x()), cvRound(from.y())),
                 cv::Point(cvRound(to.x()), cvRound(to.y()))))
        .setTo(0);
  };
  const auto fill = [&](const std::vector<cv::Point>& outline) {
    // In 64ths of a pixel.
    cv::fillPoly(ink, std::vector<std::vector<cv::Point>>{outline}, cv::Scalar(0), cv::LINE_AA, 6);
  };
  for (const SheetSquare& square : geometry.squares)
    block(square.centre_mm + 0.5 * square.size_mm * Eigen::Vector2d(-1, 1), square.size_mm);
  for (const SheetMarker& marker : geometry.markers) {
    const MarkerPattern& pattern = marker_family(sheet.family).patterns[static_cast<std::size_t>(marker.id)];
    const double cell = marker.size_mm / pattern.square_cells;
    const Eigen::Vector2d top_left = marker.centre_mm + 0.5 * pattern.cells * cell * Eigen::Vector2d(-1, 1);
    for (int i = 0; i < pattern.cells * pattern.cells; ++i) {
      if (pattern.white[static_cast<std::size_t>(i)] != 0) continue;
      block(top_left + cell * Eigen::Vector2d(i % pattern.cells, -(i / pattern.cells)), cell);
    }
  }
  for (const SheetDot& dot : geometry.dots) {
    const auto arc = [&](double radius, double begin, double end) {
      std::vector<cv::Point> points;
      for (int i = 0; i <= 90; ++i) {
        const double angle = begin + (end - begin) * i / 90;
        const Eigen::Vector2d rim = radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
        const Eigen::Vector2d px = from_top_left_px(dot.centre_mm + rim) - Eigen::Vector2d(0.5, 0.5);
        points.emplace_back(cvRound(64 * px.x()), cvRound(64 * px.y()));
      }
      return points;
    };
    fill(arc(0.5 * dot.diameter_mm, 0, 2 * CV_PI));
    for (int i = 0; i < dot.ring_arcs; ++i) {
      const double begin = 2 * CV_PI * i / dot.ring_arcs;
      const double end = begin + CV_PI / dot.ring_arcs;
      std::vector<cv::Point> outline = arc(kRingOuter * dot.diameter_mm, begin, end);
      const std::vector<cv::Point> inner = arc(kRingInner * dot.diameter_mm, end, begin);
      outline.insert(outline.end(), inner.begin(), inner.end());
      fill(outline);
    }
  }
  return ink;
}

/// A photograph (8 bit, sRGB) of `sheet` by a pinhole; the paper goes on beyond the pattern.
[[nodiscard]] inline cv::Mat sheet_photograph(const Sheet& sheet, const CameraModel& pinhole,
                                              const Rigid3& camera_from_sheet, const SheetLight& light = {},
                                              int seed = 1) {
  constexpr int kFine = 3;
  const Eigen::Vector2d half_mm = 0.5 * sheet_geometry(sheet).extent_mm.array() + kPaperMarginMm;
  constexpr double kMmPerPx = 1 / kDrawnPxPerMm;
  Eigen::Matrix3d mm_from_drawn;
  mm_from_drawn << kMmPerPx, 0, 0.5 * kMmPerPx - half_mm.x(), 0, -kMmPerPx, half_mm.y() - 0.5 * kMmPerPx, 0,
      0, 1;
  Eigen::Matrix3d camera_from_mm = camera_from_sheet.rotation.toRotationMatrix();
  camera_from_mm.col(2) = camera_from_sheet.translation;
  Eigen::Matrix3d k;
  k << pinhole.fx_px(), 0, pinhole.cx_px(), 0, pinhole.fy_px(), pinhole.cy_px(), 0, 0, 1;
  Eigen::Matrix3d fine;
  fine << kFine, 0, 0.5 * (kFine - 1), 0, kFine, 0.5 * (kFine - 1), 0, 0, 1;
  cv::Mat map;
  cv::eigen2cv(Eigen::Matrix3d(fine * k * camera_from_mm * mm_from_drawn), map);
  cv::Mat paper;
  cv::warpPerspective(drawn_sheet(sheet), paper, map, {kFine * pinhole.width_px, kFine * pinhole.height_px},
                      cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(255));
  cv::GaussianBlur(paper, paper, {}, kFine * light.blur_px);
  cv::Mat share;
  cv::resize(paper, share, {pinhole.width_px, pinhole.height_px}, 0, 0, cv::INTER_AREA);
  cv::Mat noise(share.size(), CV_32F);
  cv::RNG(static_cast<std::uint64_t>(seed)).fill(noise, cv::RNG::NORMAL, 0, light.noise);
  cv::Mat grey(share.size(), CV_8UC1);
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      const double value = light.black + (light.white - light.black) * share.at<std::uint8_t>(y, x) / 255;
      const double srgb = 1.055 * std::pow(value, 1 / 2.4) - 0.055;  // beyond the darkest part
      grey.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(255 * srgb + noise.at<float>(y, x));
    }
  }
  return grey;
}

}  // namespace hexcal
