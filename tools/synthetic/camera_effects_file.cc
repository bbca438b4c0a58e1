#include "tools/synthetic/camera_effects_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <functional>

#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

constexpr std::array kDemosaicingNames{"none", "linear", "adaptive"};

CameraEffects preset_effects(const std::string& name) {
  return name == "d3200" ? d3200_effects() : CameraEffects{};
}

// A key of a group that may be left out.
void read_number(const YamlMap& group, const char* key, double& value) {
  value = group.number_or(key, value);
}

void read_group(const YamlMap& map, const char* name, const std::function<void(const YamlMap&)>& read) {
  if (!map.has(name)) return;
  const YamlMap group = map.map(name);
  read(group);
  group.finish();
}

void read_sensor(const YamlMap& group, SensorEffects& sensor) {
  read_number(group, "exposure", sensor.exposure);
  read_number(group, "hot_pixels_per_mpx", sensor.hot_pixels_per_mpx);
  if (group.has("dust_specks")) sensor.dust_specks = group.integer("dust_specks");
  if (group.has("demosaicing")) {
    const std::string name =
        group.choice("demosaicing", {kDemosaicingNames.begin(), kDemosaicingNames.end()});
    for (std::size_t i = 0; i < kDemosaicingNames.size(); ++i) {
      if (name == kDemosaicingNames[i]) sensor.demosaicing = static_cast<Demosaicing>(i);
    }
  }
  if (!group.has("colour_matrix")) return;
  const std::vector<double> numbers = group.numbers("colour_matrix");
  if (numbers.empty()) {
    sensor.colour_matrix.reset();
  } else if (numbers.size() == 9) {
    std::copy(numbers.begin(), numbers.end(), sensor.colour_matrix.emplace().begin());
  } else {
    group.fail("colour_matrix", fmt::format("has {} numbers, wanted none or 9", numbers.size()));
  }
}

void read_processing(const YamlMap& group, ProcessingEffects& processing) {
  if (group.has("tone_curve")) {
    const std::vector<double> numbers = group.numbers("tone_curve");
    if (numbers.size() % 2 != 0) group.fail("tone_curve", "wanted pairs: from, to, from, to, ...");
    processing.tone_curve.clear();
    for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) {
      processing.tone_curve.push_back({numbers[i], numbers[i + 1]});
    }
  }
  read_number(group, "noise_reduction", processing.noise_reduction);
  read_number(group, "sharpening", processing.sharpening);
  read_number(group, "sharpening_radius_px", processing.sharpening_radius_px);
}

}  // namespace

CameraEffects camera_effects_of(const YamlMap& map) {
  CameraEffects effects;
  if (map.has("preset")) effects = preset_effects(map.choice("preset", {"ideal", "d3200"}));
  read_group(map, "print", [&](const YamlMap& group) {
    read_number(group, "ink_spread_mm", effects.print.ink_spread_mm);
    read_number(group, "sheet_curl_mm", effects.print.sheet_curl_mm);
    read_number(group, "sticker_curl_mm", effects.print.sticker_curl_mm);
    read_number(group, "sticker_gloss", effects.print.sticker_gloss);
  });
  read_group(map, "platform", [&](const YamlMap& group) {
    read_number(group, "tremble_mm", effects.platform.tremble_mm);
    read_number(group, "tremble_mrad", effects.platform.tremble_mrad);
  });
  read_group(map, "lens", [&](const YamlMap& group) {
    read_number(group, "lateral_colour", effects.lens.lateral_colour);
    read_number(group, "f_number", effects.lens.f_number);
    read_number(group, "focus_mm", effects.lens.focus_mm);
    read_number(group, "field_curvature_mm", effects.lens.field_curvature_mm);
    read_number(group, "shake_px", effects.lens.shake_px);
    read_number(group, "rolling_shutter_px", effects.lens.rolling_shutter_px);
    read_number(group, "veiling_glare", effects.lens.veiling_glare);
  });
  read_group(map, "sensor", [&](const YamlMap& group) { read_sensor(group, effects.sensor); });
  read_group(map, "processing", [&](const YamlMap& group) { read_processing(group, effects.processing); });
  map.finish();
  effects.validate();
  return effects;
}

CameraEffects read_camera_effects(const std::string& name_or_file) {
  if (name_or_file == "ideal" || name_or_file == "d3200") return preset_effects(name_or_file);
  if (!std::filesystem::exists(name_or_file)) {
    throw InputError(
        fmt::format("camera effects '{}': neither a file nor a preset (ideal, d3200)", name_or_file));
  }
  return camera_effects_of(YamlMap::read(name_or_file));
}

std::string format_camera_effects(const CameraEffects& effects, const std::string& indent) {
  const PrintEffects& print = effects.print;
  const LensEffects& lens = effects.lens;
  const SensorEffects& sensor = effects.sensor;
  const ProcessingEffects& processing = effects.processing;
  std::string text = fmt::format(
      "{}print: {{ink_spread_mm: {}, sheet_curl_mm: {}, sticker_curl_mm: {}, sticker_gloss: {}}}\n", indent,
      print.ink_spread_mm, print.sheet_curl_mm, print.sticker_curl_mm, print.sticker_gloss);
  text += fmt::format("{}platform: {{tremble_mm: {}, tremble_mrad: {}}}\n", indent,
                      effects.platform.tremble_mm, effects.platform.tremble_mrad);
  text += fmt::format(
      "{}lens: {{lateral_colour: {}, f_number: {}, focus_mm: {}, field_curvature_mm: {}, shake_px: {}, "
      "rolling_shutter_px: {}, veiling_glare: {}}}\n",
      indent, lens.lateral_colour, lens.f_number, lens.focus_mm, lens.field_curvature_mm, lens.shake_px,
      lens.rolling_shutter_px, lens.veiling_glare);
  std::vector<double> matrix;
  if (sensor.colour_matrix) matrix.assign(sensor.colour_matrix->begin(), sensor.colour_matrix->end());
  text += fmt::format(
      "{}sensor: {{exposure: {}, demosaicing: {}, colour_matrix: [{}], hot_pixels_per_mpx: {}, "
      "dust_specks: {}}}\n",
      indent, sensor.exposure, kDemosaicingNames[static_cast<std::size_t>(sensor.demosaicing)],
      fmt::join(matrix, ", "), sensor.hot_pixels_per_mpx, sensor.dust_specks);
  std::vector<double> nodes;
  for (const auto& node : processing.tone_curve) nodes.insert(nodes.end(), node.begin(), node.end());
  text += fmt::format(
      "{}processing: {{tone_curve: [{}], noise_reduction: {}, sharpening: {}, sharpening_radius_px: {}}}\n",
      indent, fmt::join(nodes, ", "), processing.noise_reduction, processing.sharpening,
      processing.sharpening_radius_px);
  return text;
}

}  // namespace hexcal
