#pragma once

#include <Eigen/Core>
#include <compare>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "kinematics/geometry/rigid3.h"

namespace hexcal {

/// A corner of a marker, or its centre (corner -1). Written `9.2` and `9`.
struct MarkerPoint {
  int id = -1;
  int corner = -1;
  auto operator<=>(const MarkerPoint&) const = default;
};

/// A known distance between two points of one body.
struct KnownLength {
  MarkerPoint a, b;
  double length_mm = 0;
  double sigma_mm = 0;  ///< standard deviation of length_mm
};

/// A point with known coordinates in the frame it defines.
struct NominalPoint {
  MarkerPoint point;
  Eigen::Vector3d xyz_mm = Eigen::Vector3d::Zero();
  double sigma_mm = 0;  ///< per axis; 0: not stated, the fit tells it
};

/// The markers glued on one body: edge of the black square in mm by id.
using MarkerSizes = std::map<int, double>;

/// A feature fitted to points of one body. A marker without a corner stands for its four corners.
struct Feature {
  enum class Kind { point, line, plane, circle, cylinder, sphere };
  Kind kind = Kind::point;
  std::vector<MarkerPoint> points;
  std::optional<MarkerPoint> towards;  ///< the direction points to the side on which this point lies
};

/// 3-2-1 construction of a frame: z is the direction of the first feature, x that of the second made square
/// to z, the origin the place of the third. A direction is a plane's normal, a line's (first to last point)
/// or an axis; a plane's normal points to the side from which its markers are seen unless `towards` says
/// otherwise.
struct FeatureFrame {
  Feature z, x, origin;
  /// The origin moves by this along x, y, z: sticker thickness, distance from a plane to the end plate.
  Eigen::Vector3d offset_mm = Eigen::Vector3d::Zero();
  /// Markers farther from their feature are left out; 0: the least that most of them keep, up to 0.5 mm.
  double tolerance_mm = 0;
};

/// How a body's frame (UG of the fixed body, LG of the moving one) is found.
struct FrameRule {
  /// markers: UG from the fixed body's own markers and home, see frame_from_markers.
  enum class From { nominal, home, features, markers };
  From from = From::nominal;
  std::optional<std::filesystem::path> nominal_file;
  std::vector<NominalPoint> nominal;     ///< From::nominal: what nominal_file says
  std::string home_pose;                 ///< From::home: the pose id
  double gd_mm = 0;                      ///< LG: distance O_LG to O_UG at home
  std::optional<FeatureFrame> features;  ///< From::features
  Rigid3 markers_from_frame;             ///< From::markers: where the frame stands in that of the markers
};

/// Relative sigma of the scale of a print that nobody measured: a laser printer's feed and the moisture of
/// the paper move it by about as much.
inline constexpr double kPaperScaleSigma = 0.001;

/// Where the campaign's scale comes from.
enum class ScaleFrom { markers, bars, nominal };

/// A camera of the campaign and the photographs it is for: those of a body with this serial number, those in
/// a folder of this name, or (both empty) all. Where several are for one photograph (one per zoom setting),
/// the first whose image size and lens setting fit.
struct CampaignCamera {
  std::filesystem::path file;
  std::string serial;
  std::string folder;
};

/// What campaign.yaml says, all paths resolved.
struct Campaign {
  std::filesystem::path folder;  ///< of campaign.yaml; results go to folder / "results"
  std::filesystem::path file;    ///< campaign.yaml itself
  std::vector<CampaignCamera> cameras;
  std::optional<std::filesystem::path> hexapod, targets, legs;
  std::filesystem::path images;                       ///< one sub-folder per pose
  std::optional<std::filesystem::path> images_table;  ///< file,pose: for photographs in one flat folder
  std::string family;
  MarkerSizes fixed;   ///< on the upper grip
  MarkerSizes moving;  ///< on the lower grip; empty: a plain photogrammetry project
  std::optional<FrameRule> ug, lg;
  ScaleFrom scale = ScaleFrom::markers;
  double print_scale_sigma = 0;  ///< relative, of the printer's scale when scale is from markers
  std::vector<KnownLength> bars;
  std::vector<KnownLength> checks;  ///< never used in the adjustment, only compared
};

}  // namespace hexcal
