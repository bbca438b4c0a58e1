#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "kinematics/geometry/input_error.h"
#include "kinematics/inverse.h"
#include "tools/hexcal/command.h"
#include "tools/io/atomic_file.h"
#include "tools/io/camera_export.h"
#include "tools/io/camera_file.h"
#include "tools/io/controller_export.h"
#include "tools/io/csv_table.h"
#include "tools/io/model_file.h"
#include "tools/io/pose_table.h"
#include "tools/io/version.h"
#include "tools/io/yaml_map.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

struct ExportFlags {
  fs::path input;
  std::string format;
  fs::path output;
};

constexpr const char* kExportFooter =
    R"(Sample use:
  hexcal export camera.yaml --to opencv -o opencv.yml
  hexcal export ost.yaml --to hexcal -o camera.yaml      (OpenCV, ROS, PhotoModeler values)
  hexcal export model.yaml --to linuxcnc -o machine.hal
  hexcal export predicted_poses.csv --to pi-gcs -o moves.gcs
  hexcal export actuators.csv --to csv -o moves.csv

  wrote opencv.yml: OpenCV 12 coefficients, 0.0031 px rms from the camera over the frame (max 0.0120 px))";

void print_fit(const fs::path& file, const std::string& model, double rms_px, double max_px) {
  if (rms_px == 0) {
    fmt::print("wrote {}: {}, the same camera\n", file.string(), model);
  } else {
    fmt::print("wrote {}: {}, {:.4f} px rms from the camera over the frame (max {:.4f} px)\n", file.string(),
               model, rms_px, max_px);
  }
}

bool is_camera_file(const fs::path& path) {
  const std::string text = read_file(path);
  return text.find("\nimage_size_px:") != std::string::npos && text.find("\nmodel:") != std::string::npos;
}

void export_hexcal_camera(const ExportFlags& flags) {
  const CameraExport result = export_camera(read_camera_file(flags.input), flags.format);
  write_file_atomically(flags.output, result.text);
  print_fit(flags.output, result.model, result.rms_px, result.max_px);
}

void import_camera(const ExportFlags& flags) {
  const ForeignCamera foreign = read_foreign_camera(flags.input);
  write_file_atomically(
      flags.output, format_camera_file(provenance_line(kVersion, "export", {flags.input}), foreign.camera));
  print_fit(flags.output,
            fmt::format("{} values as {}", foreign.format, lens_model_name(foreign.camera.model.lens)),
            foreign.fit_rms_px, foreign.fit_rms_px);
}

bool is_model_file(const fs::path& path) {
  const std::string text = read_file(path);
  return text.find("\nmethod:") != std::string::npos && text.find("\nnominal:") != std::string::npos;
}

bool has_column(const fs::path& path, const char* column) {
  return path.extension() == ".csv" && CsvTable::read(path).has_column(column);
}

void want_format(const ExportFlags& flags, std::initializer_list<const char*> wanted) {
  if (std::find(wanted.begin(), wanted.end(), flags.format) == wanted.end())
    throw InputError(fmt::format("--to: found '{}' for {}, wanted {}", flags.format, flags.input.string(),
                                 fmt::join(wanted, " or ")));
}

// Largest difference of the readings that two machines want for poses about home.
double difference_of_readings(const PlatformGeometry& a, const PlatformGeometry& b) {
  double most = 0;
  for (int corner = 0; corner < 64; ++corner) {
    Vector6d v;
    for (Eigen::Index k = 0; k < 6; ++k) v[k] = ((corner >> k) % 2 == 0 ? 1 : -1) * (k < 3 ? 10.0 : 0.1);
    const Pose pose = Pose::from_vector(v);
    most = std::max(
        most, (readings_at(a, a.B_from_P(pose)) - readings_at(b, b.B_from_P(pose))).cwiseAbs().maxCoeff());
  }
  return most;
}

