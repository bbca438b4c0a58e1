#include "camera_calib/calibrate_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "camera_calib/choose_model.h"
#include "camera_calib/initial_camera.h"
#include "camera_calib/projection_difference.h"
#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

std::size_t photographs_in(const CalibrationState& state) {
  std::set<int> seen;
  for (const SheetView& view : state.views) seen.insert(view.photograph);
  return seen.size();
}

// Rays beyond those of the frame's corners, by a tenth, have no data behind them.
double radius_of_frame(const CameraModel& camera) {
  double radius = 0;
  for (const double x : {0.0, camera.width_px - 1.0}) {
    for (const double y : {0.0, camera.height_px - 1.0}) {
      const auto n = camera.normalised_from_image({x, y});
      if (!n) return std::numeric_limits<double>::infinity();
      radius = std::max(radius, n->norm());
    }
  }
  return 1.1 * radius;
}

std::vector<CameraVariant> with_board(std::vector<CameraVariant> variants, BoardFreedom board) {
  for (CameraVariant& variant : variants) variant.board = board;
  return variants;
}

// Lenses that need not be tried again with another freedom of the sheets are left out.
std::vector<CameraVariant> hopeful(const std::vector<ModelTrial>& trials) {
  constexpr double kHopeless = 2;  // times the best one's error of prediction
  double best = std::numeric_limits<double>::infinity();
  for (const ModelTrial& trial : trials) best = std::min(best, trial.cross_validation_px.value_or(best));
  std::vector<CameraVariant> out;
  for (const ModelTrial& trial : trials) {
    if (trial.cross_validation_px.value_or(0) <= kHopeless * best) out.push_back(trial.variant);
  }
  return out;
}

// Each sheet's points seen by enough photographs to be freed.
bool points_can_be_free(const CalibrationState& state) { return photographs_in(state) >= 5; }

}  // namespace

void CameraCalibrationOptions::validate() const {
  if (f_hint_px && !(*f_hint_px > 0)) {
    throw InputError(fmt::format("calibrate: f_hint_px is {}, wanted more than 0", *f_hint_px));
  }
}

CameraCalibration rough_calibration(const std::vector<Sheet>& sheets,
                                    const std::vector<SheetPhotograph>& photographs,
                                    const CameraCalibrationOptions& options) {
  options.validate();
  CameraCalibration out;
  int width = 0;
  int height = 0;
  for (const SheetPhotograph& photograph : photographs) {
    if (photograph.features.empty()) continue;
    width = photograph.info.width_px;
    height = photograph.info.height_px;
  }
  if (width == 0) {
    out.reason = "no sheet was found in any photograph";
    return out;
  }
  const CalibrationState start = initial_state(sheets, photographs, width, height, options.f_hint_px);
  if (photographs_in(start) < 3) {
    out.status = CalibrationStatus::too_few_photographs;
    out.reason = fmt::format("{} photograph{} with a sheet in it, wanted at least 3 and better 10 to 20",
                             photographs_in(start), photographs_in(start) == 1 ? "" : "s");
    return out;
  }
  out.fit = first_fit(sheets, start);
  out.variant = {LensModel::brown, all_but_affinity(LensModel::brown), BoardFreedom::ideal};
  // Odd powers matter inside a marker near the principal point: the second measurement needs them.
  if (out.fit.adjustment.converged && photographs_in(start) >= 5) {
    const CameraVariant radial{LensModel::radial, all_but_affinity(LensModel::radial), BoardFreedom::ideal};
    const RobustFitResult richer =
        robust_fit(sheets, out.fit.adjustment.state, radial, out.fit.extra_sigma_px,
                   {.rounds = 2, .with_covariance = false});
    if (richer.adjustment.converged) {
      out.fit = richer;
      out.variant = radial;
    }
  }
  out.status = out.fit.adjustment.converged ? CalibrationStatus::ok : CalibrationStatus::no_solution;
  if (out.status != CalibrationStatus::ok)
    out.reason = "the adjustment found no camera that fits these photographs";
  return out;
}

CalibrationState with_features(const CalibrationState& state,
                               const std::vector<SheetPhotograph>& photographs) {
  CalibrationState out = state;
  for (SheetView& view : out.views) {
    view.features.clear();
    for (const FeatureObservation& feature :
         photographs[static_cast<std::size_t>(view.photograph)].features) {
      if (feature.sheet == view.sheet && feature.status == MarkerStatus::ok) view.features.push_back(feature);
    }
    view.rejected.assign(view.features.size(), 0);
  }
  std::erase_if(out.views, [](const SheetView& view) {
    int points = 0;
    for (const FeatureObservation& feature : view.features) points += feature.points();
    return points < 4;
  });
  return out;
}

