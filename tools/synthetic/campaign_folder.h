#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/io/pose_table.h"
#include "tools/synthetic/simulation.h"

namespace hexcal {

/// What a call of `hexcal simulate` asks for beside the laboratory.
struct RoundOptions {
  std::optional<std::vector<PoseRecord>> targets;  ///< default: random ones
  std::optional<std::vector<LegRecord>> commands;  ///< default: inverse kinematics of the drawing
  std::uint64_t round = 0;
  bool images = true;
  bool true_camera = false;             ///< camera.yaml beside campaign.yaml, as if calibrated without error
  std::optional<double> pose_noise_mm;  ///< writes results/poses.csv: true poses with this noise per axis
  std::optional<double> pose_noise_rad;
  std::function<void(std::vector<Shot>&)> edit_shots;  ///< faults for tests
  std::string head;                                    ///< first comment line of every file
};

struct RoundResult {
  int photographs = 0;
  std::vector<std::string> skipped;  ///< "p003: out of stroke", ...
};

/// Called with photographs done and in all: once with 0 before the first, then possibly from several threads.
using SimulationProgress = std::function<void(int done, int total)>;

/// Writes a campaign folder (campaign.yaml, hexapod.yaml, targets.csv, legs.csv, markers_nominal.csv,
/// sheet.yaml, poses/, calibration/) with its truth in truth/.
[[nodiscard]] RoundResult write_campaign(const std::filesystem::path& folder,
                                         const VirtualLaboratory& laboratory, const RoundOptions& options,
                                         const SimulationProgress& progress = {});

}  // namespace hexcal
