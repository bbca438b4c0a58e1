#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "calibration/machine_parameters.h"
#include "calibration/observation.h"

namespace hexcal {

/// Standard deviation that a parameter of each kind may have about its nominal value.
struct Tolerances {
  double joint_mm = 3;
  double offset_mm = 3;
  double scale = 0.02;
  double lead_mm = 5;
  double curve_mm = 0.3;
  double sag_mm = 0.3;
  double backlash_mm = 0.2;
};

struct IdentifyOptions {
  bool scales = true;           ///< six actuator scales
  bool geometry = true;         ///< 36 joint coordinates; without, offsets (and scales) only
  bool frames_unknown = false;  ///< poses measured in a frame and on a target of unknown place: 12 more
  bool screw_lead = false;
  int curve_terms = 0;                         ///< Legendre terms of a smooth error along each leg's stroke
  bool sag = false;                            ///< legs give under the moving mass
  bool backlash = false;                       ///< play of each leg, by PoseObservation::approach
  std::set<std::string> fixed;                 ///< names (parameter_name) held at nominal
  std::vector<std::vector<std::string>> tied;  ///< names that share one correction
  Tolerances tolerances;
  /// Scale each tolerance to what the data say of its kind (MacKay's evidence update); off where the
  /// tolerances are drawing tolerances that one trusts.
  bool adapt_tolerances = true;
  /// Noise of a leg beyond the measured poses (repeatability, what the model lacks), mm. Estimated from the
  /// residuals from this start value if estimate_leg_sigma.
  double leg_sigma_mm = 0.001;
  bool estimate_leg_sigma = true;
  bool robust = true;  ///< down-weight poses whose residual does not fit the others
  int max_iterations = 120;

  /// Throws InputError naming the field, or a parameter that does not exist.
  void validate() const;
};

enum class IdentifyStatus { failed, identified };

/// A slow common motion of the machine's base against the measuring frame while the poses were measured: a
/// base that moved, a frame that warmed up. Linear in the order of the poses.
struct Drift {
  Vector6d motion =
      Vector6d::Zero();  ///< of UG in B from the first pose to the last (covariance.h), mm and rad
  double f = 0;  ///< mean square of what it explains over that of what it leaves (6 numbers; an F test)

  /// "the machine moved by 0.61 mm and 0.02 deg against the measuring frame from the first pose to the last".
  [[nodiscard]] std::string sentence() const;
};

struct IdentifyResult {
  IdentifyStatus status = IdentifyStatus::failed;
  std::string reason = "not called";
  int iterations = 0;
  MachineModel machine;

  ParameterLayout layout;
  ParameterSelection selection;
  Eigen::VectorXd corrections;       ///< layout.size(), about the nominal machine
  Eigen::VectorXd tolerances;        ///< prior sigma per free parameter; infinite for frames
  Eigen::MatrixXd covariance;        ///< of the free parameters, after priors
  Eigen::MatrixXd data_information;  ///< of the free parameters, without priors
  Eigen::Matrix<double, 6, 2> stroke_range;

  /// sqrt(whitened squares / redundancy); 1 when residuals are as large as their sigmas say.
  double sigma0 = 0;
  /// The same before leg_sigma_mm was raised to explain what the sigmas do not.
  double sigma0_of_measurement = 0;
  double effective_parameters = 0;  ///< how many the data determine rather than the tolerances
  double leg_sigma_mm = 0;
  double position_sigma_mm = 0;  ///< noise of the measurement; estimated when it was not known
  double orientation_sigma_rad = 0;
  /// Where the residuals follow the order of the poses beyond chance (one set in 10,000).
  std::optional<Drift> drift;
  std::vector<LegVector> leg_residuals_mm;
  std::vector<Vector6d> pose_residuals;  ///< measured minus modelled pose, first order, mm and rad
  std::vector<double> weights;           ///< of the poses, 1 = full
  std::vector<double> influence;         ///< share of each pose in the effective parameters
};

/// Identifies the machine from measured poses by least squares of leg residuals whitened with
///   J Cov(pose) J^T + sigma_l^2 I
/// (to first order the forward-kinematic pose residual; leg residuals: Zhuang, Yan and Masory, J. Robot.
/// Syst. 15 (1998) 395), with tolerances as priors. Gauss-Newton on analytic Jacobians; noise that is not
/// known (of the legs, and without given covariances of positions and angles too) is estimated by restricted
/// maximum likelihood (Foerstner's iteration), tolerances by evidence
/// (MacKay, Neural Comput. 4 (1992) 415). With unknown frames the gauge is that of least corrections of the
/// joints (in units of their tolerance) to nominal. What the residuals have in common with the order of the
/// poses is tested (Drift), not modelled. `start`: where the iterations begin, what was identified
/// with the same nominal machine and options from nearly the same observations; a few iterations are then
/// enough.
[[nodiscard]] IdentifyResult identify(const PlatformGeometry& nominal, const ObservationSet& observations,
                                      const IdentifyOptions& options = {},
                                      const IdentifyResult* start = nullptr);

}  // namespace hexcal
