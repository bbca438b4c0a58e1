#pragma once

#include <filesystem>
#include <string>

#include "kinematics/platform.h"

namespace hexcal {

/// A machine whose joints stand in pairs on two circles: base pairs about 0, 120 and 240 deg, platform pairs
/// about 60, 180 and 300 deg; leg 1 from the base pair at 0 to the platform pair at 60, and so on round.
struct SymmetricHexapod {
  double base_radius_mm = 0;
  double base_pair_mm = 0;  ///< between the two joints of a pair
  double platform_radius_mm = 0;
  double platform_pair_mm = 0;
  double shortest_mm = 0, longest_mm = 0;  ///< of a leg, joint centre to joint centre
};

/// Six numbers with commas, in the order of the fields. Throws InputError.
[[nodiscard]] SymmetricHexapod parse_symmetric_hexapod(const std::string& text);

/// Home at the middle of the strokes; LG at O_P. Throws InputError for what no machine can be.
[[nodiscard]] PlatformGeometry symmetric_hexapod(const SymmetricHexapod& machine, double gd_mm);

/// From a table of joints leg,body,x_mm,y_mm,z_mm with body `base` (in B) or `platform` (in P); home is where
/// all legs are `shortest,longest`'s mean long on average, straight above. Throws InputError.
[[nodiscard]] PlatformGeometry hexapod_of_joints(const std::filesystem::path& joints,
                                                 const std::string& leg_mm, double gd_mm);

}  // namespace hexcal
