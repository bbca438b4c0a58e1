#include "photogrammetry/markers/photometric_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "photogrammetry/markers/fit_pixels.h"

namespace hexcal {
namespace {

// Order of the parameters.
constexpr int kHomography = 0;  // 8
constexpr int kBlur = 8;  // mean variance of the point spread, half the difference x - y, covariance, px^2
constexpr int kBlack = 11, kWhite = 12;
constexpr int kLight = 13;   // gradient x, y; then xx, xy, yy, per half side of the square
constexpr int kShared = 18;  // tone first, second; lens k1, k2
constexpr int kCount = 22;
using Vector = Eigen::Matrix<double, kCount, 1>;
using Matrix = Eigen::Matrix<double, kCount, kCount>;

constexpr double kPixelVariance = 1.0 / 12;  // of the square a pixel integrates over
constexpr double kMinBlur = 0.02;            // px^2
constexpr double kHuber = 3.0;
constexpr double kNoLimit = 1e9;
constexpr int kCoarsePixels = 1000;
constexpr double kFineReachSigmas = 2.8;  // beyond, a pixel says nothing of the edge
constexpr double kNearSigmas = 1.3;       // within, it says most: 93 % of the edge's place
constexpr double kLargeSide = 300;        // px; from here on the illumination's curvature counts
constexpr double kSmallSide = 40;  // px; from here on the blur's anisotropy can be told from the geometry

// Standard deviations of what is expected before the first look; an absent one is 0.
Vector prior_sigmas(double lens_sigma) {
  Vector sigma = Vector::Zero();
  sigma.segment<3>(kBlur) << 3, 0.2, 0.2;
  sigma.segment<5>(kLight) << 0.3, 0.3, 0.1, 0.1, 0.1;
  sigma.segment<kNumShared>(kShared) << 0.5, 0.5, lens_sigma, lens_sigma;
  return sigma;
}

class MarkerFit {
 public:
  MarkerFit(const cv::Mat& grey, const PhotographModel& photograph, const FitRequest& request)
      : grey_(grey),
        photograph_(photograph),
        request_(request),
        prior_sigmas_(prior_sigmas(request.lens_sigma)) {}

  PhotometricFit run() {
    PhotometricFit fit;
    if (!prepare()) return fit;
    activate({kHomography, 8}, true);
    activate({kBlur, 1}, true);
    activate({kBlack, 2}, true);
    activate({kLight, 2}, true);
    if (request_.blur_px) {
      parameters_[kBlur] = std::max(*request_.blur_px * *request_.blur_px, kMinBlur);
    } else {
      select(3.6 * spread_px() + 1.5, kCoarsePixels);
      list_active();
      if (!set_levels() || !enough_pixels()) return fit;
      evaluate_all();
      if (!solve(12, 5e-3)) return fit;
    }
    const double side_px = 2 * frame_.half_side;
    activate({kBlur + 1, 2}, side_px >= kSmallSide);
    activate({kLight + 2, 3}, side_px >= kLargeSide);
    activate({kShared, 2}, request_.free_tone);
    activate({kShared + 2, 2}, request_.free_lens);
    select(kFineReachSigmas * spread_px() + 0.3, request_.max_pixels);
    list_active();
    if (!enough_pixels() || (request_.blur_px && !set_levels())) return fit;
    evaluate_all();
    if (request_.pattern.cells() > 2) drop_covered_cells();
    scale_ = robust_scale();
    if (!solve(6, 3e-4)) return fit;
    finish(fit);
    return fit;
  }

 private:
  struct Range {
    int first, count;
  };
  void activate(Range range, bool on) {
    for (int i = range.first; i < range.first + range.count; ++i) active_[static_cast<std::size_t>(i)] = on;
  }

