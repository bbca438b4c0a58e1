#pragma once

#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "calibration/calibrate.h"
#include "tools/io/atomic_file.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/pose_table.h"

namespace hexcal {

inline PlatformGeometry sample_hexapod() {
  PlatformGeometry geometry;
  for (std::size_t i = 0; i < 6; ++i) {
    const double third = 120.0 * static_cast<double>(i / 2);
    const double base = (third + (i % 2 == 0 ? 10 : 110)) * kRadPerDeg;
    const double platform = (third + (i % 2 == 0 ? 45 : 75)) * kRadPerDeg;
    geometry.base_joints_mm[i] = {250 * std::cos(base), 250 * std::sin(base), 0};
    geometry.platform_joints_mm[i] = {150 * std::cos(platform), 150 * std::sin(platform), 0};
    geometry.actuators[i] = {0, 1, 300, 640};
  }
  geometry.B_from_UG = Rigid3::from_translation({0, 0, 550});
  geometry.P_from_LG = Rigid3::from_translation({0, 0, 70});
  geometry.gd_mm = 50;
  return geometry;
}

/// Files of a campaign without photographs: a machine with hidden errors of a few mm, measured with noise.
struct SampleCampaign {
  std::vector<PoseRecord> targets, measured;
};

inline SampleCampaign sample_campaign(int poses, unsigned seed = 66) {
  std::mt19937 random(seed);
  // Not std::uniform_real_distribution: its numbers differ between standard libraries.
  const auto uniform = [&random](double width) {
    return width * (2.0 * static_cast<double>(random()) / 4294967295.0 - 1.0);
  };
  const PlatformGeometry nominal = sample_hexapod();
  MachineModel machine;
  machine.geometry = nominal;
  for (std::size_t i = 0; i < 6; ++i) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      machine.geometry.base_joints_mm[i][k] += uniform(1.5);
      machine.geometry.platform_joints_mm[i][k] += uniform(1.5);
    }
    machine.geometry.actuators[i].offset_mm += uniform(2);
  }
  SampleCampaign campaign;
  for (int i = 0; i < poses; ++i) {
    PoseRecord target;
    target.id = "pose_" + std::to_string(i + 1);
    Vector6d v;
    for (Eigen::Index k = 0; k < 6; ++k) v[k] = k < 3 ? uniform(40) : uniform(12 * kRadPerDeg);
    target.pose = Pose::from_vector(v);
    campaign.targets.push_back(target);
    PoseRecord measured = target;
    measured.pose = machine_pose(
        machine, readings_from_lengths(nominal, leg_lengths(nominal, nominal.B_from_P(*target.pose))),
        *target.pose);
    Vector6d sigma;
    sigma << 0.002, 0.002, 0.004, 2e-5, 2e-5, 1e-5;
    Vector6d noisy = measured.pose->vector();
    for (Eigen::Index k = 0; k < 6; ++k) noisy[k] += 1.7 * uniform(sigma[k]);
    measured.pose = Pose::from_vector(noisy);
    measured.sigma = sigma;
    measured.images = 3;
    measured.markers = 9;
    measured.rms_px = 0.02;
    campaign.measured.push_back(measured);
  }
  return campaign;
}

inline void write_sample_campaign(const std::filesystem::path& folder, const SampleCampaign& campaign) {
  write_file_atomically(folder / "campaign.yaml",
                        "camera: camera.yaml\nhexapod: hexapod.yaml\ntargets: targets.csv\nimages: poses\n"
                        "markers:\n  family: tag36h11\n  fixed: {ids: [0-9], size_mm: 24}\n"
                        "  moving: {ids: [100-109], size_mm: 24}\n"
                        "frames:\n  UG: {from: nominal, file: markers.csv}\n"
                        "  LG: {from: home, pose: home, gd_mm: 50}\nscale: {from: markers}\n");
  write_file_atomically(folder / "markers.csv",
                        "id,corner,x_mm,y_mm,z_mm\n0,0,0,0,0\n1,0,50,0,0\n2,0,0,50,0\n");
  write_file_atomically(folder / "hexapod.yaml", hexapod_text("", sample_hexapod()));
  write_file_atomically(folder / "targets.csv", format_pose_table("", campaign.targets, PoseColumns::target));
  write_file_atomically(folder / "results" / "poses.csv",
                        format_pose_table("", campaign.measured, PoseColumns::measured));
}

}  // namespace hexcal
