#include "camera_calib/sheet_adjustment.h"

#include <ceres/ceres.h>

#include <array>
#include <cassert>
#include <map>
#include <memory>

#include "camera_calib/feature_model.h"
#include "camera_calib/normal_equations.h"
#include "camera_calib/parameter_prior.h"

namespace hexcal {
namespace {

// 99 % points of chi^2 with 2 and 8 degrees of freedom, square roots.
constexpr double kHuber2 = 3.035;
constexpr double kHuber8 = 4.482;

class FeatureCost : public ceres::CostFunction {
 public:
  explicit FeatureCost(const FeatureModel& model) : model_(model) {
    set_num_residuals(model.residuals());
    *mutable_parameter_block_sizes() = model.block_sizes();
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    return model_.evaluate(parameters, residuals, jacobians);
  }

 private:
  const FeatureModel& model_;
};

// (value - mean) / sigma of every element of a block.
class PriorCost : public ceres::CostFunction {
 public:
  PriorCost(Eigen::VectorXd mean, Eigen::VectorXd sigma) : mean_(std::move(mean)), sigma_(std::move(sigma)) {
    set_num_residuals(static_cast<int>(mean_.size()));
    *mutable_parameter_block_sizes() = {static_cast<int>(mean_.size())};
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Index n = mean_.size();
    Eigen::Map<Eigen::VectorXd>(residuals, n) =
        (Eigen::Map<const Eigen::VectorXd>(parameters[0], n) - mean_).cwiseQuotient(sigma_);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      using Row = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      Eigen::Map<Row>(jacobians[0], n, n) = sigma_.cwiseInverse().asDiagonal();
    }
    return true;
  }

