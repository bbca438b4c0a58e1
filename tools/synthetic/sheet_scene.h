#pragma once

#include "camera_calib/sheet.h"
#include "tools/synthetic/render.h"

namespace hexcal {

/// How a printed sheet differs from its drawing.
struct SheetPrint {
  Eigen::Vector2d scale{1, 1};                        ///< longer by this factor in x and y
  Eigen::Vector2d warp_mm = Eigen::Vector2d::Zero();  ///< SheetWarp's heights over the pattern's extent
  double margin_mm = 20;                              ///< white paper around the pattern
};

/// A printed sheet; its frame is that of SheetGeometry.
[[nodiscard]] Surface sheet_surface(const Sheet& sheet, const SheetPrint& print);

/// The sheet (world = sheet frame) on a table with clutter.
[[nodiscard]] Scene sheet_scene(const Sheet& sheet, const SheetPrint& print, std::uint64_t seed);

}  // namespace hexcal
