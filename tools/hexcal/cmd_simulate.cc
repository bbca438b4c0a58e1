#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>

#include "kinematics/geometry/input_error.h"
#include "pose_extract/image_folders.h"
#include "tools/hexcal/command.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/atomic_file.h"
#include "tools/io/output_file.h"
#include "tools/io/sheet_file.h"
#include "tools/io/version.h"
#include "tools/synthetic/camera_effects_file.h"
#include "tools/synthetic/campaign_folder.h"
#include "tools/synthetic/simulation_file.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

struct SimulateFlags {
  fs::path out;
  fs::path from;
  fs::path commands;
  fs::path targets;
  SimulationOptions options;
  std::string lens = "profile";
  std::optional<double> pose_noise_um;
  std::optional<double> pose_noise_mdeg;
  fs::path sheet;
  std::string effects = "ideal";
  bool no_images = false;
  bool true_camera = false;
};

// A round is known by its commands and targets, so that another set of commands gets other camera stations.
std::uint64_t round_number(const SimulateFlags& flags) {
  std::string inputs = read_file(flags.commands);
  if (!flags.targets.empty()) inputs += read_file(flags.targets);
  return 1 + std::stoull(sha256_hex(inputs).substr(0, 8), nullptr, 16);
}

// A campaign of rendered photographs among those of a camera would be neither.
void refuse_photographs(const fs::path& folder) {
  if (allowed_overwriting() == Overwrite::any_file || !fs::is_directory(folder)) return;
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(folder, error)) {
    if (!is_photograph_name(entry.path())) continue;
    throw InputError(
        fmt::format("{}: holds photographs ({}), wanted a new folder, or --force to write over them",
                    folder.string(), entry.path().lexically_relative(folder).string()));
  }
}

int run_simulate(const SimulateFlags& flags) {
  refuse_photographs(flags.out);
  SimulationOptions options = flags.options;
  options.brown_lens = flags.lens == "brown";
  if (!flags.sheet.empty()) {
    const std::vector<Sheet> sheets = read_sheet_file(flags.sheet);
    if (sheets.size() != 1) {
      throw InputError(fmt::format("{}: holds {} sheets, wanted the one to photograph", flags.sheet.string(),
                                   sheets.size()));
    }
    options.sheet = sheets.front();
  }
  options.effects = read_camera_effects(flags.effects);
  RoundOptions round;
  round.images = !flags.no_images;
  round.true_camera = flags.true_camera;
  if (flags.pose_noise_um) round.pose_noise_mm = *flags.pose_noise_um * 1e-3;
  if (flags.pose_noise_mdeg) round.pose_noise_rad = *flags.pose_noise_mdeg * 1e-3 * kRadPerDeg;
  fs::path targets = flags.targets;
  if (!flags.from.empty()) {
    options = read_simulation_file(flags.from / "truth" / "simulation.yaml");
    if (flags.commands.empty()) throw InputError("--from needs --commands, the readings to move to");
    if (fs::exists(flags.out / "truth") && fs::equivalent(flags.out, flags.from)) {
      throw InputError(fmt::format("{}: the second round needs a folder of its own", flags.out.string()));
    }
    round.commands = read_leg_table(flags.commands);
    round.round = round_number(flags);
    if (targets.empty()) targets = flags.from / "targets.csv";
  } else if (!flags.commands.empty()) {
    throw InputError("--commands needs --from, the campaign whose machine is to be moved");
  }
  if (!targets.empty()) round.targets = read_pose_table(targets);
  round.head = provenance_line(kVersion, "simulate", {flags.commands, targets});

  const VirtualLaboratory laboratory = make_laboratory(options);
  std::unique_ptr<ProgressBar> bar;
  const RoundResult result = write_campaign(flags.out, laboratory, round, [&bar](int done, int total) {
    if (done == 0) bar = std::make_unique<ProgressBar>("rendering", static_cast<std::size_t>(total));
    if (done > 0) bar->advance();
  });
  bar.reset();
  fmt::print("{}: {} photographs, truth in {}\n", flags.out.string(), result.photographs,
             (flags.out / "truth").string());
  for (const std::string& line : result.skipped) fmt::print("  no photographs of {}\n", line);
  const std::string out = shell_word(flags.out.string());
  if (!flags.from.empty()) {
    const std::string from = shell_word(flags.from.string());
    suggest_next(fmt::format("cp {}/camera.yaml {} && hexcal measure {} && hexcal report {} --before {}",
                             from, out, out, out, from));
  } else if (fs::exists(flags.out / "camera.yaml")) {
    suggest_next("hexcal run " + out);
  } else if (fs::exists(flags.out / "calibration")) {
    suggest_next(
        fmt::format("hexcal camera {0}/calibration --template {0}/sheet.yaml -o {0}/camera.yaml", out));
  }
  return result.skipped.empty() ? kDone : kSomeFailed;
}

}  // namespace

