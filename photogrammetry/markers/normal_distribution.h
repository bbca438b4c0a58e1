#pragma once

namespace hexcal {

/// Value of the normal distribution function and its density at one argument.
struct NormalValue {
  double cdf;
  double density;
};

/// Both to 1e-8, from a table; beyond +-6 the limits.
[[nodiscard]] NormalValue standard_normal(double x);

/// P(X < a, Y < b) of two standard normal variables with correlation rho, |rho| < 0.999, to 1e-6. Small
/// correlations by the tetrachoric series (Pearson 1900), others by Gauss-Legendre quadrature of Plackett's
/// formula (Genz 2004). `at_a` and `at_b` are standard_normal(a) and (b).
[[nodiscard]] double bivariate_normal_cdf(double a, double b, double rho, const NormalValue& at_a,
                                          const NormalValue& at_b);

}  // namespace hexcal
