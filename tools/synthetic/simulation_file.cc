#include "tools/synthetic/simulation_file.h"

#include <fmt/format.h>

#include "tools/io/yaml_map.h"
#include "tools/synthetic/camera_effects_file.h"

namespace hexcal {
namespace {

constexpr std::array kToneNames{"srgb", "gamma22", "s_curve", "linear"};

}  // namespace

std::string format_simulation_file(const std::string& head, const SimulationOptions& o) {
  std::string text = head;
  text += fmt::format("seed: \"{}\"\nposes: {}\nphotos_per_pose: {}\ncalibration_photos: {}\nwidth_px: {}\n",
                      o.seed, o.poses, o.photos_per_pose, o.calibration_photos, o.width_px);
  text += fmt::format("lens: {}\nfocal_mm: {}\ndistance_mm: {}\nrange_mm: {}\nrange_deg: {}\n",
                      o.brown_lens ? "brown" : "profile", o.focal_mm, o.distance_mm, o.range_mm, o.range_deg);
  text += fmt::format("known_sigma_mm: {}\nblur_min_px: {}\nblur_max_px: {}\njpeg_quality: {}\ngrey: {}\n",
                      o.known_sigma_mm, o.blur_min_px, o.blur_max_px, o.jpeg.quality, o.jpeg.grey);
  text += fmt::format(
      "markers: {{family: {}, size_mm: {}, first_fixed_id: {}, first_moving_id: {}, position_sigma_mm: {}, "
      "angle_sigma_deg: {}}}\n",
      o.markers.family, o.markers.size_mm, o.markers.first_fixed_id, o.markers.first_moving_id,
      o.markers.position_sigma_mm, o.markers.angle_sigma_deg);
  text += fmt::format(
      "machine: {{joint_sigma_mm: {}, leg_offset_sigma_mm: {}, leg_scale_sigma: {}, draws: {}, "
      "stroke_wave_mm: {}, backlash_mm: {}, leg_compliance_mm_per_n: {}, payload_n: {}}}\n",
      o.machine.joint_sigma_mm, o.machine.leg_offset_sigma_mm, o.machine.leg_scale_sigma, o.machine.draws,
      o.machine.stroke_wave_mm, o.machine.backlash_mm, o.machine.leg_compliance_mm_per_n,
      o.machine.payload_n);
  text += fmt::format("sensor: {{full_well_electrons: {}, read_noise: {}, tone: {}}}\n",
                      o.sensor.full_well_electrons, o.sensor.read_noise,
                      kToneNames[static_cast<std::size_t>(o.sensor.tone)]);
  text += fmt::format("print: {{scale: [{}, {}], warp_mm: [{}, {}], margin_mm: {}}}\n", o.print.scale.x(),
                      o.print.scale.y(), o.print.warp_mm.x(), o.print.warp_mm.y(), o.print.margin_mm);
  if (!o.effects.ideal()) text += "camera_effects:\n" + format_camera_effects(o.effects, "  ");
  return text;
}

SimulationOptions read_simulation_file(const std::filesystem::path& path) {
  const YamlMap map = YamlMap::read(path);
  SimulationOptions o;
  o.seed = std::stoull(map.text("seed"));
  o.poses = map.integer("poses");
  o.photos_per_pose = map.integer("photos_per_pose");
  o.calibration_photos = map.integer("calibration_photos");
  o.width_px = map.integer("width_px");
  o.brown_lens = map.choice("lens", {"brown", "profile"}) == "brown";
  o.focal_mm = map.number("focal_mm");
  o.distance_mm = map.number("distance_mm");
  o.range_mm = map.number("range_mm");
  o.range_deg = map.number("range_deg");
  o.known_sigma_mm = map.number("known_sigma_mm");
  o.blur_min_px = map.number("blur_min_px");
  o.blur_max_px = map.number("blur_max_px");
  o.jpeg.quality = map.integer("jpeg_quality");
  o.jpeg.grey = map.boolean_or("grey", false);
  const YamlMap markers = map.map("markers");
  o.markers.family = markers.text("family");
  o.markers.size_mm = markers.number("size_mm");
  o.markers.first_fixed_id = markers.integer("first_fixed_id");
  o.markers.first_moving_id = markers.integer("first_moving_id");
  o.markers.position_sigma_mm = markers.number("position_sigma_mm");
  o.markers.angle_sigma_deg = markers.number("angle_sigma_deg");
  markers.finish();
  const YamlMap machine = map.map("machine");
  o.machine.joint_sigma_mm = machine.number("joint_sigma_mm");
  o.machine.leg_offset_sigma_mm = machine.number("leg_offset_sigma_mm");
  o.machine.leg_scale_sigma = machine.number("leg_scale_sigma");
  o.machine.draws = static_cast<int>(machine.number_or("draws", 1));  // older files: one
  o.machine.stroke_wave_mm = machine.number("stroke_wave_mm");
  o.machine.backlash_mm = machine.number("backlash_mm");
  o.machine.leg_compliance_mm_per_n = machine.number("leg_compliance_mm_per_n");
  o.machine.payload_n = machine.number("payload_n");
  machine.finish();
  const YamlMap sensor = map.map("sensor");
  o.sensor.full_well_electrons = sensor.number("full_well_electrons");
  o.sensor.read_noise = sensor.number("read_noise");
  const std::string tone = sensor.choice("tone", {kToneNames.begin(), kToneNames.end()});
  for (std::size_t i = 0; i < kToneNames.size(); ++i) {
    if (tone == kToneNames[i]) o.sensor.tone = static_cast<ToneCurveKind>(i);
  }
  o.effects.processing.sharpening = sensor.number_or("sharpening", 0);  // older files
  sensor.finish();
  const YamlMap print = map.map("print");
  const std::vector<double> scale = print.numbers("scale", 2);
  const std::vector<double> warp = print.numbers("warp_mm", 2);
  o.print.scale = {scale[0], scale[1]};
  o.print.warp_mm = {warp[0], warp[1]};
  o.print.margin_mm = print.number("margin_mm");
  print.finish();
  if (map.has("camera_effects")) o.effects = camera_effects_of(map.map("camera_effects"));
  map.finish();
  return o;
}

}  // namespace hexcal
