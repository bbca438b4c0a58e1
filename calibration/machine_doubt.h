#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/method_comparison.h"

namespace hexcal {

/// Why measured poses and hexapod.yaml cannot speak of one machine, so that no command may follow from them.
struct MachineDoubt {
  std::string evidence;     ///< what contradicts, with figures
  std::string slip;         ///< the usual slip without which the contradiction is gone; empty where none is
  std::string instruction;  ///< in the imperative

  /// "evidence: slip".
  [[nodiscard]] std::string cause() const { return slip.empty() ? evidence : evidence + ": " + slip; }
};

/// What calibrate has found so far.
struct DoubtRequest {
  const PlatformGeometry* nominal = nullptr;
  const ObservationSet* observations = nullptr;           ///< near-singular outliers left out
  const ObservationSet* seen = nullptr;                   ///< the same in the hexapod's frames
  const std::vector<std::string>* unexplained = nullptr;  ///< poses that fit no method
  const MethodComparison* comparison = nullptr;
  bool frames_unknown = false;
};

/// Tests what every compensation assumes: that the machine stood about where it was sent, that a model
/// explains where it stood, and that the identified machine still resembles its drawing. Beyond a stated
/// share of the distances between the targets (or of the platform's size) that is no bad machine but a slip.
/// Where one of suspect_conventions (or unknown frames) makes nearly all of a contradiction vanish, it is
/// named, and then far smaller contradictions count. Nothing where all is plausible.
[[nodiscard]] std::optional<MachineDoubt> doubt_machine(const DoubtRequest& request);

}  // namespace hexcal
