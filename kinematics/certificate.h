#pragma once

#include <string>
#include <vector>

#include "kinematics/sampling.h"

namespace hexcal {

enum class CertificateStatus {
  unique,     ///< proven: the pose is the only one in the box with these leg lengths
  several,    ///< proven: there are others in the box; they are listed
  none,       ///< proven: no pose in the box has these leg lengths
  undecided,  ///< the search ran out of boxes, or met a pose too near a singularity to be told apart
};

[[nodiscard]] const char* name(CertificateStatus status);

struct CertificateOptions {
  std::size_t largest_boxes = 300000;  ///< boxes looked at before the search gives up
  double smallest_mm = 1e-6;           ///< a box smaller than this that is not decided is given up

  /// Throws InputError naming the field.
  void validate() const;
};

struct Certificate {
  CertificateStatus status = CertificateStatus::undecided;
  std::string reason;       ///< when undecided
  std::vector<Pose> poses;  ///< every pose proven to be in the box, the one nearest to the given pose first
  std::size_t boxes = 0;    ///< boxes looked at
};

/// Proves how many poses of the box (parameters of LG, CONVENTIONS.md) have these actuator lengths, by
/// interval branch and prune: the Hansen-Sengupta form of the interval Newton method (Neumaier 1990,
/// sec. 5.1; Merlet 2004 for this use), preconditioned by the midpoint's inverse Jacobian, with outward
/// rounding. `pose` is the pose believed to be the one; it only speeds the search up. The lengths are taken
/// as exact, the joints as known to a few units in the last place. A machine with a screw lead is not
/// handled: undecided, with that reason.
[[nodiscard]] Certificate certify(const PlatformGeometry& geometry, const LegVector& lengths_mm,
                                  const Pose& pose, const PoseBox& box,
                                  const CertificateOptions& options = {});

/// +-150 mm and +-20 deg about home.
[[nodiscard]] PoseBox default_certificate_box();

}  // namespace hexcal
