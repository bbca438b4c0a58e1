#include "camera_calib/choose_model.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hexcal {
namespace {

constexpr std::size_t kLeastLeftOut = 5;  // fewer left out one by one say little

CameraVariant with_terms(LensModel lens, const std::vector<std::string>& held) {
  CameraVariant variant;
  variant.lens = lens;
  const auto& names = camera_parameter_names(lens);
  for (std::size_t i = 0; i < names.size(); ++i) {
    variant.free_parameters.push_back(i != 1 && std::find(held.begin(), held.end(), names[i]) == held.end());
  }
  return variant;
}

// Terms that a variant holds are zero, whatever the state had.
CalibrationState for_variant(const CalibrationState& state, const CameraVariant& variant) {
  CalibrationState out = state;
  out.camera = converted_camera(state.camera, variant.lens);
  for (std::size_t i = 1; i < variant.free_parameters.size(); ++i) {
    if (!variant.free_parameters[i]) out.camera.parameters[static_cast<Eigen::Index>(i)] = 0;
  }
  if (variant.board == BoardFreedom::ideal) out.shapes.assign(state.shapes.size(), {});
  return out;
}

SheetAdjustmentOptions trial_options(const CameraVariant& variant, double sigma_px) {
  SheetAdjustmentOptions options = variant.adjustment_options(sigma_px);
  options.with_left_out = true;
  options.function_tolerance = 1e-7;
  return options;
}

// Thin-prism terms trade against the principal point and against sheets that bend from photograph to
// photograph: they must gain a tenth in px, not a hundredth.
double handicap(const CameraVariant& variant) {
  const bool prism = variant.lens == LensModel::rational && variant.free_parameters.back() != 0;
  return prism ? 1.1 * 1.1 : 1.0;
}

// Chi^2 of the photographs left out, of two trials, photograph by photograph.
struct Difference {
  double sum = 0;    // the poorer one's minus the better one's
  double sigma = 0;  // of the sum, from how photographs differ in it
};

Difference left_out_difference(const ModelTrial& poorer, const ModelTrial& better) {
  Difference out;
  const auto n = static_cast<double>(better.left_out_chi2.size());
  std::vector<double> differences;
  for (std::size_t i = 0; i < better.left_out_chi2.size(); ++i) {
    differences.push_back(handicap(poorer.variant) * poorer.left_out_chi2[i] -
                          handicap(better.variant) * better.left_out_chi2[i]);
    out.sum += differences.back();
  }
  double squares = 0;
  for (const double d : differences) squares += std::pow(d - out.sum / n, 2);
  out.sigma = std::sqrt(n * squares / (n - 1));
  return out;
}

double left_out_sum(const ModelTrial& trial) {
  double sum = 0;
  for (const double chi2 : trial.left_out_chi2) sum += chi2;
  return trial.left_out_chi2.empty() ? std::numeric_limits<double>::infinity() : sum;
}

}  // namespace

std::vector<CameraVariant> lens_variants(std::optional<LensModel> lens) {
  std::vector<CameraVariant> all{with_terms(LensModel::brown, {"k3"}),
                                 with_terms(LensModel::brown, {}),
                                 with_terms(LensModel::radial, {"a4", "a5", "a6"}),
                                 with_terms(LensModel::radial, {"a5", "a6"}),
                                 with_terms(LensModel::radial, {}),
                                 with_terms(LensModel::rational, {"s1", "s2", "s3", "s4"}),
                                 with_terms(LensModel::rational, {})};
  if (lens) std::erase_if(all, [lens](const CameraVariant& v) { return v.lens != *lens; });
  return all;
}

std::string variant_name(const CameraVariant& variant) {
  std::vector<std::string> terms;
  const auto& names = camera_parameter_names(variant.lens);
  for (std::size_t i = 1; i < names.size(); ++i) {
    const bool lens_term = i >= CameraModel::kNumPinhole || i == 1;
    if (lens_term && variant.free_parameters[i]) terms.push_back(names[i]);
  }
  return fmt::format("{} {}, sheet {}", lens_model_name(variant.lens), fmt::join(terms, " "),
                     board_freedom_name(variant.board));
}

std::vector<ModelTrial> try_variants(const std::vector<Sheet>& sheets, const CalibrationState& state,
                                     double sigma_px, const std::vector<CameraVariant>& variants) {
  std::vector<ModelTrial> trials(variants.size());
  tbb::parallel_for(std::size_t{0}, variants.size(), [&](std::size_t i) {
    const SheetAdjustmentResult fit =
        adjust_sheets(sheets, for_variant(state, variants[i]), trial_options(variants[i], sigma_px));
    ModelTrial& trial = trials[i];
    trial.variant = variants[i];
    trial.name = variant_name(variants[i]);
    trial.chi2 = fit.chi2;
    trial.unknowns = fit.unknowns;
    const double k = fit.unknowns;
    const double left = fit.observations - k - 1;
    trial.aicc = std::numeric_limits<double>::infinity();
    if (!fit.converged) return;
    if (left > 0) trial.aicc = fit.chi2 + 2 * k + 2 * k * (k + 1) / left;
    trial.left_out_chi2 = fit.left_out_chi2;
    if (!trial.left_out_chi2.empty()) {
      trial.cross_validation_px = fit.rms_px() * std::sqrt(left_out_sum(trial) / std::max(fit.chi2, 1e-300));
    }
  });
  double best = std::numeric_limits<double>::infinity();
  for (const ModelTrial& trial : trials) best = std::min(best, trial.aicc);
  for (ModelTrial& trial : trials) trial.aicc -= best;
  return trials;
}

std::size_t choose_trial(std::vector<ModelTrial>& trials) {
  const auto by_aicc = [](const ModelTrial& a, const ModelTrial& b) { return a.aicc < b.aicc; };
  const auto by_left_out = [](const ModelTrial& a, const ModelTrial& b) {
    return handicap(a.variant) * left_out_sum(a) < handicap(b.variant) * left_out_sum(b);
  };
  const bool validated = std::any_of(trials.begin(), trials.end(), [](const ModelTrial& trial) {
    return trial.left_out_chi2.size() >= kLeastLeftOut;
  });
  auto chosen = validated ? std::min_element(trials.begin(), trials.end(), by_left_out)
                          : std::min_element(trials.begin(), trials.end(), by_aicc);
  if (validated) {
    const auto best = chosen;
    for (auto at = trials.begin(); at != trials.end(); ++at) {
      if (at->unknowns >= chosen->unknowns || at->left_out_chi2.size() != best->left_out_chi2.size())
        continue;
      const Difference difference = left_out_difference(*at, *best);
      if (difference.sum < difference.sigma) chosen = at;
    }
  }
  chosen->chosen = true;
  return static_cast<std::size_t>(chosen - trials.begin());
}

}  // namespace hexcal
