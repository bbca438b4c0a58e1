#pragma once

#include <optional>

#include "calibration/observation.h"

namespace hexcal {

struct AlignedFrames {
  Rigid3 B_from_UG;
  Rigid3 P_from_LG;
};

/// Place of the frame and of the target in which poses were measured, so that the nominal machine's forward
/// kinematics fits them: a first estimate for identification with unknown frames. Solves B_from_P_i X = Y
/// home_from_LG_i linearly (Shah, J. Mech. Robot. 5 (2013) 031007) where full poses turn about two axes, else
/// takes the nominal P_from_LG and fits positions only. Nothing when fewer than 3 poses can be used.
[[nodiscard]] std::optional<AlignedFrames> align_frames(const PlatformGeometry& nominal,
                                                        const ObservationSet& observations);

}  // namespace hexcal
