#pragma once

#include "calibration/identify.h"

namespace hexcal {

/// The parameters that identification with these options changes, and what is known of each beforehand.
struct FreeParameters {
  ParameterLayout layout;
  ParameterSelection selection;
  Eigen::VectorXd tolerances;        ///< prior sigma per free parameter; infinite for frames
  Eigen::VectorXd widest;            ///< per free parameter: wider than anything one could know of it
  std::vector<ParameterKind> kinds;  ///< per free parameter
};

[[nodiscard]] FreeParameters free_parameters(const IdentifyOptions& options);

}  // namespace hexcal
