#include "tools/io/model_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <sstream>

#include "tools/io/atomic_file.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/yaml_map.h"

namespace hexcal {
namespace {

std::string indented(const std::string& text) {
  std::istringstream lines(text);
  std::string out;
  for (std::string line; std::getline(lines, line);) out += "  " + line + "\n";
  return out;
}

std::vector<double> flat(const std::array<ErrorLine, 6>& lines) {
  std::vector<double> numbers;
  for (const ErrorLine& line : lines) {
    numbers.push_back(line.intercept);
    numbers.push_back(line.slope);
  }
  return numbers;
}

std::array<ErrorLine, 6> lines_from(const std::vector<double>& numbers) {
  std::array<ErrorLine, 6> lines;
  for (std::size_t i = 0; i < 6; ++i) lines[i] = {numbers[2 * i], numbers[2 * i + 1]};
  return lines;
}

void read_paper(const YamlMap& map, PaperModel& paper) {
  paper.pose_lines = lines_from(map.numbers("pose_lines", 12));
  if (paper.option == 3) return;
  const YamlMap joints = map.map("joint_lines");
  for (std::size_t leg = 0; leg < 6; ++leg)
    paper.joint_lines[leg] = lines_from(joints.numbers(fmt::format("leg{}", leg + 1), 12));
  joints.finish();
}

void read_extensions(const YamlMap& map, MachineModel& machine) {
  if (map.has("stroke_curves")) {
    const std::vector<YamlMap> curves = map.maps("stroke_curves");
    if (curves.size() != 6) map.fail("stroke_curves", fmt::format("found {}, wanted 6", curves.size()));
    for (std::size_t leg = 0; leg < 6; ++leg) {
      StrokeCurve& curve = machine.stroke_curves[leg];
      curve.low = curves[leg].number("low");
      curve.high = curves[leg].number("high");
      curve.coefficients_mm = curves[leg].numbers("coefficients_mm");
      curves[leg].finish();
      if (curve.high == curve.low) map.fail("stroke_curves", "found low equal to high");
    }
  }
  if (map.has("sag")) machine.sag = Eigen::Map<const Eigen::Vector4d>(map.numbers("sag", 4).data());
  if (map.has("backlash_mm"))
    machine.backlash_mm = Eigen::Map<const Vector6d>(map.numbers("backlash_mm", 6).data());
}

}  // namespace

std::string model_text(const std::string& head, const CalibrationModel& model) {
  std::string text = head + fmt::format("method: {}\nnominal:\n", name(model.method));
  text += indented(hexapod_text("", model.nominal));
  if (model.method == CompensationMethod::kinematic) {
    const MachineModel& machine = model.machine;
    text += "machine:\n" + indented(hexapod_text("", machine.geometry));
    if (!machine.stroke_curves[0].coefficients_mm.empty()) {
      text += "stroke_curves:\n";
      for (const StrokeCurve& curve : machine.stroke_curves) {
        text += fmt::format("  - {{low: {}, high: {}, coefficients_mm: [{}]}}\n", curve.low, curve.high,
                            fmt::join(curve.coefficients_mm, ", "));
      }
    }
    const auto list = [](const auto& v) { return fmt::format("[{}]", fmt::join(v.begin(), v.end(), ", ")); };
    if (!machine.sag.isZero(0)) text += "sag: " + list(machine.sag) + "\n";
    if (!machine.backlash_mm.isZero(0)) text += "backlash_mm: " + list(machine.backlash_mm) + "\n";
  } else if (model.method != CompensationMethod::nominal) {
    text += fmt::format("pose_lines: [{}]\n", fmt::join(flat(model.paper.pose_lines), ", "));
    if (model.paper.option != 3) {
      text += "joint_lines:\n";
      for (std::size_t leg = 0; leg < 6; ++leg)
        text += fmt::format("  leg{}: [{}]\n", leg + 1, fmt::join(flat(model.paper.joint_lines[leg]), ", "));
    }
  }
  return text;
}

CalibrationModel parse_model(const std::string& text, const std::filesystem::path& path) {
  const YamlMap map = YamlMap::parse(text, path);
  CalibrationModel model;
  model.method =
      *method_from_name(map.choice("method", {"nominal", "option1", "option2", "option3", "kinematic"}));
  model.nominal = hexapod_from_yaml(map.map("nominal"));
  if (model.method == CompensationMethod::kinematic) {
    model.machine.geometry = hexapod_from_yaml(map.map("machine"));
    read_extensions(map, model.machine);
  } else if (model.method != CompensationMethod::nominal) {
    model.paper.option = model.method == CompensationMethod::option1   ? 1
                         : model.method == CompensationMethod::option2 ? 2
                                                                       : 3;
    read_paper(map, model.paper);
  }
  map.finish();
  return model;
}

CalibrationModel read_model_file(const std::filesystem::path& path) {
  return parse_model(read_file(path), path);
}

}  // namespace hexcal
