#include "tools/synthetic/campaign_folder.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <map>

#include "tools/io/atomic_file.h"
#include "tools/io/camera_file.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/output_file.h"
#include "tools/io/sheet_file.h"
#include "tools/synthetic/random_source.h"
#include "tools/synthetic/simulation_file.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kKnownStream = 20;
constexpr std::uint64_t kPoseNoiseStream = 21;
constexpr double kMarkedShare = 0.02;  // of a sticker in view, to be listed in the truth

std::string campaign_text(const VirtualLaboratory& laboratory) {
  const MarkerLayout& markers = laboratory.options.markers;
  const auto ids = [](int first) { return fmt::format("[{}-{}]", first, first + 9); };
  return fmt::format(
      "camera: camera.yaml\nhexapod: hexapod.yaml\ntargets: targets.csv\nlegs: legs.csv\nimages: poses\n"
      "markers:\n  family: {}\n  fixed:  {{ids: {}, size_mm: {}}}\n  moving: {{ids: {}, size_mm: {}}}\n"
      "frames:\n  UG: {{from: nominal, file: markers_nominal.csv}}\n"
      "  LG: {{from: home, pose: home, gd_mm: {}}}\n"
      "# The virtual printer is exact; of paper that nobody measured the default is 0.001.\n"
      "scale: {{from: markers, print_scale_sigma: 0}}\n",
      markers.family, ids(markers.first_fixed_id), markers.size_mm, ids(markers.first_moving_id),
      markers.size_mm, laboratory.machine.nominal.gd_mm);
}

// The fixed markers' coordinates as a coordinate measuring machine would have given them.
std::string nominal_points(const VirtualLaboratory& laboratory) {
  RandomSource random(laboratory.options.seed, kKnownStream);
  const double sigma = laboratory.options.known_sigma_mm;
  std::string text = "id,corner,x_mm,y_mm,z_mm,sigma_mm\n";
  for (const Sticker& sticker : laboratory.rig.stickers) {
    if (sticker.moving) continue;
    for (int corner = 0; corner < 4; ++corner) {
      Eigen::Vector3d p = sticker.corner_in_body(corner);
      for (Eigen::Index i = 0; i < 3; ++i) p[i] += sigma * random.normal();
      text += fmt::format("{},{},{:.6f},{:.6f},{:.6f},{}\n", sticker.id, corner, p.x(), p.y(), p.z(),
                          std::max(sigma, 1e-6));
    }
  }
  return text;
}

std::string true_markers(const VirtualLaboratory& laboratory) {
  std::string text = "body,id,corner,x_mm,y_mm,z_mm\n";
  for (const Sticker& sticker : laboratory.rig.stickers) {
    for (int corner = 0; corner < 4; ++corner) {
      const Eigen::Vector3d p = sticker.corner_in_body(corner);
      text += fmt::format("{},{},{},{:.9f},{:.9f},{:.9f}\n", sticker.moving ? "LG" : "UG", sticker.id, corner,
                          p.x(), p.y(), p.z());
    }
  }
  return text;
}

std::string shot_folder(const Shot& shot) { return shot.pose.empty() ? "calibration" : "poses/" + shot.pose; }

// Camera poses: camera_from_world as translation and quaternion; world is UG, or the sheet's frame.
std::string true_stations(const std::vector<Shot>& shots) {
  std::string text = "photo,world,tx_mm,ty_mm,tz_mm,qw,qx,qy,qz,blur_px,exposure\n";
  for (const Shot& shot : shots) {
    const Rigid3& m = shot.camera_from_world;
    text += fmt::format("{}/{},{},{:.9f},{:.9f},{:.9f},{:.14f},{:.14f},{:.14f},{:.14f},{:.4f},{:.4f}\n",
                        shot_folder(shot), shot.file, shot.pose.empty() ? "sheet" : "UG", m.translation.x(),
                        m.translation.y(), m.translation.z(), m.rotation.w(), m.rotation.x(), m.rotation.y(),
                        m.rotation.z(), shot.blur_px, shot.exposure);
  }
  return text;
}