 private:
  Eigen::VectorXd mean_;
  Eigen::VectorXd sigma_;
};

// What the sheets give to every feature.
struct DrawnSheet {
  std::vector<SheetPoint> points;
  Eigen::Vector2d half_extent_mm;
  double diagonal_mm = 0;
};

// The state as Ceres' parameter blocks.
struct Blocks {
  CameraModel::Parameters camera;
  std::vector<std::array<double, 6>> poses;                      // per view
  std::vector<Eigen::Matrix<double, 5, 1>> deformations;         // per sheet
  std::map<std::pair<int, int>, std::array<double, 12>> shifts;  // per sheet and first point
};

Blocks blocks_from(const CalibrationState& state) {
  Blocks blocks;
  blocks.camera = state.camera.parameters;
  for (const SheetShape& shape : state.shapes) blocks.deformations.push_back(shape.deformation);
  for (const SheetView& view : state.views) {
    const Eigen::Vector3d w = rotation_vector_from_quaternion(view.camera_from_sheet.rotation);
    const Eigen::Vector3d& t = view.camera_from_sheet.translation;
    blocks.poses.push_back({w.x(), w.y(), w.z(), t.x(), t.y(), t.z()});
    const SheetShape& shape = state.shapes[static_cast<std::size_t>(view.sheet)];
    for (const FeatureObservation& feature : view.features) {
      auto [at, is_new] = blocks.shifts.try_emplace({view.sheet, feature.first_point});
      if (!is_new) continue;
      at->second.fill(0.0);
      if (shape.shift_mm.empty()) continue;
      for (int i = 0; i < feature.points(); ++i) {
        const Eigen::Vector3d& shift = shape.shift_mm[static_cast<std::size_t>(feature.first_point + i)];
        for (int axis = 0; axis < 3; ++axis) at->second[static_cast<std::size_t>(3 * i + axis)] = shift[axis];
      }
    }
  }
  return blocks;
}

void store(const Blocks& blocks, const std::vector<DrawnSheet>& drawn, CalibrationState& state) {
  state.camera.parameters = blocks.camera;
  for (std::size_t i = 0; i < state.views.size(); ++i) {
    const auto& p = blocks.poses[i];
    state.views[i].camera_from_sheet =
        Rigid3(quaternion_from_rotation_vector({p[0], p[1], p[2]}), {p[3], p[4], p[5]});
  }
  for (std::size_t i = 0; i < state.shapes.size(); ++i) state.shapes[i].deformation = blocks.deformations[i];
  for (const auto& [key, shift] : blocks.shifts) {
    SheetShape& shape = state.shapes[static_cast<std::size_t>(key.first)];
    const std::size_t count = drawn[static_cast<std::size_t>(key.first)].points.size();
    const auto first = static_cast<std::size_t>(key.second);
    for (std::size_t i = 0; i < 4 && first + i < count; ++i) {
      const Eigen::Vector3d value(shift[3 * i], shift[3 * i + 1], shift[3 * i + 2]);
      if (value.isZero(0)) continue;
      if (shape.shift_mm.empty()) shape.shift_mm.assign(count, Eigen::Vector3d::Zero());
      shape.shift_mm[first + i] = value;
    }
  }
}

std::vector<char> free_camera(const CameraModel& camera, const SheetAdjustmentOptions& options) {
  if (options.only_poses) return std::vector<char>(static_cast<std::size_t>(camera.parameters.size()), false);
  return options.free_parameters.empty() ? all_but_affinity(camera.lens) : options.free_parameters;
}

// A ceres::Problem over the blocks, and the order of its free ones.
struct Network {
  std::vector<std::vector<FeatureModel>> models;  // per view and feature
  std::unique_ptr<ceres::Problem> problem;
  std::vector<double*> shared;  // free blocks that views have in common: camera, deformations, shifts
  std::vector<double*> poses;
  std::vector<ceres::ResidualBlockId> blocks;  // of the features used, in the order of `used`
  std::vector<UsedFeature> used;
  std::vector<ceres::ResidualBlockId> priors;
  int free_camera = 0;
  int unknowns = 0;
};

void add_camera(Network& network, Blocks& blocks, const CameraModel& camera,
                const SheetAdjustmentOptions& options) {
  ceres::Problem& problem = *network.problem;
  problem.AddParameterBlock(blocks.camera.data(), static_cast<int>(blocks.camera.size()));
  std::vector<int> held;
  const std::vector<char> free = free_camera(camera, options);
  for (std::size_t i = 0; i < free.size(); ++i) {
    if (!free[i]) held.push_back(static_cast<int>(i));
  }
  if (held.size() == free.size()) {
    problem.SetParameterBlockConstant(blocks.camera.data());
    return;
  }
  if (!held.empty()) {
    problem.SetManifold(blocks.camera.data(), new ceres::SubsetManifold(static_cast<int>(free.size()), held));
  }
  const ParameterPrior prior = weak_camera_prior(camera);
  network.priors.push_back(
      problem.AddResidualBlock(new PriorCost(prior.mean, prior.sigma), nullptr, blocks.camera.data()));
  network.shared.push_back(blocks.camera.data());
  network.free_camera = static_cast<int>(free.size() - held.size());
  network.unknowns += network.free_camera;
}

void add_sheets(Network& network, Blocks& blocks, const std::vector<DrawnSheet>& drawn,
                const SheetAdjustmentOptions& options) {
  ceres::Problem& problem = *network.problem;
  const BoardFreedom board = options.only_poses ? BoardFreedom::ideal : options.board;
  for (Eigen::Matrix<double, 5, 1>& deformation : blocks.deformations) {
    if (!problem.HasParameterBlock(deformation.data())) continue;
    if (board != BoardFreedom::warped) {
      problem.SetParameterBlockConstant(deformation.data());
      continue;
    }
    Eigen::VectorXd sigma(5);
    const double diagonal =
        drawn[static_cast<std::size_t>(&deformation - blocks.deformations.data())].diagonal_mm;
    sigma << 0.05, 0.05, 0.05 * diagonal, 0.05 * diagonal, 0.05 * diagonal;
    network.priors.push_back(problem.AddResidualBlock(new PriorCost(Eigen::VectorXd::Zero(5), sigma), nullptr,
                                                      deformation.data()));
    network.shared.push_back(deformation.data());
    network.unknowns += 5;
  }
  std::map<int, int> free_points;
  for (auto& [key, shift] : blocks.shifts) {
    if (!problem.HasParameterBlock(shift.data())) continue;
    if (board != BoardFreedom::points) {
      problem.SetParameterBlockConstant(shift.data());
      continue;
    }
    const int size = problem.ParameterBlockSize(shift.data());
    const double diagonal = drawn[static_cast<std::size_t>(key.first)].diagonal_mm;
    const double sigma = options.point_prior_mm > 0 ? options.point_prior_mm : 0.005 * diagonal;
    network.priors.push_back(problem.AddResidualBlock(
        new PriorCost(Eigen::VectorXd::Zero(size), Eigen::VectorXd::Constant(size, sigma)), nullptr,
        shift.data()));
    network.shared.push_back(shift.data());
    network.unknowns += size;
    free_points[key.first] += size / 3;
  }
  for (const auto& [sheet, points] : free_points) network.unknowns -= std::min(7, 3 * points);
}

Network build(const std::vector<DrawnSheet>& drawn, const CalibrationState& state, Blocks& blocks,
              const SheetAdjustmentOptions& options) {
  Network network;
  ceres::Problem::Options ownership;
  network.problem = std::make_unique<ceres::Problem>(ownership);
  add_camera(network, blocks, state.camera, options);
  network.models.resize(state.views.size());
  for (std::size_t v = 0; v < state.views.size(); ++v) {
    const SheetView& view = state.views[v];
    const DrawnSheet& sheet = drawn[static_cast<std::size_t>(view.sheet)];
    network.models[v].reserve(view.features.size());
    bool used = false;
    for (std::size_t f = 0; f < view.features.size(); ++f) {
      const FeatureObservation& feature = view.features[f];
      std::vector<Eigen::Vector3d> points;
      for (int i = 0; i < feature.points(); ++i) {
        points.push_back(sheet.points[static_cast<std::size_t>(feature.first_point + i)].position_mm);
      }
      network.models[v].emplace_back(state.camera, feature, std::move(points), sheet.half_extent_mm,
                                     options.extra_sigma_px);
      if (view.rejected[f] != 0) continue;
      ceres::LossFunction* loss =
          options.robust ? new ceres::HuberLoss(feature.points() == 4 ? kHuber8 : kHuber2) : nullptr;
      network.blocks.push_back(network.problem->AddResidualBlock(
          new FeatureCost(network.models[v].back()), loss, blocks.camera.data(), blocks.poses[v].data(),
          blocks.deformations[static_cast<std::size_t>(view.sheet)].data(),
          blocks.shifts.at({view.sheet, feature.first_point}).data()));
      network.used.push_back({view.photograph, view.sheet, &feature});
      used = true;
    }
    if (!used) continue;
    network.poses.push_back(blocks.poses[v].data());
    network.unknowns += 6;
  }
  add_sheets(network, blocks, drawn, options);
  return network;
}

bool solve(Network& network, const SheetAdjustmentOptions& options) {
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_SCHUR;
  solver.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  std::vector<double*> all;
  network.problem->GetParameterBlocks(&all);
  for (double* block : all) solver.linear_solver_ordering->AddElementToGroup(block, 1);
  for (double* block : network.poses) solver.linear_solver_ordering->AddElementToGroup(block, 0);
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = options.function_tolerance;
  solver.parameter_tolerance = 1e-12;
  solver.gradient_tolerance = 1e-14;
  solver.num_threads = 1;  // sums in one order: same input, same bytes
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, network.problem.get(), &summary);
  return summary.IsSolutionUsable();
}

