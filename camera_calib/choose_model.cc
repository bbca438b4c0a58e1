#include "camera_calib/choose_model.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace hexcal {
namespace {

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

SheetAdjustmentOptions options_of(const CameraVariant& variant, double sigma_px) {
  SheetAdjustmentOptions options;
  options.board = variant.board;
  options.free_parameters = variant.free_parameters;
  options.extra_sigma_px = sigma_px;
  options.with_covariance = false;
  options.function_tolerance = 1e-7;
  return options;
}

// Thin-prism terms trade against the principal point and against sheets that bend from photograph to
// photograph: they must gain a tenth, not a hundredth.
double needed_gain(const CameraVariant& variant) {
  const bool prism = variant.lens == LensModel::rational && variant.free_parameters.back() != 0;
  return prism ? 1.1 : 1.0;
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
  std::vector<ModelTrial> trials;
  double best = std::numeric_limits<double>::infinity();
  for (const CameraVariant& variant : variants) {
    const SheetAdjustmentResult fit =
        adjust_sheets(sheets, for_variant(state, variant), options_of(variant, sigma_px));
    ModelTrial trial;
    trial.variant = variant;
    trial.name = variant_name(variant);
    trial.chi2 = fit.chi2;
    trial.unknowns = fit.unknowns;
    const double k = fit.unknowns;
    const double left = fit.observations - k - 1;
    trial.aicc = fit.converged && left > 0 ? fit.chi2 + 2 * k + 2 * k * (k + 1) / left
                                           : std::numeric_limits<double>::infinity();
    best = std::min(best, trial.aicc);
    trials.push_back(std::move(trial));
  }
  for (ModelTrial& trial : trials) trial.aicc -= best;
  return trials;
}

double cross_validation_px(const std::vector<Sheet>& sheets, const CalibrationState& state,
                           const CameraVariant& variant, double sigma_px, int folds) {
  std::set<int> photographs;
  for (const SheetView& view : state.views) photographs.insert(view.photograph);
  std::vector<int> order(photographs.begin(), photographs.end());
  double sum = 0;
  double count = 0;
  for (int fold = 0; fold < folds; ++fold) {
    std::set<int> out;
    for (std::size_t i = static_cast<std::size_t>(fold); i < order.size();
         i += static_cast<std::size_t>(folds)) {
      out.insert(order[i]);
    }
    const CalibrationState start = for_variant(state, variant);
    const SheetAdjustmentResult fit =
        adjust_sheets(sheets, views_where(start, [&out](int p) { return out.count(p) == 0; }),
                      options_of(variant, sigma_px));
    CalibrationState held = views_where(start, [&out](int p) { return out.count(p) != 0; });
    if (!fit.converged || held.views.empty()) return std::numeric_limits<double>::infinity();
    held.camera = fit.state.camera;
    held.shapes = fit.state.shapes;
    SheetAdjustmentOptions poses = options_of(variant, sigma_px);
    poses.only_poses = true;
    const SheetAdjustmentResult check = adjust_sheets(sheets, held, poses);
    for (std::size_t v = 0; v < check.state.views.size(); ++v) {
      for (std::size_t f = 0; f < check.residuals_px[v].size(); ++f) {
        if (check.state.views[v].rejected[f] != 0) continue;
        sum += check.residuals_px[v][f].squaredNorm();
        count += static_cast<double>(check.residuals_px[v][f].size()) / 2;
      }
    }
  }
  return std::sqrt(sum / std::max(count, 1.0));
}

std::size_t choose_trial(const std::vector<Sheet>& sheets, const CalibrationState& state, double sigma_px,
                         int folds, std::vector<ModelTrial>& trials) {
  std::vector<std::size_t> order(trials.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&trials](std::size_t a, std::size_t b) { return trials[a].aicc < trials[b].aicc; });
  std::size_t chosen = order.front();
  std::set<int> photographs;
  for (const SheetView& view : state.views) photographs.insert(view.photograph);
  // Errors that photographs share make AICc favour the richer model: only a poorer one can still win.
  std::vector<std::size_t> rivals{chosen};
  for (const std::size_t i : order) {
    if (rivals.size() < 3 && trials[i].unknowns < trials[rivals.back()].unknowns) rivals.push_back(i);
  }
  if (rivals.size() > 1 && static_cast<int>(photographs.size()) >= 2 * folds) {
    double best = std::numeric_limits<double>::infinity();
    for (const std::size_t i : rivals) {
      trials[i].cross_validation_px = cross_validation_px(sheets, state, trials[i].variant, sigma_px, folds);
      best = std::min(best, *trials[i].cross_validation_px * needed_gain(trials[i].variant));
    }
    chosen = *std::find_if(rivals.rbegin(), rivals.rend(),
                           [&](std::size_t i) { return *trials[i].cross_validation_px <= 1.01 * best; });
  }
  trials[chosen].chosen = true;
  return chosen;
}

}  // namespace hexcal