// Where every marker corner really falls.
std::string true_observations(const VirtualLaboratory& laboratory, const std::vector<Shot>& shots) {
  std::vector<std::string> parts(shots.size());
  const SheetGeometry sheet = sheet_geometry(laboratory.options.sheet);
  tbb::parallel_for(std::size_t{0}, shots.size(), [&](std::size_t i) {
    const Shot& shot = shots[i];
    const Scene scene = shot_scene(laboratory, shot);
    const auto add = [&](int id, int corner, const Eigen::Vector2d& px, double share, double incidence_rad) {
      parts[i] += fmt::format("{}/{},{},{},{:.6f},{:.6f},{:.3f},{:.2f}\n", shot_folder(shot), shot.file, id,
                              corner, px.x(), px.y(), share, incidence_rad * kDegPerRad);
    };
    if (!shot.pose.empty()) {
      const auto views =
          sticker_views(scene, laboratory.rig.stickers, laboratory.camera, shot.camera_from_world);
      for (std::size_t k = 0; k < views.size(); ++k) {
        if (views[k].visible_share < kMarkedShare) continue;
        for (int corner = 0; corner < 4; ++corner) {
          add(laboratory.rig.stickers[k].id, corner, views[k].corners_px[static_cast<std::size_t>(corner)],
              views[k].visible_share, views[k].incidence_rad);
        }
      }
      return;
    }
    const Surface& surface = scene.surfaces.front();
    const Eigen::Vector3d normal = shot.camera_from_world.rotation * Eigen::Vector3d::UnitZ();
    for (const SheetMarker& marker : sheet.markers) {
      std::array<Eigen::Vector2d, 4> px;
      int inside = 0;
      for (int corner = 0; corner < 4; ++corner) {
        const auto p = laboratory.camera.project(shot.camera_from_world *
                                                 surface.printed_point(marker.corner_mm(corner)));
        px[static_cast<std::size_t>(corner)] = p.value_or(Eigen::Vector2d(-1e6, -1e6));
        inside += p && laboratory.camera.contains(*p) ? 1 : 0;
      }
      const Eigen::Vector3d sight = shot.camera_from_world * surface.printed_point(marker.centre_mm);
      for (int corner = 0; corner < 4 && inside > 0; ++corner) {
        add(marker.id, corner, px[static_cast<std::size_t>(corner)], 0.25 * inside,
            std::acos(std::clamp(-sight.normalized().dot(normal), -1.0, 1.0)));
      }
    }
  });
  std::string text = "photo,id,corner,x_px,y_px,visible_share,incidence_deg\n";
  for (const std::string& part : parts) text += part;
  return text;
}

struct Round {
  std::vector<PoseRecord> targets;
  std::vector<LegRecord> commands;  // of the poses that were reached
  std::vector<PoseRecord> true_poses;
  std::vector<RoundPose> reached;
  std::vector<std::string> skipped;
};

// Moves the machine through the round's poses in their order.
Round move_machine(const VirtualLaboratory& laboratory, const RoundOptions& options) {
  const VirtualMachine& machine = laboratory.machine;
  Round round;
  if (options.targets) {
    round.targets = *options.targets;
  } else {
    for (const TargetPose& target :
         random_targets(machine, laboratory.options.seed + options.round, laboratory.options.poses,
                        laboratory.options.range_mm, laboratory.options.range_deg * kRadPerDeg)) {
      round.targets.push_back({target.id, "ok", target.pose, {}, {}, {}, {}});
    }
  }
  const auto has_home = [](const PoseRecord& record) { return record.id == "home"; };
  if (std::none_of(round.targets.begin(), round.targets.end(), has_home)) {
    round.targets.insert(round.targets.begin(), {"home", "ok", Pose{}, {}, {}, {}, {}});
  }
  std::map<std::string, LegRecord> commanded;
  if (options.commands) {
    for (const LegRecord& record : *options.commands) commanded[record.id] = record;
  }
  LegVector before = machine.home_readings;
  for (const PoseRecord& target : round.targets) {
    LegRecord command{target.id, "ok", {}};
    // Home is the machine's own: its readings are those of the drawing in every round.
    if (!options.commands || target.id == "home") {
      if (target.pose) command.readings = commanded_readings(machine.nominal, *target.pose);
    } else if (commanded.count(target.id) == 1) {
      command = commanded[target.id];
      if (command.status != "ok") command.readings.reset();
    } else {
      command.status = "not commanded";
    }
    PoseRecord truth{target.id, "ok", {}, {}, {}, {}, {}};
    if (command.readings) {
      truth.pose = true_pose(machine, *command.readings, before);
      if (!truth.pose) truth.status = "cannot be reached";
    } else {
      truth.status = command.status == "ok" ? "no readings" : command.status;
    }
    if (truth.pose) {
      round.reached.push_back({target.id, *truth.pose});
      round.commands.push_back(command);
      before = *command.readings;
    } else {
      round.skipped.push_back(target.id + ": " + truth.status);
    }
    round.true_poses.push_back(truth);
  }
  return round;
}