void add_residuals(const Network& network, Blocks& blocks, SheetAdjustmentResult& result) {
  for (std::size_t v = 0; v < network.models.size(); ++v) {
    const SheetView& view = result.state.views[v];
    result.residuals_px.emplace_back();
    for (std::size_t f = 0; f < view.features.size(); ++f) {
      const FeatureModel& model = network.models[v][f];
      const double* parameters[] = {blocks.camera.data(), blocks.poses[v].data(),
                                    blocks.deformations[static_cast<std::size_t>(view.sheet)].data(),
                                    blocks.shifts.at({view.sheet, view.features[f].first_point}).data()};
      FeatureObservation::Vector px;
      if (!model.residual_px(parameters, px)) px.setConstant(1e6);
      result.residuals_px.back().push_back(px);
      if (view.rejected[f] != 0) continue;
      FeatureObservation::Vector whitened(model.residuals());
      if (!model.evaluate(parameters, whitened.data(), nullptr)) continue;
      result.chi2 += whitened.squaredNorm();
      result.observations += model.residuals();
    }
  }
}

// The camera block comes out of the solver without its held parameters; put them back as zero rows.
Eigen::MatrixXd with_held(const Eigen::MatrixXd& covariance, const std::vector<char>& free) {
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n, n);
  Eigen::Index a = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!free[static_cast<std::size_t>(i)]) continue;
    Eigen::Index b = 0;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (free[static_cast<std::size_t>(j)]) out(i, j) = covariance(a, b++);
    }
    ++a;
  }
  return out;
}

