#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <memory>

#include "kinematics/geometry/input_error.h"
#include "tools/hexcal/command.h"
#include "tools/hexcal/version.h"
#include "tools/io/atomic_file.h"
#include "tools/io/camera_export.h"
#include "tools/io/camera_file.h"
#include "tools/io/yaml_map.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

struct Flags {
  fs::path input;
  std::string format;
  fs::path output;
};

constexpr const char* kSynopsis = R"(Write a camera in another program's format, or read one from it.

  hexcal export camera.yaml --to opencv -o opencv.yml
  hexcal export ost.yaml --to hexcal -o camera.yaml      (OpenCV, ROS, PhotoModeler values)

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

void export_hexcal_camera(const Flags& flags) {
  const CameraExport result = export_camera(read_camera_file(flags.input), flags.format);
  write_file_atomically(flags.output, result.text);
  print_fit(flags.output, result.model, result.rms_px, result.max_px);
}

void import_camera(const Flags& flags) {
  const ForeignCamera foreign = read_foreign_camera(flags.input);
  write_file_atomically(
      flags.output, format_camera_file(provenance_line(kVersion, "export", {flags.input}), foreign.camera));
  print_fit(flags.output,
            fmt::format("{} values as {}", foreign.format, lens_model_name(foreign.camera.model.lens)),
            foreign.fit_rms_px, foreign.fit_rms_px);
}

// One row per kind of file: how it is known and who writes it.
struct FileKind {
  const char* name;
  bool (*is)(const fs::path& path, const std::string& format);
  void (*write)(const Flags& flags);
};

constexpr FileKind kFileKinds[] = {
    {"another program's camera",
     [](const fs::path&, const std::string& format) { return format == "hexcal"; }, import_camera},
    {"camera", [](const fs::path& path, const std::string&) { return is_camera_file(path); },
     export_hexcal_camera},
};

int run(const Flags& flags) {
  for (const FileKind& kind : kFileKinds) {
    if (!kind.is(flags.input, flags.format)) continue;
    kind.write(flags);
    return kDone;
  }
  throw InputError(
      fmt::format("{}: is no file that can be exported, wanted a camera.yaml", flags.input.string()));
}

}  // namespace

void add_export_command(CLI::App& app, Action& action) {
  auto flags = std::make_shared<Flags>();
  CLI::App* command = app.add_subcommand("export", kSynopsis);
  command->add_option("FILE", flags->input, "camera.yaml, or another program's camera with --to hexcal")
      ->required()
      ->check(CLI::ExistingFile);
  command
      ->add_option("--to", flags->format,
                   fmt::format("camera: {}, or hexcal to read one", fmt::join(camera_export_formats(), ", ")))
      ->required();
  command->add_option("-o,--output", flags->output, "file to write")->required();
  command->callback([flags, &action] { action = [flags] { return run(*flags); }; });
}

}  // namespace hexcal
