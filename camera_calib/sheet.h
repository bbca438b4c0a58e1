#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hexcal {

/// Kinds of printed calibration sheets: grids of `columns` x `rows` cells, read row by row from the printed
/// top left.
enum class SheetKind {
  aprilgrid,   ///< square markers with a white gap (`spacing_mm`) between them
  chessboard,  ///< squares, the top-left one black; measured points are the inner corners
  charuco,     ///< a chessboard with a marker in every white square; the top-left square is black unless
               ///< `top_left_white` (OpenCV's older boards with an even number of rows)
  dots,     ///< black dots at a pitch, some replaced by markers so that any part of the sheet is identified
  markers,  ///< to be cut out and glued on; as a template it counts like an aprilgrid with listed ids
  photomodeler,  ///< PhotoModeler's sheet: dots at a pitch, four of them ringed (4 and 3 arcs at the top, 2
                 ///< and 1 at the bottom)
};

[[nodiscard]] std::string_view sheet_kind_name(SheetKind kind);
[[nodiscard]] std::optional<SheetKind> sheet_kind_from_name(std::string_view name);
[[nodiscard]] const std::vector<std::string>& sheet_kind_names();

/// What a sheet.yaml says. Only the fields of the kind are used; sizes have no defaults.
struct Sheet {
  SheetKind kind = SheetKind::aprilgrid;
  std::string family;           ///< marker family or dictionary (marker.h); empty without markers
  int columns = 0;              ///< tags, squares or dots per row
  int rows = 0;                 ///< rows of them
  double marker_mm = 0;         ///< edge of a marker's square
  double spacing_mm = 0;        ///< white gap between prints of markers (aprilgrid, markers)
  double pitch_mm = 0;          ///< edge of a chessboard square, or dot to dot
  double dot_mm = 0;            ///< diameter of a dot
  int first_id = 0;             ///< marker at the printed top left
  std::vector<int> ids;         ///< kind markers: ids in print order, at most columns * rows of them
  bool top_left_white = false;  ///< charuco only

  /// Throws InputError naming the field, its value and what is wanted.
  void validate() const;
};

/// A square marker printed upright. Its corners in the sheet are centre + (-+ size/2, +- size/2).
struct SheetMarker {
  int id = -1;
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
  double size_mm = 0;

  /// Corner 0 top-left, 1 top-right, 2 bottom-right, 3 bottom-left.
  [[nodiscard]] Eigen::Vector2d corner_mm(int corner) const {
    return centre_mm +
           0.5 * size_mm * Eigen::Vector2d(corner == 1 || corner == 2 ? 1 : -1, corner < 2 ? 1 : -1);
  }
};

/// A black axis-parallel rectangle: a chessboard square.
struct SheetSquare {
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
  double size_mm = 0;
};

/// PhotoModeler's rings, from inner to outer radius in diameters of their dot.
inline constexpr double kRingInner = 1.3;
inline constexpr double kRingOuter = 2.1;

/// A filled black circle. PhotoModeler's ringed dots have a broken ring around them, whose number of arcs (1
/// to 4) tells them apart.
struct SheetDot {
  int column = 0, row = 0;
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
  double diameter_mm = 0;
  int ring_arcs = 0;
};

/// An inner corner of a chessboard, column and row counted from the printed top left.
struct SheetSaddle {
  int column = 0, row = 0;
  Eigen::Vector2d position_mm = Eigen::Vector2d::Zero();
};

/// Everything printed and measured. Frame of a sheet: origin at the centre of the printed pattern, x right, y
/// up, z towards the viewer, mm.
struct SheetGeometry {
  std::vector<SheetMarker> markers;
  std::vector<SheetSquare> squares;  ///< black squares of chessboard and charuco
  std::vector<SheetSaddle> saddles;
  std::vector<SheetDot> dots;
  Eigen::Vector2d extent_mm = Eigen::Vector2d::Zero();  ///< width and height of the pattern
};

[[nodiscard]] SheetGeometry sheet_geometry(const Sheet& sheet);

/// A point of a sheet that photographs measure: marker corners (number 4 k + corner of the k-th marker), then
/// saddles, then dots, in the order of SheetGeometry.
struct SheetPoint {
  std::string name;  ///< "205.3" (id.corner), "c4r7" (saddle or dot)
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
};

[[nodiscard]] std::vector<SheetPoint> sheet_points(const SheetGeometry& geometry);

/// One line for people: "aprilgrid tag36h11 8 x 6, tags 40 mm, gap 15 mm, ids 200-247".
[[nodiscard]] std::string describe_sheet(const Sheet& sheet);

}  // namespace hexcal
