#include "tools/synthetic/simulation.h"

#include <fmt/format.h>

#include "kinematics/geometry/input_error.h"
#include "tools/synthetic/camera_body.h"
#include "tools/synthetic/lens_effects.h"
#include "tools/synthetic/random_source.h"
#include "tools/synthetic/stations.h"

namespace hexcal {
namespace {

// Streams of the seed (random_source.h); 1 to 4 are the machine's, targets', rig's and sheet table's.
constexpr std::uint64_t kCameraStream = 10;
constexpr std::uint64_t kStationStream = 11;
constexpr std::uint64_t kShotStream = 12;
constexpr std::uint64_t kTrembleStream = 13;

template <typename Number>
void check_range(const char* name, Number value, Number low, Number high) {
  if (!(value >= low && value <= high)) {
    throw InputError(fmt::format("{} is {}, wanted {} to {}", name, value, low, high));
  }
}

// A stream per round and pose, so that poses can be left out without changing the others' photographs.
std::uint64_t named_stream(std::uint64_t stream, std::uint64_t round, const std::string& name) {
  std::uint64_t key = mixed_bits(stream * 1000 + round);
  for (const char c : name) key = mixed_bits(key ^ static_cast<std::uint8_t>(c));
  return key;
}

Shot new_shot(const VirtualLaboratory& laboratory, RandomSource& random, const Rigid3& camera_from_world,
              int number) {
  Shot shot;
  shot.file = fmt::format("DSC_{:04d}.jpg", number);
  shot.camera_from_world = camera_from_world;
  shot.blur_px = random.uniform(laboratory.options.blur_min_px, laboratory.options.blur_max_px);
  shot.exposure = random.uniform(0.92, 1.08);
  shot.seed = random.bits();
  shot.tags.focal_mm = laboratory.options.focal_mm;
  if (laboratory.options.effects.lens.f_number > 0)
    shot.tags.f_number = laboratory.options.effects.lens.f_number;
  shot.tags.capture_time = capture_time(9 * number);
  return shot;
}

// Turns and moves the platform about LG's origin. A stream of its own leaves all other draws as they are.
Rigid3 trembled(const Rigid3& UG_from_LG, const PlatformEffects& effects, std::uint64_t shot_seed) {
  if (effects == PlatformEffects{}) return UG_from_LG;
  RandomSource random(shot_seed, kTrembleStream);
  Eigen::Vector3d shift_mm;
  Eigen::Vector3d turn_rad;
  for (Eigen::Index i = 0; i < 3; ++i) shift_mm[i] = effects.tremble_mm * random.normal();
  for (Eigen::Index i = 0; i < 3; ++i) turn_rad[i] = 1e-3 * effects.tremble_mrad * random.normal();
  return UG_from_LG * Rigid3(quaternion_from_rotation_vector(turn_rad), shift_mm);
}

// What was printed comes first in a scene: the sheet or the stickers.
std::size_t printed_surfaces(const VirtualLaboratory& laboratory, const Shot& shot) {
  return shot.pose.empty() ? 1 : laboratory.rig.stickers.size();
}

// Mean distance along the camera's axis of the prints that face it.
double prints_distance_mm(const Scene& scene, std::size_t count, const Rigid3& camera_from_world) {
  double sum = 0;
  int facing = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Rigid3 pose = camera_from_world * scene.surfaces[i].world_from_surface;
    if (pose.translation.dot(pose.rotation * Eigen::Vector3d::UnitZ()) >= 0) continue;
    sum += pose.translation.z();
    ++facing;
  }
  return facing > 0 ? sum / facing : 1000;
}

void print_on_paper(Scene& scene, std::size_t count, const PrintEffects& effects) {
  for (std::size_t i = 0; i < count; ++i) {
    scene.surfaces[i].ink_spread_mm = effects.ink_spread_mm;
    scene.surfaces[i].gloss = static_cast<float>(effects.sticker_gloss);
  }
}

}  // namespace

SimulationOptions::SimulationOptions() {
  sheet.kind = SheetKind::aprilgrid;
  sheet.family = "tag36h11";
  sheet.columns = 8;
  sheet.rows = 6;
  sheet.marker_mm = 40;
  sheet.spacing_mm = 15;
  sheet.first_id = 200;
}

void SimulationOptions::validate() const {
  check_range("poses", poses, 0, 5000);
  check_range("photos_per_pose", photos_per_pose, 0, 50);
  check_range("calibration_photos", calibration_photos, 0, 500);
  check_range("width_px", width_px, 64, 16384);
  check_range("focal_mm", focal_mm, 18.0, 105.0);
  check_range("distance_mm", distance_mm, 100.0, 20000.0);
  check_range("range_mm", range_mm, 0.0, 1000.0);
  check_range("range_deg", range_deg, 0.0, 60.0);
  check_range("marker size_mm", markers.size_mm, 1.0, 200.0);
  check_range("known_sigma_mm", known_sigma_mm, 0.0, 10.0);
  check_range("blur_min_px", blur_min_px, 0.0, 12.0);
  check_range("blur_max_px", blur_max_px, blur_min_px, 12.0);
  check_range("JPEG quality", jpeg.quality, 1, 100);
  machine.validate();
  sheet.validate();
  sensor.validate();
  effects.validate();
}

