#pragma once

#include <cairo.h>

#include "camera_calib/sheet.h"

namespace hexcal {

/// Draws the pattern of a sheet in black with its ids. User space: mm, origin at the pattern's centre, y
/// down.
void draw_sheet(cairo_t* cr, const Sheet& sheet);

/// A line of 100 mm with ticks every 10 mm, from (x, y) to the right or, if vertical, downwards.
void draw_check_ruler(cairo_t* cr, double x_mm, double y_mm, bool vertical);

/// Small sans-serif text whose baseline begins at (x, y).
void draw_text(cairo_t* cr, double x_mm, double y_mm, double height_mm, const std::string& text);

}  // namespace hexcal
