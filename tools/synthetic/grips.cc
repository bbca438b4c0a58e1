#include "tools/synthetic/grips.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/markers/marker.h"
#include "tools/synthetic/random_source.h"

namespace hexcal {
namespace {

constexpr int kSides = 12;
constexpr int kFacing = 5;          // sides that face the camera
constexpr double kRowPitchMm = 32;  // at 24 mm markers
constexpr double kStickerHeightMm = 0.12;

struct Material {
  float albedo;
  std::array<float, 3> tint{1, 1, 1};
  float grain = 0.05F;
  double grain_mm = 0.25;
};

constexpr Material kGripSteel{0.10F};
constexpr Material kLightSteel{0.33F, {0.98F, 1.0F, 1.03F}, 0.12F, 0.4};
constexpr Material kLegSteel{0.42F, {1.0F, 1.0F, 1.02F}, 0.15F, 0.3};

Surface plain_surface(const Rigid3& pose, const std::vector<Eigen::Vector2d>& outline,
                      const Material& material) {
  Surface surface;
  surface.world_from_surface = pose;
  surface.outline_mm = outline;
  surface.albedo = material.albedo;
  surface.tint = material.tint;
  surface.grain = material.grain;
  surface.grain_mm = material.grain_mm;
  surface.background = true;
  return surface;
}

// Frame on the side of a prism about z: normal outwards at `angle`, y up.
Rigid3 side_frame(double angle, double apothem_mm, double z_mm) {
  const Eigen::Vector3d normal(std::cos(angle), std::sin(angle), 0);
  Eigen::Matrix3d r;
  r.col(0) = Eigen::Vector3d::UnitZ().cross(normal);
  r.col(1) = Eigen::Vector3d::UnitZ();
  r.col(2) = normal;
  return {r, apothem_mm * normal + z_mm * Eigen::Vector3d::UnitZ()};
}

// A regular prism about the z axis of `pose`.
void add_prism(std::vector<Surface>& surfaces, const Rigid3& pose, int sides, double apothem_mm,
               double z_low_mm, double z_high_mm, const Material& material) {
  const double half_width = apothem_mm * std::tan(std::numbers::pi / sides);
  const double half_height = 0.5 * (z_high_mm - z_low_mm);
  std::vector<Eigen::Vector2d> cap;
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    surfaces.push_back(plain_surface(pose * side_frame(angle, apothem_mm, 0.5 * (z_low_mm + z_high_mm)),
                                     rectangle_outline(half_width, half_height), material));
    const double edge = angle + std::numbers::pi / sides;
    cap.push_back(apothem_mm / std::cos(std::numbers::pi / sides) *
                  Eigen::Vector2d(std::cos(edge), std::sin(edge)));
  }
  surfaces.push_back(plain_surface(pose * Rigid3::from_translation({0, 0, z_high_mm}), cap, material));
  const Rigid3 upside_down(quaternion_from_rotation_vector({std::numbers::pi, 0, 0}), {0, 0, z_low_mm});
  surfaces.push_back(plain_surface(pose * upside_down, cap, material));
}

// A room behind the rig: a wall full of things that are not markers, and a floor.
void add_room(std::vector<Surface>& surfaces, RandomSource& random) {
  Eigen::Matrix3d facing;  // normal along +x, y up
  facing << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  Surface wall = plain_surface({facing, {-650, 0, 0}}, rectangle_outline(2500, 1500),
                               {0.30F, {1.05F, 1.0F, 0.90F}, 0.35F, 1.3});
  for (int i = 0; i < 260; ++i) {
    Decal decal;
    decal.top_left_mm = {random.uniform(-900, 900), random.uniform(-700, 800)};
    const int kind = i % 4;
    decal.columns = kind == 0 ? 1 : static_cast<int>(random.uniform(2, 9));
    decal.rows = kind == 1 ? 1 : (kind == 0 ? 1 : static_cast<int>(random.uniform(2, 9)));
    const double cell = kind == 0 ? random.uniform(20, 160) : random.uniform(2, 14);
    decal.cell_mm = {cell, cell * random.uniform(0.4, 1.6)};
    decal.round = kind == 0 && random.uniform(0, 1) < 0.4;
    for (int k = 0; k < decal.columns * decal.rows; ++k) {
      decal.albedo.push_back(static_cast<float>(random.uniform(0, 1) < 0.5 ? random.uniform(0.03, 0.12)
                                                                           : random.uniform(0.2, 0.75)));
    }
    wall.decals.push_back(decal);
  }
  surfaces.push_back(wall);
  surfaces.push_back(plain_surface(Rigid3::from_translation({0, 0, -620}), rectangle_outline(3000, 3000),
                                   {0.16F, {1.0F, 0.97F, 0.92F}, 0.5F, 2.1}));
}

double sticker_side_mm(const MarkerPattern& pattern, double size_mm) {
  return std::max<double>(pattern.cells, pattern.square_cells + 2) * size_mm / pattern.square_cells;
}

const MarkerPattern& pattern_of(const std::string& family_name, int id) {
  const MarkerFamily& family = marker_family(family_name);
  if (id < 0 || static_cast<std::size_t>(id) >= family.patterns.size()) {
    throw InputError(fmt::format("marker family {} has ids 0 to {}, wanted {}", family_name,
                                 family.patterns.size() - 1, id));
  }
  return family.patterns[static_cast<std::size_t>(id)];
}

}  // namespace

