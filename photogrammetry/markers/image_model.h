#pragma once

#include <Eigen/Core>
#include <vector>

#include "photogrammetry/markers/fit_pixels.h"
#include "photogrammetry/markers/photometric_fit.h"

namespace hexcal {

/// Where the parameters of a marker's image stand in an ImageVector.
enum ImageParameter : int {
  kHomography = 0,  ///< 8, see InverseHomography
  kBlur = 8,        ///< mean variance of the point spread, half the difference x - y, covariance; px^2
  kBlack = 11,      ///< light, share of full scale
  kWhite = 12,
  kLight = 13,      ///< illumination gradient x, y; then xx, xy, yy, per half side of the square
  kTone = 18,       ///< first, second of ToneResponse
  kLens = 20,       ///< k1, k2 of LensStandIn
  kSharpening = 22  ///< amount, variance of the mask's blur in px^2
};
constexpr int kImageParameters = 24;
constexpr int kShared = kTone;  ///< from here on they are the photograph's
static_assert(kImageParameters - kShared == kNumShared);
using ImageVector = Eigen::Matrix<double, kImageParameters, 1>;

constexpr double kPixelVariance = 1.0 / 12;  ///< of the square that a pixel integrates over, px^2

/// The encoded value of a marker's pixels. In light: the pattern, mapped by a homography and the lens,
/// blurred by a Gaussian (optics, filter and the pixel's own area), between two levels, shaded by a
/// polynomial. Then the tone curve. Then sharpening as cameras and programs do it, an unsharp mask in encoded
/// values E,
///   value = E + amount (E - G * E),
/// G a Gaussian; absent, amount 0, it costs nothing. A blurred edge of encoded values is no longer in its
/// middle, because the curve is not straight; G * E is taken as the pattern under both blurs, moved by what
/// the curve moves a straight edge.
class ImageModel {
 public:
  /// `start`: the lens parameters that the pixels' `point` was computed with.
  ImageModel(const FitRequest& request, ToneCurve nominal, const ImageVector& start);

  void set(const ImageVector& parameters);

  /// White share of the pattern at a pixel.
  [[nodiscard]] double white_share(const FitPixel& pixel) const;

  /// Whitened residuals, observed minus modelled, and rows of the model's whitened derivatives by the
  /// parameters `active`, pixel by pixel. A clipped pixel contradicts only a model on the other side of its
  /// bound (Tobin 1958, with the noise about the bound left out): else its residual and row are zero.
  void evaluate(const std::vector<FitPixel>& pixels, const std::vector<int>& active,
                std::vector<double>& residuals, std::vector<double>& rows) const;

 private:
  struct Place {
    Eigen::Vector2d point;  // in the fit's plane
    SquarePoint square;
    Eigen::Matrix2d cells_by_px;
    double x, y;  // cells
  };
  [[nodiscard]] Place place(const FitPixel& pixel) const;
  [[nodiscard]] PatternSample blurred(const Place& at, double more_px2) const;
  double value(const FitPixel& pixel, ImageVector& row) const;
  void sharpen(const Place& at, const FitPixel& pixel, double shade, double& encoded, ImageVector& row) const;
  void add_geometry(const Place& at, const FitPixel& pixel, double by_x, double by_y, ImageVector& row) const;

  const FitRequest& request_;
  ToneCurve nominal_;
  Eigen::Vector2d start_lens_;
  ImageVector p_ = ImageVector::Zero();
  ToneResponse tone_;
  bool sharpened_ = false;
  double edge_shift_px_ = 0;  // of encoded edges towards black
};

}  // namespace hexcal
