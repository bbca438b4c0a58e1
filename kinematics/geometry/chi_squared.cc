#include "kinematics/geometry/chi_squared.h"

#include <boost/math/distributions/chi_squared.hpp>

namespace hexcal {

double chi2_quantile(int dof, double exceeded) {
  return boost::math::quantile(boost::math::complement(boost::math::chi_squared(dof), exceeded));
}

}  // namespace hexcal
