#include "tools/synthetic/sheet_scene.h"

#include "tools/synthetic/grips.h"
#include "tools/synthetic/random_source.h"

namespace hexcal {
namespace {

Decal block(const Eigen::Vector2d& centre_mm, double size_mm, bool round, float albedo) {
  Decal decal;
  decal.top_left_mm = centre_mm + 0.5 * size_mm * Eigen::Vector2d(-1, 1);
  decal.cell_mm = {size_mm, size_mm};
  decal.round = round;
  decal.albedo = {albedo};
  return decal;
}

}  // namespace

Surface sheet_surface(const Sheet& sheet, const SheetPrint& print) {
  const SheetGeometry geometry = sheet_geometry(sheet);
  const Eigen::Vector2d half = 0.5 * geometry.extent_mm + print.margin_mm * Eigen::Vector2d::Ones();
  Surface surface;
  surface.outline_mm = rectangle_outline(half.x(), half.y());
  surface.albedo = kPaperAlbedo;
  surface.print_scale = print.scale;
  if (print.warp_mm != Eigen::Vector2d::Zero()) {
    surface.warp = SheetWarp{print.warp_mm, 0.5 * geometry.extent_mm};
  }
  for (const SheetSquare& square : geometry.squares) {
    surface.decals.push_back(block(square.centre_mm, square.size_mm, false, kInkAlbedo));
  }
  for (const SheetDot& dot : geometry.dots) {
    surface.decals.push_back(block(dot.centre_mm, dot.diameter_mm, true, kInkAlbedo));
  }
  for (const SheetMarker& marker : geometry.markers) {
    surface.decals.push_back(marker_decal(sheet.family, marker.id, marker.size_mm, marker.centre_mm));
  }
  return surface;
}

Scene sheet_scene(const Sheet& sheet, const SheetPrint& print, std::uint64_t seed) {
  Scene scene;
  scene.lamp.towards = {0.3, 0.4, 0.85};
  scene.lamp.ambient = 0.40;
  scene.lamp.strength = 0.60;
  scene.lamp.gradient_per_mm = {4e-4, -3e-4, 0};
  scene.surfaces.push_back(sheet_surface(sheet, print));
  Surface table;
  table.world_from_surface = Rigid3::from_translation({0, 0, -12});
  table.outline_mm = rectangle_outline(4000, 4000);
  table.albedo = 0.24F;
  table.tint = {1.08F, 1.0F, 0.86F};
  table.grain = 0.4F;
  table.grain_mm = 0.8;
  table.background = true;
  RandomSource random(seed, 4);
  for (int i = 0; i < 40; ++i) {
    table.decals.push_back(block({random.uniform(-700, 700), random.uniform(-600, 600)},
                                 random.uniform(15, 120), i % 3 == 0,
                                 static_cast<float>(random.uniform(0.05, 0.6))));
  }
  scene.surfaces.push_back(table);
  return scene;
}

}  // namespace hexcal
