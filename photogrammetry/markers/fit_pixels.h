#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "photogrammetry/markers/fit_plane.h"
#include "photogrammetry/markers/photometric_fit.h"

namespace hexcal {

struct FitPixel {
  Eigen::Vector2d point;    ///< in the fit's plane, for the stand-in lens as it is
  Eigen::Matrix2d by_px;    ///< its derivatives by the pixel
  Eigen::Matrix2d by_lens;  ///< and by the lens stand-in; only if that is free
  Eigen::Vector2d offset;   ///< of the pixel from the marker's middle in half sides, for the illumination
  double value;             ///< encoded, share of full scale; where it clips, the bound
  int censored = 0;         ///< +1: at the bound or above, -1: at it or below; 0: seen
  double weight = 0;        ///< 1 / standard deviation of noise
  int cell = 0;             ///< cell of the pattern with its ring, for occlusion
  int block = 0;            ///< block of 8 x 8 pixels, JPEG's grid
  bool kept = true;
};

struct FitPixels {
  std::vector<FitPixel> pixels;
  int clipped = 0;  ///< of them, censored
};

struct PixelSelection {
  InverseHomography homography;
  FitFrame frame;
  double reach_px = 4;  ///< around transitions
  double near_px = 1;   ///< where thinning takes four times as many
  int max_pixels = 0;   ///< thinned to about so many
};

/// The pixels around the pattern's transitions, by blocks of 8 x 8.
[[nodiscard]] FitPixels select_pixels(const cv::Mat& grey, const PhotographModel& photograph,
                                      const PixelMapPatch& patch, const FitRequest& request,
                                      const cv::Rect& box, const PixelSelection& selection);

}  // namespace hexcal
