#include "camera_calib/shared_errors.h"

#include <gtest/gtest.h>

#include "camera_calib/initial_camera.h"
#include "camera_calib/robust_fit.h"
#include "tests/support/synthetic_sheets.h"

namespace hexcal {
namespace {

SheetAdjustmentResult fit_of(const std::vector<SheetPhotograph>& photographs) {
  const std::vector<Sheet> sheets{synthetic_aprilgrid()};
  const CalibrationState start = initial_state(sheets, photographs, 6016, 4000, std::nullopt);
  const RobustFitResult first = first_fit(sheets, start);
  return robust_fit(sheets, first.adjustment.state,
                    {LensModel::radial, all_but_affinity(LensModel::radial), BoardFreedom::ideal},
                    first.extra_sigma_px)
      .adjustment;
}

// The factor is a ratio of two estimates, the largest of three: single ones scatter.
TEST(SharedErrors, IndependentNoiseIsHardlyWidened) {
  SyntheticSheets synthetic;
  synthetic.camera = profile_camera();
  synthetic.sigma_px = 0.01;
  constexpr int kRuns = 8;
  double sum = 0;
  for (int run = 0; run < kRuns; ++run) {
    synthetic.seed = static_cast<unsigned>(1 + run);
    const SheetAdjustmentResult fit = fit_of(synthetic_photographs(synthetic_aprilgrid(), synthetic));
    ASSERT_TRUE(fit.converged);
    sum += fit.shared_errors.largest();
  }
  EXPECT_LT(sum / kRuns, 1.3);
}

TEST(SharedErrors, ASheetThatBendsAnewInEveryPhotographWidensTheSigmas) {
  SyntheticSheets synthetic;
  synthetic.camera = profile_camera();
  synthetic.sigma_px = 0.01;
  std::vector<SheetPhotograph> photographs;
  std::mt19937 random(5);
  for (int p = 0; p < synthetic.photographs; ++p) {
    synthetic.shape.deformation[2] = 0.1 * gaussian(random);
    synthetic.shape.deformation[4] = 0.1 * gaussian(random);
    photographs.push_back(
        synthetic_photographs(synthetic_aprilgrid(), synthetic)[static_cast<std::size_t>(p)]);
  }
  const SheetAdjustmentResult fit = fit_of(photographs);
  ASSERT_TRUE(fit.converged);
  EXPECT_GT(fit.shared_errors.photographs, 1.5);
}

}  // namespace
}  // namespace hexcal
