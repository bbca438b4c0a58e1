#include <gmock/gmock.h>

#include <limits>

#include "kinematics/certificate.h"
#include "kinematics/forward.h"
#include "kinematics/sampling.h"
#include "kinematics/singularity.h"
#include "kinematics/workspace.h"
#include "tests/support/error_matchers.h"

namespace hexcal {
namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

TEST(KinematicsOptions, AreRefusedByName) {
  expect_option_refused<ForwardOptions>("ForwardOptions.tolerance_mm must not be negative",
                                        [](auto& o) { o.tolerance_mm = kNoNumber; });
  expect_option_refused<ForwardOptions>("ForwardOptions.max_iterations must be at least 1",
                                        [](auto& o) { o.max_iterations = 0; });
  expect_option_refused<ForwardOptions>("ForwardOptions.smallest_step must lie in (0, 1)",
                                        [](auto& o) { o.smallest_step = 1; });
  expect_option_refused<CertificateOptions>("CertificateOptions.largest_boxes must be at least 1",
                                            [](auto& o) { o.largest_boxes = 0; });
  expect_option_refused<CertificateOptions>("CertificateOptions.smallest_mm must be greater than zero",
                                            [](auto& o) { o.smallest_mm = 0; });
  expect_option_refused<SingularityOptions>("characteristic_length_mm must not be negative",
                                            [](auto& o) { o.characteristic_length_mm = -1; });
  expect_option_refused<SingularityOptions>("near_mm must not be negative",
                                            [](auto& o) { o.near_mm = kNoNumber; });
  expect_option_refused<SingularityOptions>("near_deg must not be negative",
                                            [](auto& o) { o.near_deg = -1; });
  expect_option_refused<SingularityOptions>("near_gain must be at least 1",
                                            [](auto& o) { o.near_gain = 0.5; });
}

TEST(KinematicsOptions, OfAWorkspaceAreRefusedByName) {
  expect_option_refused<SliceOptions>("SliceOptions.axis_u must lie in 0..5", [](auto& o) { o.axis_u = 6; });
  expect_option_refused<SliceOptions>("SliceOptions.axis_v must lie in 0..5 and differ from axis_u",
                                      [](auto& o) { o.axis_v = o.axis_u; });
  expect_option_refused<SliceOptions>("a range must be finite and not reversed",
                                      [](auto& o) { o.u_low = o.u_high + 1; });
  expect_option_refused<SliceOptions>("u_count and v_count must be at least 1",
                                      [](auto& o) { o.v_count = 0; });
  expect_option_refused<SliceOptions>("SliceOptions.threads must be 1 to 256",
                                      [](auto& o) { o.threads = 0; });
  expect_option_refused<BoxOptions>("BoxOptions.grid must be at least 2", [](auto& o) { o.grid = 1; });
  expect_option_refused<BoxOptions>("BoxOptions.rpy_rad is not finite",
                                    [](auto& o) { o.rpy_rad[1] = kNoNumber; });
  expect_option_refused<SampleOptions>("PoseMargins.stroke_mm must not be negative",
                                       [](auto& o) { o.margins.stroke_mm = -1; });
  expect_option_refused<SampleOptions>("SampleOptions.load_fraction must lie in (0, 1]",
                                       [](auto& o) { o.load_fraction = 1.5; });
  expect_option_refused<SampleOptions>("SampleOptions.box must have finite upper values", [](auto& o) {
    o.box.emplace();
    o.box->upper.setConstant(kNoNumber);
  });
}

}  // namespace
}  // namespace hexcal
