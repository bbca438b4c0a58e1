#include "tools/hexcal/camera_library.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "kinematics/geometry/input_error.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/camera_file.h"
#include "tools/io/json_text.h"

namespace hexcal {
namespace {

template <class Number>
std::string number_or_dash(const std::optional<Number>& number) {
  return number ? fmt::format("{:g}", static_cast<double>(*number)) : "-";
}

}  // namespace

std::vector<LibraryEntry> read_camera_library(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder))
    throw InputError(fmt::format("{}: no such folder, wanted a camera library", folder.string()));
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  }
  if (files.empty()) throw InputError(fmt::format("{}: holds no camera file (.yaml)", folder.string()));
  std::sort(files.begin(), files.end());
  std::vector<LibraryEntry> entries;
  for (const std::filesystem::path& file : files) {
    LibraryEntry entry{file, {}, ""};
    try {
      entry.camera = read_camera_file(file);
    } catch (const InputError& error) {
      entry.fault = error.what();
    }
    entries.push_back(std::move(entry));
  }
  return entries;
}

std::string camera_library_table(const std::vector<LibraryEntry>& entries) {
  TextTable table(
      {"file", "camera", "focal_mm", "f_number", "focus", "size_px", "f_px", "rms_px", "verdict"});
  table.align_left(1);
  table.align_left(8);
  for (const LibraryEntry& entry : entries) {
    const std::string name = entry.file.filename().string();
    if (!entry.fault.empty()) {
      table.add_row({name, "", "", "", "", "", "", "", entry.fault}, Colour::bad);
      continue;
    }
    const LensSetting& setting = entry.camera.setting;
    const CameraModel& model = entry.camera.model;
    table.add_row({name, setting.model.value_or("-"), number_or_dash(setting.focal_length_mm),
                   number_or_dash(setting.f_number), number_or_dash(setting.focus_distance_code),
                   fmt::format("{} x {}", model.width_px, model.height_px),
                   fmt::format("{:.1f}", model.fy_px()), fmt::format("{:.3f}", entry.camera.quality.rms_px),
                   camera_verdict_name(entry.camera.quality.verdict)});
  }
  return table.text();
}

std::string camera_library_json(const std::vector<LibraryEntry>& entries) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const LibraryEntry& entry : entries) {
    nlohmann::ordered_json row{{"file", entry.file.string()}};
    if (!entry.fault.empty()) {
      row["error"] = entry.fault;
    } else {
      const LensSetting& setting = entry.camera.setting;
      const auto add = [&row](const char* key, const auto& value) {
        if (value) row[key] = *value;
      };
      add("model", setting.model);
      add("serial", setting.serial);
      add("focal_length_mm", setting.focal_length_mm);
      add("f_number", setting.f_number);
      add("focus_distance_code", setting.focus_distance_code);
      row["image_size_px"] = {entry.camera.model.width_px, entry.camera.model.height_px};
      row["f_px"] = entry.camera.model.fy_px();
      row["rms_px"] = entry.camera.quality.rms_px;
      row["verdict"] = camera_verdict_name(entry.camera.quality.verdict);
    }
    out.push_back(std::move(row));
  }
  return json_text(out, 2) + "\n";
}

}  // namespace hexcal
