#pragma once

namespace hexcal {

/// Upper quantile of chi^2 with `dof` degrees of freedom: exceeded with this probability, 0 < exceeded < 1.
[[nodiscard]] double chi2_quantile(int dof, double exceeded);

}  // namespace hexcal
