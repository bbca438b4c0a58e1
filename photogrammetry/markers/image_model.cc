#include "photogrammetry/markers/image_model.h"

#include <algorithm>
#include <cmath>

#include "photogrammetry/markers/normal_distribution.h"

namespace hexcal {
namespace {

// By how much the curve moves the middle of a straight edge with a Gaussian blur of unit variance towards
// black: the integral of the encoded edge, from 0 to 1, minus the step. Midpoint rule over +-4.
double encoded_edge_shift(const ToneResponse& tone, double black, double white) {
  constexpr int kSteps = 32;
  constexpr double kReach = 4;
  const double low = tone.encode(black).value;
  const double range = tone.encode(white).value - low;
  if (!(range > 1e-6)) return 0;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double d = kReach * ((i + 0.5) * 2 / kSteps - 1);
    const double share = standard_normal(d).cdf;
    sum += (tone.encode(black + (white - black) * share).value - low) / range - (d > 0 ? 1 : 0);
  }
  return sum * 2 * kReach / kSteps;
}

}  // namespace

ImageModel::ImageModel(const FitRequest& request, ToneCurve nominal, const ImageVector& start)
    : request_(request), nominal_(nominal), start_lens_(start.segment<2>(kLens)), tone_(nominal) {
  set(start);
}

void ImageModel::set(const ImageVector& parameters) {
  p_ = parameters;
  tone_ = ToneResponse(nominal_, p_[kTone], p_[kTone + 1]);
  sharpened_ = request_.free_sharpening || p_[kSharpening] != 0;
  if (!sharpened_) return;
  edge_shift_px_ = encoded_edge_shift(tone_, p_[kBlack], p_[kWhite]) * std::sqrt(p_[kBlur] + kPixelVariance);
}

ImageModel::Place ImageModel::place(const FitPixel& pixel) const {
  Place at;
  at.point = pixel.point;
  if (request_.free_lens) at.point += pixel.by_lens * (p_.segment<2>(kLens) - start_lens_);
  at.square = square_point(InverseHomography(p_.segment<8>(kHomography)), at.point);
  const double half_square = 0.5 * request_.square_cells;
  const double middle = 0.5 * request_.pattern.cells();
  at.cells_by_px = half_square * at.square.by_point * pixel.by_px;
  at.x = half_square * at.square.t.x() + middle;
  at.y = half_square * at.square.t.y() + middle;
  return at;
}

PatternSample ImageModel::blurred(const Place& at, double more_px2) const {
  const double a = at.cells_by_px(0, 0);
  const double b = at.cells_by_px(0, 1);
  const double c = at.cells_by_px(1, 0);
  const double d = at.cells_by_px(1, 1);
  const double mean = p_[kBlur] + kPixelVariance + more_px2;
  const double xx = mean + p_[kBlur + 1];
  const double xy = p_[kBlur + 2];
  const double yy = mean - p_[kBlur + 1];
  const Symmetric2 spread{a * a * xx + 2 * a * b * xy + b * b * yy,
                          a * c * xx + (a * d + b * c) * xy + b * d * yy,
                          c * c * xx + 2 * c * d * xy + d * d * yy};
  return request_.pattern.sample(at.x, at.y, spread);
}

double ImageModel::white_share(const FitPixel& pixel) const { return blurred(place(pixel), 0).value; }

// Derivatives by homography and lens of a value whose derivatives by the pattern's coordinates (cells) are
// given, added.
void ImageModel::add_geometry(const Place& at, const FitPixel& pixel, double by_x, double by_y,
                              ImageVector& row) const {
  const double half_square = 0.5 * request_.square_cells;
  const double tx = by_x * half_square * at.square.scale;
  const double ty = by_y * half_square * at.square.scale;
  row[0] += tx * at.point.x();
  row[1] += tx * at.point.y();
  row[2] += tx;
  row[3] += ty * at.point.x();
  row[4] += ty * at.point.y();
  row[5] += ty;
  const double along = tx * at.square.t.x() + ty * at.square.t.y();
  row[6] -= along * at.point.x();
  row[7] -= along * at.point.y();
  if (!request_.free_lens) return;
  const Eigen::RowVector2d by_point = half_square * Eigen::RowVector2d(by_x, by_y) * at.square.by_point;
  row.segment<2>(kLens) += (by_point * pixel.by_lens).transpose();
}