  bool prepare() {
    std::array<Eigen::Vector2d, 4> ideal;
    Eigen::Vector2d low = request_.corners_px[0];
    Eigen::Vector2d high = low;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto point = photograph_.map.ideal_from_pixel(request_.corners_px[i]);
      if (!point) return false;
      ideal[i] = *point;
      low = low.cwiseMin(request_.corners_px[i]);
      high = high.cwiseMax(request_.corners_px[i]);
    }
    frame_.middle = 0.25 * (ideal[0] + ideal[1] + ideal[2] + ideal[3]);
    double around = 0;
    for (std::size_t i = 0; i < 4; ++i) around += (ideal[(i + 1) % 4] - ideal[i]).norm();
    frame_.half_side = around / 8;
    frame_.middle_px = 0.5 * (low + high);
    std::array<Eigen::Vector2d, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) corners[i] = (ideal[i] - frame_.middle) / frame_.half_side;
    const auto g = homography_from_corners(corners);
    if (!g) return false;
    parameters_.setZero();
    parameters_.segment<8>(kHomography) = *g;
    parameters_[kBlur] = 0.5;
    parameters_[kShared] = photograph_.tone.first();
    parameters_[kShared + 1] = photograph_.tone.second();
    start_ = parameters_;

    // The square, its surroundings as far as the pattern reaches, and the blur.
    const double beyond = std::max(request_.pattern.cells() / request_.square_cells - 1, 0.0) * 0.5 *
                          (high - low).maxCoeff() * 1.5;
    const double margin = beyond + 12;
    const cv::Rect wanted(static_cast<int>(std::floor(low.x() - margin)),
                          static_cast<int>(std::floor(low.y() - margin)),
                          static_cast<int>(std::ceil(high.x() - low.x() + 2 * margin)),
                          static_cast<int>(std::ceil(high.y() - low.y() + 2 * margin)));
    box_ = wanted & cv::Rect(0, 0, grey_.cols, grey_.rows);
    if (box_.width < 4 || box_.height < 4) return false;
    patch_ = PixelMapPatch::fit(photograph_.map, box_);
    return patch_.has_value();
  }

  void select(double reach_px, int max_pixels) {
    const PixelSelection selection{parameters_.segment<8>(kHomography), frame_, reach_px,
                                   kNearSigmas * spread_px(), max_pixels};
    selected_ = select_pixels(grey_, photograph_, *patch_, request_, box_, selection);
    residuals_.assign(selected_.pixels.size(), 0);
    scale_ = kNoLimit;
  }

  double spread_px() const { return std::sqrt(parameters_[kBlur] + kPixelVariance); }

  // Black and white by linear least squares in linear light, from some of the pixels.
  bool set_levels() {
    Eigen::Matrix2d n = Eigen::Matrix2d::Zero();
    Eigen::Vector2d rhs = Eigen::Vector2d::Zero();
    const std::size_t step = selected_.pixels.size() / kCoarsePixels + 1;
    for (std::size_t i = 0; i < selected_.pixels.size(); i += step) {
      const FitPixel& pixel = selected_.pixels[i];
      const double share = sample(pixel).pattern.value;
      const Eigen::Vector2d row(1 - share, share);
      n += row * row.transpose();
      rhs += row * photograph_.tone.decode(pixel.value);
    }
    if (selected_.pixels.size() < 20 || n.determinant() < 1e-6) return false;
    parameters_.segment<2>(kBlack) = n.inverse() * rhs;
    return parameters_[kWhite] > parameters_[kBlack];
  }

  // White share of the pattern at a pixel, and what leads to its derivatives.
  struct Sampled {
    Eigen::Vector2d point;
    SquarePoint square;
    Eigen::Matrix2d cells_by_px;
    PatternSample pattern;
  };
  Sampled sample(const FitPixel& pixel) const {
    const Vector& p = parameters_;
    Eigen::Vector2d point = pixel.point;
    if (request_.free_lens) {
      point += pixel.by_lens * (p.segment<2>(kShared + 2) - start_.segment<2>(kShared + 2));
    }
    const SquarePoint square = square_point(InverseHomography(p.segment<8>(kHomography)), point);
    const double half_square = 0.5 * request_.square_cells;
    const double middle = 0.5 * request_.pattern.cells();
    const Eigen::Matrix2d cells_by_px = half_square * square.by_point * pixel.by_px;
    const double a = cells_by_px(0, 0);
    const double b = cells_by_px(0, 1);
    const double c = cells_by_px(1, 0);
    const double d = cells_by_px(1, 1);
    const double xx = p[kBlur] + p[kBlur + 1] + kPixelVariance;
    const double xy = p[kBlur + 2];
    const double yy = p[kBlur] - p[kBlur + 1] + kPixelVariance;
    const Symmetric2 spread{a * a * xx + 2 * a * b * xy + b * b * yy,
                            a * c * xx + (a * d + b * c) * xy + b * d * yy,
                            c * c * xx + 2 * c * d * xy + d * d * yy};
    return {point, square, cells_by_px,
            request_.pattern.sample(half_square * square.t.x() + middle, half_square * square.t.y() + middle,
                                    spread)};
  }