Eigen::Vector3d Sticker::corner_in_body(int corner) const {
  const double half = 0.5 * size_mm;
  return body_from_marker *
         Eigen::Vector3d(corner == 1 || corner == 2 ? half : -half, corner < 2 ? half : -half, 0);
}

Decal marker_decal(const std::string& family, int id, double size_mm, const Eigen::Vector2d& centre_mm) {
  const MarkerPattern& pattern = pattern_of(family, id);
  const double cell = size_mm / pattern.square_cells;
  const double half = 0.5 * pattern.cells * cell;
  Decal decal;
  decal.top_left_mm = centre_mm + Eigen::Vector2d(-half, half);
  decal.cell_mm = {cell, cell};
  decal.columns = decal.rows = pattern.cells;
  for (const std::uint8_t white : pattern.white)
    decal.albedo.push_back(white != 0 ? kPaperAlbedo : kInkAlbedo);
  return decal;
}

Surface sticker_surface(const std::string& family, const Sticker& sticker) {
  const double half = 0.5 * sticker_side_mm(pattern_of(family, sticker.id), sticker.size_mm);
  Surface surface;
  surface.world_from_surface = sticker.body_from_marker;
  surface.outline_mm = rectangle_outline(half, half);
  surface.albedo = kPaperAlbedo;
  surface.decals = {marker_decal(family, sticker.id, sticker.size_mm, {0, 0})};
  return surface;
}

Rig make_rig(std::uint64_t seed, const MarkerLayout& layout, const PlatformGeometry& geometry) {
  Rig rig;
  rig.family = layout.family;
  rig.geometry = geometry;
  RandomSource random(seed, 3);
  const double side_mm = sticker_side_mm(pattern_of(layout.family, 0), layout.size_mm);
  const double apothem = 0.5 * (side_mm + 3) / std::tan(std::numbers::pi / kSides);
  const double row_pitch = side_mm + kRowPitchMm - 30;
  for (const bool moving : {false, true}) {
    for (int i = 0; i < 2 * kFacing; ++i) {
      const double angle = (i % kFacing - (kFacing - 1) / 2) * 2 * std::numbers::pi / kSides;
      const double depth = row_pitch * (i / kFacing + 0.5) + 1.5;  // from the end plate
      const double angle_sigma = layout.angle_sigma_deg * kRadPerDeg;
      const Eigen::Vector3d turn(0.1 * angle_sigma * random.normal(), 0.1 * angle_sigma * random.normal(),
                                 angle_sigma * random.normal());
      const Eigen::Vector3d shift(layout.position_sigma_mm * random.normal(),
                                  layout.position_sigma_mm * random.normal(), kStickerHeightMm);
      Sticker sticker;
      sticker.id = (moving ? layout.first_moving_id : layout.first_fixed_id) + i;
      sticker.moving = moving;
      sticker.size_mm = layout.size_mm;
      sticker.body_from_marker = side_frame(angle, apothem, moving ? -depth : depth) *
                                 Rigid3(quaternion_from_rotation_vector(turn), shift);
      rig.stickers.push_back(sticker);
    }
  }
  const double height = 2 * row_pitch + 3;
  const Rigid3 here;
  add_prism(rig.fixed, here, kSides, apothem, 0, height, kGripSteel);
  add_prism(rig.fixed, here, 8, 30, height, 900, kLightSteel);
  add_room(rig.fixed, random);
  const double platform_z = -geometry.P_from_LG.translation.z();
  const double joint_radius = geometry.platform_joints_mm[0].norm();
  add_prism(rig.moving, here, kSides, apothem, -height, 0, kGripSteel);
  add_prism(rig.moving, here, kSides, apothem - 6, platform_z - 18, -height, kLightSteel);
  add_prism(rig.moving, here, kSides, joint_radius + 15, platform_z - 34, platform_z - 18, kLightSteel);
  return rig;
}

Scene rig_scene(const Rig& rig, const Rigid3& UG_from_LG) {
  Scene scene;
  scene.lamp.towards = {0.78, -0.25, 0.42};
  scene.lamp.ambient = 0.42;
  scene.lamp.strength = 0.62;
  scene.lamp.gradient_per_mm = {1e-4, -3.5e-4, 3e-4};
  for (const Sticker& sticker : rig.stickers) {
    scene.surfaces.push_back(sticker_surface(rig.family, sticker));
    if (sticker.moving) {
      Rigid3& pose = scene.surfaces.back().world_from_surface;
      pose = UG_from_LG * pose;
    }
  }
  scene.surfaces.insert(scene.surfaces.end(), rig.fixed.begin(), rig.fixed.end());
  for (Surface surface : rig.moving) {
    surface.world_from_surface = UG_from_LG * surface.world_from_surface;
    scene.surfaces.push_back(surface);
  }
  const Rigid3 UG_from_B = inverse(rig.geometry.B_from_UG);
  const Rigid3 LG_from_P = inverse(rig.geometry.P_from_LG);
  for (std::size_t i = 0; i < 6; ++i) {
    const Eigen::Vector3d foot = UG_from_B * rig.geometry.base_joints_mm[i];
    const Eigen::Vector3d head = UG_from_LG * (LG_from_P * rig.geometry.platform_joints_mm[i]);
    const Eigen::Vector3d way = head - foot;
    const auto turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), way);
    add_prism(scene.surfaces, {turn, foot}, 6, 9, 0.45 * way.norm(), way.norm() - 30, kLegSteel);
    add_prism(scene.surfaces, {turn, foot}, 6, 16, 0, 0.5 * way.norm(), kLightSteel);
  }
  return scene;
}

}  // namespace hexcal
