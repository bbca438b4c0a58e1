#pragma once

#include <filesystem>
#include <string>

#include "tools/synthetic/simulation.h"

namespace hexcal {

/// truth/simulation.yaml: the options a campaign was made with, from which `simulate --from` builds the same
/// hidden machine, markers and camera again.
[[nodiscard]] std::string format_simulation_file(const std::string& head, const SimulationOptions& options);
[[nodiscard]] SimulationOptions read_simulation_file(const std::filesystem::path& path);

}  // namespace hexcal