void export_model(const ExportFlags& flags) {
  want_format(flags, {"linuxcnc"});
  const CalibrationModel model = read_model_file(flags.input);
  const std::string text = linuxcnc_text(provenance_line(kVersion, "export", {flags.input}), model);
  const PlatformGeometry& geometry = model.machine.geometry;
  const double difference = difference_of_readings(parse_linuxcnc(text, geometry), geometry);
  if (!(difference < 1e-6)) throw std::logic_error("the exported machine has other legs than the model");
  write_file_atomically(flags.output, text);
  fmt::print("wrote {}: genhexkins, re-read: legs differ by {:.1e} units at most\n", flags.output.string(),
             difference);
}

void export_poses(const ExportFlags& flags) {
  want_format(flags, {"pi-gcs", "csv"});
  std::vector<PoseRecord> poses = read_pose_table(flags.input);
  const std::size_t all = poses.size();
  const std::string head = provenance_line(kVersion, "export", {flags.input});
  std::string text;
  if (flags.format == "pi-gcs") {
    text = pi_gcs_text(head, poses);
    std::erase_if(poses, [](const PoseRecord& pose) { return !pose.pose || pose.status != "ok"; });
    if (parse_pi_gcs(text).size() != poses.size()) throw std::logic_error("the move list lost poses");
  } else {
    std::erase_if(poses, [](const PoseRecord& pose) { return !pose.pose || pose.status != "ok"; });
    text = format_pose_table("", poses, PoseColumns::target);
  }
  write_file_atomically(flags.output, text);
  fmt::print("wrote {}: {} of {} poses can be reached\n", flags.output.string(), poses.size(), all);
}

void export_actuators(const ExportFlags& flags) {
  want_format(flags, {"csv"});
  std::vector<LegRecord> legs = read_leg_table(flags.input);
  const std::size_t all = legs.size();
  std::erase_if(legs, [](const LegRecord& leg) { return !leg.readings; });
  write_file_atomically(flags.output, format_leg_table("", legs, false));
  fmt::print("wrote {}: {} of {} poses can be reached\n", flags.output.string(), legs.size(), all);
}

// One row per kind of file: how it is known and who writes it.
struct FileKind {
  const char* name;
  bool (*is)(const fs::path& path, const std::string& format);
  void (*write)(const ExportFlags& flags);
};

constexpr FileKind kFileKinds[] = {
    {"another program's camera",
     [](const fs::path&, const std::string& format) { return format == "hexcal"; }, import_camera},
    {"camera", [](const fs::path& path, const std::string&) { return is_camera_file(path); },
     export_hexcal_camera},
    {"model", [](const fs::path& path, const std::string&) { return is_model_file(path); }, export_model},
    {"actuators", [](const fs::path& path, const std::string&) { return has_column(path, "q1"); },
     export_actuators},
    {"poses", [](const fs::path& path, const std::string&) { return has_column(path, "x_mm"); },
     export_poses},
};

int run_export(const ExportFlags& flags) {
  for (const FileKind& kind : kFileKinds) {
    if (!kind.is(flags.input, flags.format)) continue;
    kind.write(flags);
    return kDone;
  }
  throw InputError(fmt::format(
      "{}: is no file that can be exported, wanted a camera, a model.yaml, actuators.csv or poses",
      flags.input.string()));
}

}  // namespace

void add_export_command(CLI::App& app, Action& action) {
  auto flags = std::make_shared<ExportFlags>();
  std::vector<std::string> formats = camera_export_formats();
  formats.insert(formats.end(), {"hexcal", "linuxcnc", "pi-gcs", "csv"});
  CLI::App* command = app.add_subcommand(
      "export", "Write a camera, model or commands in another program's format, or read a camera");
  command->footer(kExportFooter);
  command
      ->add_option("FILE", flags->input,
                   "camera.yaml, model.yaml, actuators.csv, predicted_poses.csv, or another program's camera "
                   "with --to hexcal")
      ->required()
      ->check(CLI::ExistingFile);
  command
      ->add_option("--to", flags->format,
                   fmt::format("camera: {}, or hexcal to read one; model: linuxcnc; poses: pi-gcs, csv; "
                               "actuators: csv",
                               fmt::join(camera_export_formats(), ", ")))
      ->required()
      ->check(CLI::IsMember(formats));
  command->add_option("-o,--output", flags->output, "file to write")->required();
  command->callback([flags, &action] { action = [flags] { return run_export(*flags); }; });
}

}  // namespace hexcal