  // The model's encoded value at a pixel and its derivatives.
  double evaluate(const FitPixel& pixel, Vector& r) const {
    const Vector& p = parameters_;
    const Sampled sampled = sample(pixel);
    const Eigen::Vector2d& point = sampled.point;
    const SquarePoint& square = sampled.square;
    const PatternSample& s = sampled.pattern;
    const double half_square = 0.5 * request_.square_cells;
    const double a = sampled.cells_by_px(0, 0);
    const double b = sampled.cells_by_px(0, 1);
    const double c = sampled.cells_by_px(1, 0);
    const double d = sampled.cells_by_px(1, 1);
    const double ox = pixel.offset.x();
    const double oy = pixel.offset.y();
    const double shade = 1 + p[kLight] * ox + p[kLight + 1] * oy + p[kLight + 2] * ox * ox +
                         p[kLight + 3] * ox * oy + p[kLight + 4] * oy * oy;
    const double unshaded = p[kBlack] + (p[kWhite] - p[kBlack]) * s.value;
    const ToneResponse tone(photograph_.tone.nominal(), p[kShared], p[kShared + 1]);
    const ToneResponse::Encoded encoded = tone.encode(unshaded * shade);
    const double by_share = encoded.by_light * shade * (p[kWhite] - p[kBlack]);
    const double tx = by_share * s.by_x * half_square * square.scale;
    const double ty = by_share * s.by_y * half_square * square.scale;
    r[0] = tx * point.x();
    r[1] = tx * point.y();
    r[2] = tx;
    r[3] = ty * point.x();
    r[4] = ty * point.y();
    r[5] = ty;
    const double along = tx * square.t.x() + ty * square.t.y();
    r[6] = -along * point.x();
    r[7] = -along * point.y();
    // Heat equation, carried to pixels: half of A^T (second derivatives) A.
    const Symmetric2& h = s.second;
    const double hxx = a * a * h.xx + 2 * a * c * h.xy + c * c * h.yy;
    const double hxy = a * b * h.xx + (a * d + b * c) * h.xy + c * d * h.yy;
    const double hyy = b * b * h.xx + 2 * b * d * h.xy + d * d * h.yy;
    r[kBlur] = by_share * 0.5 * (hxx + hyy);
    r[kBlur + 1] = by_share * 0.5 * (hxx - hyy);
    r[kBlur + 2] = by_share * hxy;
    r[kBlack] = encoded.by_light * shade * (1 - s.value);
    r[kWhite] = encoded.by_light * shade * s.value;
    const double by_shade = encoded.by_light * unshaded;
    r[kLight] = by_shade * ox;
    r[kLight + 1] = by_shade * oy;
    r[kLight + 2] = by_shade * ox * ox;
    r[kLight + 3] = by_shade * ox * oy;
    r[kLight + 4] = by_shade * oy * oy;
    r[kShared] = encoded.by_first;
    r[kShared + 1] = encoded.by_second;
    if (request_.free_lens) {
      const Eigen::RowVector2d by_point =
          by_share * half_square * Eigen::RowVector2d(s.by_x, s.by_y) * square.by_point;
      r.segment<2>(kShared + 2) = (by_point * pixel.by_lens).transpose();
    } else {
      r.segment<2>(kShared + 2).setZero();
    }
    return encoded.value;
  }

  // Whitened residuals' median as a standard deviation, not below 1.
  double robust_scale() const {
    std::vector<double> sizes;
    sizes.reserve(residuals_.size());
    for (std::size_t i = 0; i < residuals_.size(); ++i) {
      if (selected_.pixels[i].kept) sizes.push_back(std::abs(residuals_[i]));
    }
    if (sizes.empty()) return 1;
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    return std::max(1.0, 1.4826 * *middle);
  }