// The model's encoded value at a pixel and its derivatives.
double ImageModel::value(const FitPixel& pixel, ImageVector& row) const {
  const Place at = place(pixel);
  const PatternSample s = blurred(at, 0);
  const double ox = pixel.offset.x();
  const double oy = pixel.offset.y();
  const double shade = 1 + p_[kLight] * ox + p_[kLight + 1] * oy + p_[kLight + 2] * ox * ox +
                       p_[kLight + 3] * ox * oy + p_[kLight + 4] * oy * oy;
  const double unshaded = p_[kBlack] + (p_[kWhite] - p_[kBlack]) * s.value;
  const ToneResponse::Encoded encoded = tone_.encode(unshaded * shade);
  const double by_share = encoded.by_light * shade * (p_[kWhite] - p_[kBlack]);
  row.setZero();
  add_geometry(at, pixel, by_share * s.by_x, by_share * s.by_y, row);
  // Heat equation, carried to pixels: half of A^T (second derivatives) A.
  const double a = at.cells_by_px(0, 0);
  const double b = at.cells_by_px(0, 1);
  const double c = at.cells_by_px(1, 0);
  const double d = at.cells_by_px(1, 1);
  const Symmetric2& h = s.second;
  const double hxx = a * a * h.xx + 2 * a * c * h.xy + c * c * h.yy;
  const double hxy = a * b * h.xx + (a * d + b * c) * h.xy + c * d * h.yy;
  const double hyy = b * b * h.xx + 2 * b * d * h.xy + d * d * h.yy;
  row[kBlur] = by_share * 0.5 * (hxx + hyy);
  row[kBlur + 1] = by_share * 0.5 * (hxx - hyy);
  row[kBlur + 2] = by_share * hxy;
  row[kBlack] = encoded.by_light * shade * (1 - s.value);
  row[kWhite] = encoded.by_light * shade * s.value;
  const double by_shade = encoded.by_light * unshaded;
  row[kLight] = by_shade * ox;
  row[kLight + 1] = by_shade * oy;
  row[kLight + 2] = by_shade * ox * ox;
  row[kLight + 3] = by_shade * ox * oy;
  row[kLight + 4] = by_shade * oy * oy;
  row[kTone] = encoded.by_first;
  row[kTone + 1] = encoded.by_second;
  double result = encoded.value;
  if (sharpened_) sharpen(at, pixel, shade, result, row);
  return result;
}

// Adds amount (E - G * E). The derivatives leave out how the edges' shift itself changes, which is small
// beside them.
void ImageModel::sharpen(const Place& at, const FitPixel& pixel, double shade, double& encoded,
                         ImageVector& row) const {
  const double amount = p_[kSharpening];
  const PatternSample s = blurred(at, p_[kSharpening + 1]);
  const ToneResponse::Encoded black = tone_.encode(p_[kBlack] * shade);
  const ToneResponse::Encoded white = tone_.encode(p_[kWhite] * shade);
  const double range = white.value - black.value;
  // Gradient of the share by the pixel.
  const double a = at.cells_by_px(0, 0);
  const double b = at.cells_by_px(0, 1);
  const double c = at.cells_by_px(1, 0);
  const double d = at.cells_by_px(1, 1);
  const double gx = a * s.by_x + c * s.by_y;
  const double gy = b * s.by_x + d * s.by_y;
  const double share = s.value + edge_shift_px_ * std::sqrt(gx * gx + gy * gy);
  const double soft = black.value + range * share;
  const double difference = encoded - soft;
  encoded += amount * difference;

  row *= 1 + amount;
  add_geometry(at, pixel, -amount * range * s.by_x, -amount * range * s.by_y, row);
  const Symmetric2& h = s.second;
  const double laplacian =
      a * a * h.xx + 2 * a * c * h.xy + c * c * h.yy + b * b * h.xx + 2 * b * d * h.xy + d * d * h.yy;
  const double by_variance = 0.5 * range * laplacian;
  row[kBlur] -= amount * by_variance;
  row[kBlack] -= amount * black.by_light * shade * (1 - share);
  row[kWhite] -= amount * white.by_light * shade * share;
  const double by_shade = black.by_light * p_[kBlack] * (1 - share) + white.by_light * p_[kWhite] * share;
  const double ox = pixel.offset.x();
  const double oy = pixel.offset.y();
  row.segment<5>(kLight) -=
      amount * by_shade * (Eigen::Matrix<double, 5, 1>() << ox, oy, ox * ox, ox * oy, oy * oy).finished();
  row[kTone] -= amount * (black.by_first * (1 - share) + white.by_first * share);
  row[kTone + 1] -= amount * (black.by_second * (1 - share) + white.by_second * share);
  row[kSharpening] = difference;
  row[kSharpening + 1] = -amount * by_variance;
}

void ImageModel::evaluate(const std::vector<FitPixel>& pixels, const std::vector<int>& active,
                          std::vector<double>& residuals, std::vector<double>& rows) const {
  const std::size_t count = active.size();
  residuals.resize(pixels.size());
  rows.resize(pixels.size() * count);
  ImageVector row;
  for (std::size_t at = 0; at < pixels.size(); ++at) {
    const FitPixel& pixel = pixels[at];
    const double model = value(pixel, row);
    double* const out = rows.data() + at * count;
    if (pixel.censored != 0 && (model - pixel.value) * pixel.censored >= 0) {
      residuals[at] = 0;
      std::fill_n(out, count, 0.0);
      continue;
    }
    residuals[at] = (pixel.value - model) * pixel.weight;
    for (std::size_t k = 0; k < count; ++k) out[k] = row[active[k]] * pixel.weight;
  }
}

}  // namespace hexcal