VirtualLaboratory make_laboratory(const SimulationOptions& options) {
  options.validate();
  VirtualLaboratory laboratory;
  laboratory.options = options;
  laboratory.machine = make_machine(options.seed, options.machine);
  laboratory.rig = make_rig(options.seed, options.markers, laboratory.machine.nominal);
  laboratory.camera = options.brown_lens ? brown_camera(options.focal_mm, options.width_px)
                                         : profile_camera(options.focal_mm, options.width_px);
  // No lens stands exactly over the middle of its sensor.
  RandomSource random(options.seed, kCameraStream);
  const double px = options.width_px / static_cast<double>(kSensorWidthPx);
  laboratory.camera.parameters[2] += px * random.uniform(-20, 20);
  laboratory.camera.parameters[3] += px * random.uniform(-20, 20);
  return laboratory;
}

std::vector<Shot> pose_shots(const VirtualLaboratory& laboratory, const std::vector<RoundPose>& poses,
                             std::uint64_t round, int first_number) {
  std::vector<Shot> shots;
  int number = first_number;
  const double distance = laboratory.options.distance_mm * laboratory.options.focal_mm / 35;
  for (const RoundPose& pose : poses) {
    RandomSource place(laboratory.options.seed, named_stream(kStationStream, round, pose.id));
    RandomSource random(laboratory.options.seed, named_stream(kShotStream, round, pose.id));
    for (const Rigid3& station : pose_stations(place, laboratory.options.photos_per_pose, distance)) {
      Shot shot = new_shot(laboratory, random, station, number++);
      shot.pose = pose.id;
      shot.UG_from_LG = trembled(ug_from_lg(pose.pose, laboratory.machine.nominal.gd_mm),
                                 laboratory.options.effects.platform, shot.seed);
      shots.push_back(shot);
    }
  }
  return shots;
}

std::vector<Shot> calibration_shots(const VirtualLaboratory& laboratory, int first_number) {
  RandomSource place(laboratory.options.seed, named_stream(kStationStream, 0, "sheet"));
  RandomSource random(laboratory.options.seed, named_stream(kShotStream, 0, "sheet"));
  const Eigen::Vector2d extent = sheet_geometry(laboratory.options.sheet).extent_mm;
  std::vector<Shot> shots;
  int number = first_number;
  for (const Rigid3& station :
       sheet_stations(place, laboratory.options.calibration_photos, laboratory.camera, extent)) {
    shots.push_back(new_shot(laboratory, random, station, number++));
  }
  return shots;
}

Scene shot_scene(const VirtualLaboratory& laboratory, const Shot& shot) {
  const PrintEffects& effects = laboratory.options.effects.print;
  if (shot.pose.empty()) {
    SheetPrint print = laboratory.options.print;
    print.warp_mm.x() += effects.sheet_curl_mm;
    Scene scene = sheet_scene(laboratory.options.sheet, print, laboratory.options.seed);
    print_on_paper(scene, printed_surfaces(laboratory, shot), effects);
    return scene;
  }
  Rig rig = laboratory.rig;
  for (Sticker& sticker : rig.stickers) {
    for (const MovedSticker& moved : shot.moved_stickers) {
      if (moved.id == sticker.id) sticker.body_from_marker = sticker.body_from_marker * moved.marker_motion;
    }
  }
  Scene scene = rig_scene(rig, shot.UG_from_LG);
  print_on_paper(scene, printed_surfaces(laboratory, shot), effects);
  if (effects.sticker_curl_mm != 0) {
    for (std::size_t i = 0; i < rig.stickers.size(); ++i) {
      const double half = 0.5 * rig.stickers[i].size_mm;
      scene.surfaces[i].warp = SheetWarp{{effects.sticker_curl_mm, 0}, {half, half}};
    }
  }
  scene.surfaces.insert(scene.surfaces.end(), shot.obstacles.begin(), shot.obstacles.end());
  return scene;
}

cv::Mat photograph(const VirtualLaboratory& laboratory, const RayLattice& lens, const Shot& shot) {
  const SimulationOptions& options = laboratory.options;
  const CameraEffects& effects = options.effects;
  OpticsOptions optics;
  optics.blur_px = shot.blur_px;
  optics.exposure = shot.exposure * effects.sensor.exposure;
  optics.depth = effects.lens.f_number > 0;
  const Scene scene = shot_scene(laboratory, shot);
  SensorImage light = render(scene, lens, shot.camera_from_world, optics, shot.seed);
  if (effects.ideal()) return develop(light, options.sensor, shot.seed);
  const double focus_mm =
      effects.lens.focus_mm > 0
          ? effects.lens.focus_mm
          : prints_distance_mm(scene, printed_surfaces(laboratory, shot), shot.camera_from_world);
  apply_lens_effects(light, effects.lens, options.focal_mm, focus_mm, shot.seed);
  const ChannelShift shift(effects.lens, laboratory.camera, options.focal_mm, shot.seed);
  return develop(light, shift, options.sensor, effects.sensor, effects.processing, shot.seed, options.seed);
}

}  // namespace hexcal