  double robust_cost() const {
    double sum = prior_cost();
    for (std::size_t i = 0; i < residuals_.size(); ++i) {
      if (!selected_.pixels[i].kept) continue;
      const double r = residuals_[i];
      const double z = std::abs(r) / scale_;
      sum += z <= kHuber ? r * r : scale_ * scale_ * kHuber * (2 * z - kHuber);
    }
    return sum;
  }

  double prior_cost() const {
    const Vector& sigma = prior_sigmas_;
    double sum = 0;
    for (int i = 0; i < kCount; ++i) {
      if (!active_[static_cast<std::size_t>(i)] || sigma[i] == 0) continue;
      const double z = (parameters_[i] - start_[i]) / sigma[i];
      sum += z * z;
    }
    return sum;
  }

  struct Normals {
    Matrix n;
    Vector rhs;
  };

  // Whitened residuals and rows of the active parameters' derivatives of all pixels.
  void evaluate_all() {
    const std::size_t count = active_list_.size();
    rows_.resize(selected_.pixels.size() * count);
    Vector row;
    for (std::size_t at = 0; at < selected_.pixels.size(); ++at) {
      const FitPixel& pixel = selected_.pixels[at];
      residuals_[at] = (pixel.value - evaluate(pixel, row)) * pixel.weight;
      double* const j = rows_.data() + at * count;
      for (std::size_t k = 0; k < count; ++k) j[k] = row[active_list_[k]] * pixel.weight;
    }
  }

  double robust_weight(std::size_t pixel) const {
    const double size = std::abs(residuals_[pixel]) / scale_;
    return size <= kHuber ? 1 : kHuber / size;
  }

