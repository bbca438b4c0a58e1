#pragma once

#include <map>
#include <optional>
#include <vector>

#include "photogrammetry/adjustment/adjustment_result.h"
#include "pose_extract/campaign.h"

// Parts of the fit of a body to nominal coordinates (datum_frame.h).

namespace hexcal {

using Matrix7d = Eigen::Matrix<double, 7, 7>;
using Vector7d = Eigen::Matrix<double, 7, 1>;

/// How a hand places stickers: each shifts by this much per axis and turns about itself.
struct Placement {
  double shift_mm = 0;
  double turn_rad = 0;
};

/// What is assumed where the coordinates state no sigma and too few stickers tell of it.
inline constexpr Placement kHandPlacement{0.3, 0.02};

/// The points of one sticker that have nominal coordinates, m of them, as rows of three.
struct NominalSticker {
  int id = -1;
  std::vector<NominalPoint> points;
  std::vector<char> used;
  Eigen::Matrix3Xd in_body;    ///< measured, mm
  Eigen::MatrixXd by_error;    ///< 3m x errors of the adjustment
  Eigen::MatrixXd covariance;  ///< 3m x 3m of in_body, without what moves the body as a whole
  [[nodiscard]] bool any_used() const;
};

/// The measured points of a body that have nominal coordinates, by sticker.
[[nodiscard]] std::vector<NominalSticker> nominal_stickers(const Network& network,
                                                           const AdjustmentResult& adjusted, int body,
                                                           const std::vector<NominalPoint>& nominal);

/// A similarity that takes points to others.
struct RobustMotion {
  Rigid3 motion;
  double scale = 1;
  double median_mm = 0;  ///< of what is left
  double most_mm = 0;    ///< of what is left: four fifths of the points lie nearer
};

/// From every triple of a few spread points; the one with the least median distance wins, so that up to half
/// of the points may be wrong. None if no triple spans a triangle.
[[nodiscard]] std::optional<RobustMotion> robust_motion(const Eigen::Matrix3Xd& from,
                                                        const Eigen::Matrix3Xd& to, bool with_scale);

/// A motion (and scale) of the used points of `stickers` to their nominal coordinates.
struct NominalFit {
  Rigid3 frame_from_body;
  double scale = 1;
  bool with_scale = false;
  Placement placement;
  double point_mm = 0;  ///< by which each point is off by itself, per axis: rounded tables, the print
  Matrix7d covariance = Matrix7d::Zero();  ///< of the perturbation; without scale its last row is zero
  double chi2 = 0;
  int redundancy = 0;
};

/// One Gauss-Newton step from `fit` with the weights of its placement; returns the step's size. With `gains`
/// d(perturbation)/d(points in the frame) of each sticker, 7 x 3m, zero for points that are not used.
double improve_fit(const std::vector<NominalSticker>& stickers, NominalFit& fit,
                   std::vector<Eigen::MatrixXd>* gains = nullptr);

/// Covariance of a sticker's nominal coordinates, 3m x 3m: what they state and its placement.
[[nodiscard]] Eigen::MatrixXd nominal_covariance(const NominalSticker& sticker, const NominalFit& fit);

/// Variance components of the placement, and of single points, by restricted maximum likelihood (Patterson
/// and Thompson 1971; iteration of Foerstner 1979), with the factor by which few stickers tell their own
/// scatter badly. Where sigmas are stated, zero unless the residuals contradict them.
void fit_placement(const std::vector<NominalSticker>& stickers, NominalFit& fit);

}  // namespace hexcal