std::vector<PoseRecord> noisy_poses(const VirtualLaboratory& laboratory, const RoundOptions& options,
                                    const std::vector<PoseRecord>& truth) {
  RandomSource random(laboratory.options.seed + 7919 * options.round, kPoseNoiseStream);
  const double sigma_mm = options.pose_noise_mm.value_or(0);
  const double sigma_rad = options.pose_noise_rad.value_or(0);
  std::vector<PoseRecord> noisy = truth;
  for (PoseRecord& record : noisy) {
    if (!record.pose) continue;
    Vector6d v = record.pose->vector();
    Vector6d sigma;
    sigma << Eigen::Vector3d::Constant(sigma_mm), Eigen::Vector3d::Constant(sigma_rad);
    for (Eigen::Index i = 0; i < 6; ++i) v[i] += sigma[i] * random.normal();
    record.pose = Pose::from_vector(v);
    record.sigma = sigma.cwiseMax(1e-9);
    record.images = laboratory.options.photos_per_pose;
    record.markers = static_cast<int>(laboratory.rig.stickers.size());
    record.rms_px = 0;
  }
  return noisy;
}

void take_photographs(const fs::path& folder, const VirtualLaboratory& laboratory,
                      const std::vector<Shot>& shots, const SimulationProgress& progress) {
  if (progress) progress(0, static_cast<int>(shots.size()));
  const RayLattice lens(laboratory.camera);
  std::atomic<int> done = 0;
  tbb::parallel_for(std::size_t{0}, shots.size(), [&](std::size_t i) {
    write_jpeg(folder / shot_folder(shots[i]) / shots[i].file, photograph(laboratory, lens, shots[i]),
               laboratory.options.jpeg, shots[i].tags);
    if (progress) progress(++done, static_cast<int>(shots.size()));
  });
}

CalibratedCamera true_camera(const VirtualLaboratory& laboratory) {
  CalibratedCamera camera;
  camera.model = laboratory.camera;
  camera.setting.width_px = laboratory.camera.width_px;
  camera.setting.height_px = laboratory.camera.height_px;
  camera.setting.make = "NIKON CORPORATION";
  camera.setting.model = "NIKON D3200";
  camera.setting.focal_length_mm = laboratory.options.focal_mm;
  return camera;
}

}  // namespace

RoundResult write_campaign(const fs::path& folder, const VirtualLaboratory& laboratory,
                           const RoundOptions& options, const SimulationProgress& progress) {
  const Round round = move_machine(laboratory, options);
  std::vector<Shot> shots = pose_shots(laboratory, round.reached, options.round, 1);
  if (options.round == 0) {
    const std::vector<Shot> sheet = calibration_shots(laboratory, static_cast<int>(shots.size()) + 1);
    shots.insert(shots.end(), sheet.begin(), sheet.end());
  }
  if (options.edit_shots) options.edit_shots(shots);
  std::vector<std::pair<fs::path, std::string>> files;
  const auto write = [&](const char* name, std::string text) {
    files.emplace_back(folder / name, std::move(text));
  };
  const std::string& head = options.head;
  write("campaign.yaml", head + campaign_text(laboratory));
  write("hexapod.yaml", hexapod_text(head, laboratory.machine.nominal));
  write("targets.csv", format_pose_table(head, round.targets, PoseColumns::target));
  write("legs.csv", format_leg_table(head, round.commands, false));
  write("markers_nominal.csv", head + nominal_points(laboratory));
  write("sheet.yaml", format_sheet_file(head, {laboratory.options.sheet}));
  const std::string camera = format_camera_file(head, true_camera(laboratory));
  if (options.true_camera) write("camera.yaml", camera);
  if (options.pose_noise_mm || options.pose_noise_rad) {
    write("results/poses.csv",
          format_pose_table(head, noisy_poses(laboratory, options, round.true_poses), PoseColumns::measured));
  }
  write("truth/camera.yaml", camera);
  write("truth/poses.csv", format_pose_table(head, round.true_poses, PoseColumns::predicted));
  write("truth/machine.yaml", hexapod_text(head, laboratory.machine.as_built));
  write("truth/markers.csv", head + true_markers(laboratory));
  write("truth/simulation.yaml", format_simulation_file(head, laboratory.options));
  RoundResult result;
  result.skipped = round.skipped;
  if (options.images) {
    result.photographs = static_cast<int>(shots.size());
    write("truth/photos.csv", head + true_stations(shots));
    write("truth/observations.csv", head + true_observations(laboratory, shots));
    for (const Shot& shot : shots) require_writable(folder / shot_folder(shot) / shot.file, "");
  }
  write_files_atomically(files);
  if (!options.images) return result;
  take_photographs(folder, laboratory, shots, progress);
  return result;
}

}  // namespace hexcal