  // Normal equations of the active parameters, compressed to the first `active_list_.size()` rows, from the
  // last evaluation.
  Normals normals(bool with_priors) const {
    Normals result{Matrix::Zero(), Vector::Zero()};
    const std::size_t count = active_list_.size();
    // Four pixels at a time: the sums are loaded and stored once for them.
    constexpr std::size_t kTogether = 4;
    static constexpr std::array<double, kCount> kNone{};
    std::array<const double*, kTogether> j{};
    std::array<double, kTogether> weight{};
    std::array<double, kTogether> residual{};
    std::size_t waiting = 0;
    const auto add = [&] {
      for (std::size_t k = 0; k < count; ++k) {
        double* const column = result.n.data() + k * kCount;
        const double f0 = weight[0] * j[0][k];
        const double f1 = weight[1] * j[1][k];
        const double f2 = weight[2] * j[2][k];
        const double f3 = weight[3] * j[3][k];
        for (std::size_t i = 0; i <= k; ++i) {
          column[i] += f0 * j[0][i] + f1 * j[1][i] + f2 * j[2][i] + f3 * j[3][i];
        }
        result.rhs[static_cast<int>(k)] +=
            f0 * residual[0] + f1 * residual[1] + f2 * residual[2] + f3 * residual[3];
      }
      waiting = 0;
    };
    for (std::size_t at = 0; at < selected_.pixels.size(); ++at) {
      if (!selected_.pixels[at].kept) continue;
      j[waiting] = rows_.data() + at * count;
      weight[waiting] = robust_weight(at);
      residual[waiting] = residuals_[at];
      if (++waiting == kTogether) add();
    }
    if (waiting > 0) {
      for (; waiting < kTogether; ++waiting) {
        j[waiting] = kNone.data();
        weight[waiting] = residual[waiting] = 0;
      }
      add();
    }
    if (with_priors) add_priors(result);
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t i = 0; i < k; ++i) {
        result.n(static_cast<int>(k), static_cast<int>(i)) =
            result.n(static_cast<int>(i), static_cast<int>(k));
      }
    }
    return result;
  }

  void add_priors(Normals& normals) const {
    const Vector& sigma = prior_sigmas_;
    for (std::size_t k = 0; k < active_list_.size(); ++k) {
      const int i = active_list_[k];
      if (sigma[i] == 0) continue;
      const double information = 1 / (sigma[i] * sigma[i]);
      normals.n(static_cast<int>(k), static_cast<int>(k)) += information;
      normals.rhs[static_cast<int>(k)] += information * (start_[i] - parameters_[i]);
    }
    if (!request_.affine) return;
    // A saddle point's edges look the same when the pattern is stretched along them: keep that stretch.
    for (int axis = 0; axis < 2; ++axis) {
      Eigen::Vector3d along = parameters_.segment<3>(3 * axis);
      along.normalize();
      const double stiff = std::max(normals.n.diagonal().head<6>().maxCoeff(), 1.0);
      normals.n.block<3, 3>(3 * axis, 3 * axis).triangularView<Eigen::Upper>() +=
          stiff * along * along.transpose();
    }
  }

  void list_active() {
    active_list_.clear();
    for (int i = 0; i < kCount; ++i) {
      if (request_.affine && (i == 6 || i == 7)) continue;
      if (active_[static_cast<std::size_t>(i)]) active_list_.push_back(i);
    }
  }

  void apply(const Eigen::VectorXd& step) {
    for (std::size_t k = 0; k < active_list_.size(); ++k) {
      parameters_[active_list_[k]] += step[static_cast<Eigen::Index>(k)];
    }
    parameters_[kBlur] = std::max(parameters_[kBlur], kMinBlur);
    const double limit = 0.8 * parameters_[kBlur] + 0.5 * kPixelVariance;
    for (int i = kBlur + 1; i < kBlur + 3; ++i) parameters_[i] = std::clamp(parameters_[i], -limit, limit);
  }

  bool enough_pixels() const { return selected_.pixels.size() >= 2 * active_list_.size(); }

  // Levenberg-Marquardt from the last evaluation until the square moves less than `tolerance_px`; leaves
  // everything evaluated at its end. Weights are robust from the second step on, or from the first if the
  // scale is known.
  bool solve(int max_iterations, double tolerance_px) {
    const auto count = static_cast<Eigen::Index>(active_list_.size());
    double damping = 1e-6;
    Normals at = normals(true);
    for (int iteration = 0; iteration < max_iterations; ++iteration) {
      scale_ = robust_scale();
      const double cost = robust_cost();
      const Vector before = parameters_;
      Eigen::MatrixXd n = at.n.topLeftCorner(count, count);
      n.diagonal() *= 1 + damping;
      const Eigen::VectorXd step = n.ldlt().solve(at.rhs.head(count));
      if (!step.allFinite()) return false;
      apply(step);
      evaluate_all();
      const double moved = step.head(request_.affine ? 6 : 8).cwiseAbs().maxCoeff() * frame_.half_side;
      if (moved < tolerance_px) break;
      if (robust_cost() <= cost * (1 + 1e-9)) {
        damping = std::max(damping * 0.1, 1e-9);
        at = normals(true);
      } else {
        parameters_ = before;
        evaluate_all();
        damping = std::max(damping * 30, 1e-4);
        if (damping > 1e6) break;
      }
    }
    return plausible();
  }

  bool plausible() const { return parameters_.allFinite() && parameters_[kWhite] > parameters_[kBlack]; }

  // Drops cells whose pixels disagree with the model as a block: something covers them.
  void drop_covered_cells() {
    struct Cell {
      double sum = 0;
      int count = 0;
    };
    constexpr double kMaxTerm = 100;
    constexpr double kMaxMean = 12;
    constexpr int kMinPixels = 6;
    const auto side = static_cast<std::size_t>(request_.pattern.cells() + 2);
    std::vector<Cell> cells(side * side);
    const double scale = robust_scale();
    for (std::size_t i = 0; i < residuals_.size(); ++i) {
      const double r = residuals_[i] / scale;
      Cell& cell = cells[static_cast<std::size_t>(selected_.pixels[i].cell)];
      cell.sum += std::min(r * r, kMaxTerm);
      ++cell.count;
    }
    for (FitPixel& pixel : selected_.pixels) {
      const Cell& cell = cells[static_cast<std::size_t>(pixel.cell)];
      pixel.kept = cell.count < kMinPixels || cell.sum < kMaxMean * cell.count;
    }
  }

  void finish(PhotometricFit& fit) {
    const Normals at = normals(false);
    Normals with_priors = at;
    add_priors(with_priors);
    const auto count = static_cast<Eigen::Index>(active_list_.size());
    Eigen::MatrixXd n = with_priors.n.topLeftCorner(count, count);
    n.triangularView<Eigen::StrictlyLower>() = n.transpose();
    const Eigen::LDLT<Eigen::MatrixXd> decomposition(n);
    if (decomposition.info() != Eigen::Success || !decomposition.isPositive()) return;
    const Eigen::MatrixXd covariance = decomposition.solve(Eigen::MatrixXd::Identity(count, count));

    const int geometry = request_.affine ? 6 : 8;
    measure_residuals(fit, covariance, geometry);
    place_corners(fit, covariance.topLeftCorner(geometry, geometry), geometry);
    fit.blur_px = std::sqrt(parameters_[kBlur]);
    fit.black = parameters_[kBlack];
    fit.white = parameters_[kWhite];
    share_information(fit, at);
    fit.converged = fit.covariance_px2.allFinite();
  }

  // Fit quality, and the score's covariance summed by blocks (White 1980, clustered): residuals of
  // neighbouring pixels are not independent after JPEG or where the model misfits.
  void measure_residuals(PhotometricFit& fit, const Eigen::MatrixXd& covariance, int geometry) const {
    const auto count = static_cast<Eigen::Index>(active_list_.size());
    const Eigen::MatrixXd geometry_rows = covariance.topRows(geometry);
    const Eigen::MatrixXd information = covariance.topLeftCorner(geometry, geometry).inverse();
    double clustered = 0;
    double blocks = 0;
    Vector score;  // of the block at hand: pixels come block by block
    int block = -1;
    const auto end_block = [&] {
      if (block < 0) return;
      const Eigen::VectorXd shift = geometry_rows * score.head(count);
      clustered += shift.dot(information * shift);
      blocks += 1;
    };
    double sum = 0;
    double squares = 0;
    double used = 0;
    int agreeing = 0;
    for (std::size_t i = 0; i < residuals_.size(); ++i) {
      const FitPixel& pixel = selected_.pixels[i];
      const double residual = residuals_[i];
      if (pixel.kept && std::abs(residual) < 5 * scale_) ++agreeing;
      if (!pixel.kept) continue;
      const double robust = robust_weight(i);
      sum += robust * residual * residual;
      squares += robust * std::pow(residual / pixel.weight, 2);
      used += 1;
      if (pixel.block != block) {
        end_block();
        block = pixel.block;
        score.setZero();
      }
      score.head(count) += residual * robust *
                           Eigen::Map<const Eigen::VectorXd>(rows_.data() + i * active_list_.size(), count);
    }
    end_block();
    const double free = std::max(used - static_cast<double>(active_list_.size()), 1.0);
    fit.pixels = static_cast<int>(used);
    fit.chi2_per_dof = sum / free;
    const ToneResponse tone(photograph_.tone.nominal(), parameters_[kShared], parameters_[kShared + 1]);
    const double contrast = tone.encode(parameters_[kWhite]).value - tone.encode(parameters_[kBlack]).value;
    fit.misfit = std::sqrt(squares / std::max(used, 1.0)) / std::max(contrast, 1e-9);
    fit.visible = agreeing / std::max(1.0, static_cast<double>(selected_.pixels.size()));
    fit.saturated =
        selected_.clipped / std::max(1.0, static_cast<double>(selected_.pixels.size() +
                                                              static_cast<std::size_t>(selected_.clipped)));
    const double unbiased = blocks > geometry + 1 ? blocks / (blocks - geometry) : 1;
    fit.covariance_factor = std::max(clustered / geometry * unbiased, 1e-12);
  }

  void place_corners(PhotometricFit& fit, const Eigen::MatrixXd& covariance, int geometry) const {
    static constexpr double kSquare[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    const InverseHomography g = parameters_.segment<8>(kHomography);
    Eigen::Matrix3d forward;
    forward << g[0], g[1], g[2], g[3], g[4], g[5], g[6], g[7], 1;
    forward = forward.inverse().eval();
    const PixelMap map = map_after_fit();
    const auto place = [&](double tx, double ty, Eigen::Matrix<double, 2, 8>& by_g) {
      const Eigen::Vector2d n = (forward * Eigen::Vector3d(tx, ty, 1)).hnormalized();
      const SquarePoint square = square_point(g, n);
      Eigen::Matrix<double, 2, 8> t_by_g;
      t_by_g << n.x(), n.y(), 1, 0, 0, 0, -tx * n.x(), -tx * n.y(), 0, 0, 0, n.x(), n.y(), 1, -ty * n.x(),
          -ty * n.y();
      t_by_g *= square.scale;
      Eigen::Matrix2d by_ideal;
      const Eigen::Vector2d px = map.pixel_from_ideal(frame_.middle + frame_.half_side * n, &by_ideal);
      by_g = -by_ideal * frame_.half_side * square.by_point.inverse() * t_by_g;
      return px;
    };
    Eigen::Matrix<double, 8, 8> corners_by_g;
    for (int i = 0; i < 4; ++i) {
      Eigen::Matrix<double, 2, 8> by_g;
      fit.corners_px[static_cast<std::size_t>(i)] = place(kSquare[i][0], kSquare[i][1], by_g);
      corners_by_g.middleRows<2>(2 * i) = by_g;
    }
    Eigen::Matrix<double, 2, 8> by_g;
    fit.centre_px = place(0, 0, by_g);
    fit.covariance_px2 =
        corners_by_g.leftCols(geometry) * covariance * corners_by_g.leftCols(geometry).transpose();
    fit.centre_covariance_px2 = by_g.leftCols(geometry) * covariance * by_g.leftCols(geometry).transpose();
  }

  PixelMap map_after_fit() const {
    if (!request_.free_lens) return photograph_.map;
    const LensStandIn lens = photograph_.map.stand_in();
    return {grey_.cols, grey_.rows,
            LensStandIn{lens.k1 + parameters_[kShared + 2], lens.k2 + parameters_[kShared + 3]}};
  }

  // Schur complement of everything but the shared parameters.
  void share_information(PhotometricFit& fit, const Normals& at) const {
    fit.shared_information.setZero();
    fit.shared = parameters_.segment<kNumShared>(kShared);
    const auto count = static_cast<Eigen::Index>(active_list_.size());
    const auto first_shared =
        std::count_if(active_list_.begin(), active_list_.end(), [](int i) { return i < kShared; });
    const auto own = static_cast<Eigen::Index>(first_shared);
    const Eigen::Index shared = count - own;
    if (shared == 0) return;
    Eigen::MatrixXd inner = at.n.topLeftCorner(own, own);
    inner.diagonal().array() += 1e-9 * inner.diagonal().maxCoeff();
    const Eigen::MatrixXd cross = at.n.block(0, own, own, shared);
    const Eigen::MatrixXd rest =
        at.n.block(own, own, shared, shared) - cross.transpose() * inner.ldlt().solve(cross);
    for (Eigen::Index a = 0; a < shared; ++a) {
      for (Eigen::Index b = 0; b < shared; ++b) {
        fit.shared_information(active_list_[static_cast<std::size_t>(own + a)] - kShared,
                               active_list_[static_cast<std::size_t>(own + b)] - kShared) = rest(a, b);
      }
    }
  }

  const cv::Mat& grey_;
  const PhotographModel& photograph_;
  const FitRequest& request_;
  Vector prior_sigmas_;
  FitFrame frame_;
  cv::Rect box_;
  std::optional<PixelMapPatch> patch_;
  FitPixels selected_;
  Vector parameters_ = Vector::Zero();
  Vector start_ = Vector::Zero();
  std::array<bool, kCount> active_{};
  std::vector<int> active_list_;
  std::vector<double> residuals_;  // whitened
  std::vector<double> rows_;       // whitened derivatives by the active parameters, pixel by pixel
  double scale_ = kNoLimit;        // of the residuals, for the robust weights
};

}  // namespace

PhotometricFit fit_pattern(const cv::Mat& grey, const PhotographModel& photograph,
                           const FitRequest& request) {
  return MarkerFit(grey, photograph, request).run();
}

}  // namespace hexcal