CameraCalibration calibrate_camera(const std::vector<Sheet>& sheets, const CalibrationState& rough,
                                   double rough_sigma_px, const CameraCalibrationOptions& options) {
  options.validate();
  CameraCalibration out;
  if (photographs_in(rough) < 3) {
    out.status = CalibrationStatus::too_few_photographs;
    out.reason = "fewer than 3 photographs, wanted at least 3 and better 10 to 20";
    return out;
  }
  const BoardFreedom least = options.board.value_or(BoardFreedom::warped);
  std::vector<CameraVariant> lenses = with_board(lens_variants(options.lens), least);
  // The richest model of all decides which features are outliers and how much noise there is, so that all are
  // compared on the same data and a poor one cannot throw away what it does not explain.
  const auto richest = std::find_if(lenses.rbegin(), lenses.rend(),
                                    [](const CameraVariant& v) { return v.lens == LensModel::radial; });
  const RobustFitResult reference =
      robust_fit(sheets, rough, richest != lenses.rend() ? *richest : lenses.back(), rough_sigma_px,
                 {.with_covariance = false});
  if (!reference.adjustment.converged) {
    out.status = CalibrationStatus::no_solution;
    out.reason = "the adjustment found no camera that fits these photographs";
    return out;
  }
  CalibrationState state = reference.adjustment.state;
  double sigma = reference.extra_sigma_px;
  std::vector<ModelTrial> lens_trials = try_variants(sheets, state, sigma, lenses);
  CameraVariant variant = lens_trials[choose_trial(lens_trials)].variant;
  out.trials = lens_trials;
  if (!options.board) {
    std::vector<CameraVariant> boards;
    for (const BoardFreedom board : {BoardFreedom::ideal, BoardFreedom::warped, BoardFreedom::points}) {
      if (board == BoardFreedom::points && !points_can_be_free(state)) continue;
      variant.board = board;
      boards.push_back(variant);
    }
    std::vector<ModelTrial> trials = try_variants(sheets, state, sigma, boards);
    variant = trials[choose_trial(trials)].variant;
    for (const ModelTrial& trial : trials) {
      if (trial.variant.board != least) out.trials.push_back(trial);
    }
    if (variant.board != least) {
      // Noise and outliers anew, then the lens again: what the sheet explains need not be the lens.
      const RobustFitResult again = robust_fit(sheets, state, variant, sigma, {.with_covariance = false});
      if (again.adjustment.converged) {
        state = again.adjustment.state;
        sigma = again.extra_sigma_px;
      }
      trials = try_variants(sheets, state, sigma, with_board(hopeful(lens_trials), variant.board));
      variant = trials[choose_trial(trials)].variant;
      for (const ModelTrial& trial : trials) out.trials.push_back(trial);
    }
  }
  // Last, whether pixels are square: only with a gain that noise does not give.
  CameraVariant affine = variant;
  affine.free_parameters[1] = 1;
  std::vector<ModelTrial> shapes = try_variants(sheets, state, sigma, {variant, affine});
  variant = shapes[choose_trial(shapes)].variant;
  out.trials.push_back(shapes.back());
  for (ModelTrial& trial : out.trials) trial.chosen = trial.name == variant_name(variant);
  if (variant.board == BoardFreedom::ideal) state.shapes.assign(sheets.size(), {});
  CalibrationState last = state;
  last.camera = converted_camera(state.camera, variant.lens);
  for (std::size_t i = 1; i < variant.free_parameters.size(); ++i) {
    if (!variant.free_parameters[i]) last.camera.parameters[static_cast<Eigen::Index>(i)] = 0;
  }
  out.fit = robust_fit(sheets, last, variant, sigma);
  out.variant = variant;
  out.status = out.fit.adjustment.converged ? CalibrationStatus::ok : CalibrationStatus::no_solution;
  if (out.status != CalibrationStatus::ok) out.reason = "the adjustment did not converge";
  CameraModel& camera = out.fit.adjustment.state.camera;
  camera.valid_radius = radius_of_frame(camera);
  return out;
}

}  // namespace hexcal
