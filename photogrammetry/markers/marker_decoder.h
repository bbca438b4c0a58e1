#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "photogrammetry/markers/marker.h"
#include "photogrammetry/markers/quad_finder.h"

namespace hexcal {

/// What was read in a quadrilateral.
struct DecodedMarker {
  int id = -1;
  bool mirrored = false;
  bool inverted = false;
  int wrong_cells = 0;  ///< of those that carry the id
  double clarity =
      0;  ///< mean distance of the cells from the threshold, in half contrasts, wrong ones negative
  std::array<Eigen::Vector2d, 4> corners_px;  ///< in the marker's order
};

/// Reads cells and compares them with all patterns of a family in four rotations, straight and mirrored. The
/// number of wrong cells that is accepted follows from the family's distance and from how likely a chance hit
/// is.
class MarkerDecoder {
 public:
  /// `ids`: those to accept, none: all.
  MarkerDecoder(const MarkerFamily& family, const std::vector<int>& ids);

  [[nodiscard]] std::optional<DecodedMarker> decode(const cv::Mat& grey, const Quad& quad) const;

 private:
  struct Code {
    std::uint64_t word;
    int id;
  };
  int cells_ = 0;
  double square_cells_ = 0;
  int max_wrong_ = 0;
  std::vector<int> data_cells_;   // that differ between patterns, or would after a rotation
  std::vector<int> black_cells_;  // black in all patterns
  std::vector<int> white_cells_;  // white in all patterns
  std::vector<Code> codes_;
};

}  // namespace hexcal
