#pragma once

#include <string>
#include <vector>

#include "calibration/identify.h"

namespace hexcal {

/// One identified number in its printed unit.
struct ParameterReport {
  std::string name;
  std::string unit;
  double value = 0;      ///< correction of the nominal value
  double sigma = 0;      ///< after the measurement
  double tolerance = 0;  ///< before it; infinite for frames
};

struct CorrelatedPair {
  std::string a, b;
  double correlation = 0;
};

/// A combination of parameters about which the poses say less than the tolerances.
struct WeakDirection {
  double gain = 0;  ///< tolerance over the sigma the data alone give; below 1 the tolerance decides
  std::vector<std::string> parameters;  ///< those with the largest shares
};

/// The state of one leg in a sentence.
struct LegDiagnosis {
  int leg = 0;  ///< 1 to 6
  double largest_effect_mm = 0;
  bool wrong = false;    ///< a number is significantly off, and five times as far as the other legs' median
  std::string sentence;  ///< "leg 1: scale -6.0 % +- 0.1 %"
};

/// What to do about a drift (identify.h).
inline constexpr const char* kDriftInstruction =
    "let the machine warm up, fasten base and cameras' targets, photograph home again at the end and measure "
    "once more";

struct Identifiability {
  int free_parameters = 0;
  int rank = 0;          ///< of the whitened Jacobian with columns scaled to length 1
  int determined = 0;    ///< combinations known better by the data than by the tolerances
  double condition = 0;  ///< of the determined part of the scaled Jacobian
  std::vector<ParameterReport> parameters;
  std::vector<CorrelatedPair> correlations;  ///< |r| above 0.95, strongest first, at most ten
  std::vector<WeakDirection> weak;           ///< weakest first, at most ten
  std::string advice;  ///< which poses would determine most of what is weak; empty when nothing is
  std::vector<LegDiagnosis> legs;
  /// What the model has beyond geometry, a sentence each: "backlash of the legs 0.049 0.051 ... mm +- 0.002
  /// mm", stroke curves, sag.
  std::vector<std::string> beyond_geometry;
};

[[nodiscard]] Identifiability judge_identifiability(const PlatformGeometry& nominal,
                                                    const IdentifyResult& identified);

}  // namespace hexcal