// The system at the solution: rows of the features in the order of Network::used, then the priors'.
ReducedSystem system_of(const Network& network) {
  ceres::Problem::EvaluateOptions evaluate;
  evaluate.apply_loss_function = false;
  evaluate.num_threads = 1;
  evaluate.parameter_blocks = network.shared;
  evaluate.parameter_blocks.insert(evaluate.parameter_blocks.end(), network.poses.begin(),
                                   network.poses.end());
  evaluate.residual_blocks = network.blocks;
  evaluate.residual_blocks.insert(evaluate.residual_blocks.end(), network.priors.begin(),
                                  network.priors.end());
  ceres::CRSMatrix crs;
  std::vector<double> residuals;
  network.problem->Evaluate(evaluate, nullptr, &residuals, nullptr, &crs);
  const auto poses = static_cast<int>(network.poses.size());
  return reduced_system({crs.num_cols, crs.rows, crs.cols, crs.values}, residuals, crs.num_cols - 6 * poses);
}

void add_statistics(const Network& network, const Blocks& blocks, const SheetAdjustmentOptions& options,
                    SheetAdjustmentResult& result) {
  ReducedSystem system = system_of(network);
  if (options.with_left_out) result.left_out_chi2 = left_out_chi2(system, network.used);
  if (!options.with_covariance || (system.covariance.size() == 0 && network.free_camera > 0)) return;
  if (network.free_camera > 0) {
    const auto camera_part = [&](const Eigen::MatrixXd& covariance) {
      return with_held(covariance.topLeftCorner(network.free_camera, network.free_camera),
                       free_camera(result.state.camera, options));
    };
    result.shared_errors = shared_error_factors(system, network.used, result.state.camera, camera_part,
                                                result.sigma0() * result.sigma0());
    system.covariance *= result.shared_errors.largest() * result.shared_errors.largest();
    result.camera_covariance = camera_part(system.covariance);
  }
  std::size_t at = 0;
  for (std::size_t v = 0; v < blocks.poses.size(); ++v) {
    result.pose_covariance.emplace_back(Eigen::Matrix<double, 6, 6>::Zero());
    if (at < network.poses.size() && network.poses[at] == blocks.poses[v].data()) {
      result.pose_covariance.back() =
          pose_perturbation_covariance(system.pose_covariance(at, system.covariance), blocks.poses[v]);
      ++at;
    }
  }
}

}  // namespace

double SheetAdjustmentResult::rms_px() const {
  double sum = 0;
  double points = 0;
  for (std::size_t v = 0; v < residuals_px.size(); ++v) {
    for (std::size_t f = 0; f < residuals_px[v].size(); ++f) {
      if (state.views[v].rejected[f] != 0) continue;
      sum += residuals_px[v][f].squaredNorm();
      points += 0.5 * static_cast<double>(residuals_px[v][f].size());
    }
  }
  return std::sqrt(sum / std::max(points, 1.0));
}

const char* board_freedom_name(BoardFreedom freedom) {
  switch (freedom) {
    case BoardFreedom::ideal:
      return "ideal";
    case BoardFreedom::warped:
      return "warped";
    case BoardFreedom::points:
      return "points";
  }
  return "";
}

std::vector<char> all_but_affinity(LensModel lens) {
  std::vector<char> free(camera_parameter_names(lens).size(), true);
  free[1] = false;
  return free;
}

SheetAdjustmentResult adjust_sheets(const std::vector<Sheet>& sheets, const CalibrationState& start,
                                    const SheetAdjustmentOptions& options) {
  assert(start.shapes.size() == sheets.size());
  std::vector<DrawnSheet> drawn;
  for (const Sheet& sheet : sheets) {
    const SheetGeometry geometry = sheet_geometry(sheet);
    drawn.push_back({sheet_points(geometry), 0.5 * geometry.extent_mm, geometry.extent_mm.norm()});
  }
  SheetAdjustmentResult result;
  result.state = start;
  Blocks blocks = blocks_from(start);
  Network network = build(drawn, start, blocks, options);
  if (network.poses.empty()) return result;
  result.converged = solve(network, options);
  store(blocks, drawn, result.state);
  result.unknowns = network.unknowns;
  add_residuals(network, blocks, result);
  if ((options.with_covariance || options.with_left_out) && result.converged) {
    add_statistics(network, blocks, options, result);
  }
  return result;
}

}  // namespace hexcal