void add_simulate_command(CLI::App& app, Action& action) {
  const auto flags = std::make_shared<SimulateFlags>();
  SimulationOptions& options = flags->options;
  CLI::App* command =
      app.add_subcommand("simulate", "Render a campaign with a virtual hexapod and known truth");
  command->add_option("-o,--output", flags->out, "campaign folder to write")->required();
  command->add_option("--seed", options.seed, "of the hidden machine, markers, camera, noise")
      ->capture_default_str();
  command->add_option("--poses", options.poses, "random poses beside home")->capture_default_str();
  command->add_option("--targets", flags->targets, "poses to move to instead of random ones (targets.csv)");
  command->add_option("--photos-per-pose", options.photos_per_pose, "camera stations per pose")
      ->capture_default_str();
  command->add_option("--calibration-photos", options.calibration_photos, "photographs of the sheet")
      ->capture_default_str();
  command->add_option("--width", options.width_px, "of the photographs, px; height in proportion")
      ->capture_default_str();
  command->add_option("--lens", flags->lens, "profile: the 18-105's public profile; brown: Brown-Conrady")
      ->check(CLI::IsMember({"profile", "brown"}))
      ->capture_default_str();
  command->add_option("--focal-mm", options.focal_mm, "18 to 105")->capture_default_str();
  command
      ->add_option("--distance-mm", options.distance_mm,
                   "camera to grips at 35 mm; grows with the focal length")
      ->capture_default_str();
  command->add_option("--range-mm", options.range_mm, "of the random poses, each way")->capture_default_str();
  command->add_option("--range-deg", options.range_deg, "of the random poses, each way")
      ->capture_default_str();
  command->add_option("--family", options.markers.family, "of the markers on the grips")
      ->capture_default_str();
  command->add_option("--marker-mm", options.markers.size_mm, "edge of their squares")->capture_default_str();
  command->add_option("--joint-error-mm", options.machine.joint_sigma_mm, "sigma of each joint coordinate")
      ->capture_default_str();
  command->add_option("--leg-offset-mm", options.machine.leg_offset_sigma_mm, "sigma of each leg's length")
      ->capture_default_str();
  command->add_option("--leg-scale", options.machine.leg_scale_sigma, "relative sigma of each leg's scale")
      ->capture_default_str();
  command
      ->add_option("--machine-draws", options.machine.draws,
                   "of so many machines the one whose errors are most like the paper's; 1: follow the sigmas")
      ->capture_default_str();
  command->add_option("--stroke-wave-mm", options.machine.stroke_wave_mm, "periodic leg error (not modelled)")
      ->capture_default_str();
  command->add_option("--backlash-mm", options.machine.backlash_mm, "leg play (not modelled)")
      ->capture_default_str();
  command
      ->add_option("--compliance-mm-per-n", options.machine.leg_compliance_mm_per_n,
                   "leg shortening under load (not modelled)")
      ->capture_default_str();
  command->add_option("--sheet", flags->sheet,
                      "sheet.yaml of the sheet to photograph instead of an AprilGrid of 8 x 6 tags of 40 mm");
  command->add_option("--sheet-scale-x", options.print.scale.x(), "print of the sheet longer by this factor")
      ->capture_default_str();
  command->add_option("--sheet-scale-y", options.print.scale.y(), "the same in y")->capture_default_str();
  command
      ->add_option("--sheet-warp-mm", options.print.warp_mm.x(), "height of the sheet's middle over its ends")
      ->capture_default_str();
  command->add_option("--blur-min-px", options.blur_min_px, "sigma of the sharpest photograph")
      ->capture_default_str();
  command->add_option("--blur-max-px", options.blur_max_px, "sigma of the softest photograph")
      ->capture_default_str();
  command
      ->add_option("--camera-effects", flags->effects,
                   "what is real about print, lens and camera: ideal, d3200, or a YAML file")
      ->capture_default_str();
  command->add_option("--jpeg-quality", options.jpeg.quality, "1 to 100")->capture_default_str();
  command->add_flag("--grey", options.jpeg.grey, "one-channel JPEG");
  command->add_flag("--true-camera", flags->true_camera, "also write the true camera as camera.yaml");
  command->add_flag("--no-images", flags->no_images, "everything but the photographs");
  command->add_option("--pose-noise-um", flags->pose_noise_um,
                      "write results/poses.csv with this noise per axis");
  command->add_option("--pose-noise-mdeg", flags->pose_noise_mdeg, "the same for angles, 0.001 deg");
  command->add_option("--from", flags->from, "second round: campaign whose hidden machine is moved again");
  command->add_option("--commands", flags->commands, "actuator readings to move to (actuators.csv)");
  command->footer(
      "The same flags give the same bytes. Home is reached by the drawing's readings in every round.\n"
      "Sample output:\n"
      "  lab1: 53 photographs, truth in lab1/truth\n"
      "Second round, the machine's answer to corrected commands:\n"
      "  hexcal simulate -o lab2 --from lab1 --commands lab1/results/actuators.csv");
  command->callback([flags, &action] { action = [flags] { return run_simulate(*flags); }; });
}

}  // namespace hexcal
