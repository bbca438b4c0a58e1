#include <fmt/format.h>
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <fstream>

#include "tests/support/run_hexcal.h"
#include "tools/io/camera_file.h"
#include "tools/io/csv_table.h"
#include "tools/synthetic/grips.h"
#include "tools/synthetic/jpeg_file.h"
#include "tools/synthetic/lens_profile.h"
#include "tools/synthetic/random_source.h"
#include "tools/synthetic/stations.h"

// A campaign of fixed markers only: a twelve-sided grip photographed all around, its frame from features.

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kSides = 12;
constexpr double kApothemMm = 60;
constexpr double kHeightMm = 50;
constexpr double kMarkerMm = 20;
constexpr int kLifted = 4;
constexpr double kLiftMm = 0.1;

// Markers 0 to 11 on the sides, 12 to 17 on the end plate z = 0, all glued by hand.
std::vector<Sticker> grip_stickers() {
  RandomSource random(3, 1);
  std::vector<Sticker> stickers;
  for (int id = 0; id < kSides + 6; ++id) {
    Sticker sticker;
    sticker.id = id;
    sticker.size_mm = kMarkerMm;
    Rigid3 face;
    if (id < kSides) {
      const double azimuth = 2 * M_PI / kSides * id;
      const Eigen::Vector3d outward(std::cos(azimuth), std::sin(azimuth), 0);
      Eigen::Matrix3d r;
      r << Eigen::Vector3d::UnitZ().cross(outward), Eigen::Vector3d::UnitZ(), outward;
      face = {r, kApothemMm * outward - 0.5 * kHeightMm * Eigen::Vector3d::UnitZ()};
    } else {
      const double azimuth = M_PI / 3 * (id - kSides);
      face = Rigid3::from_translation({35 * std::cos(azimuth), 35 * std::sin(azimuth), 0});
    }
    const Eigen::Vector3d shift(0.4 * random.normal(), 0.4 * random.normal(), id == kLifted ? kLiftMm : 0);
    const Eigen::Vector3d turn(0, 0, kRadPerDeg * random.normal());
    sticker.body_from_marker = face * Rigid3(quaternion_from_rotation_vector(turn), shift);
    stickers.push_back(sticker);
  }
  return stickers;
}

Scene grip_scene(const std::vector<Sticker>& stickers) {
  Scene scene;
  for (const Sticker& sticker : stickers) scene.surfaces.push_back(sticker_surface("tag36h11", sticker));
  const double half_width = kApothemMm * std::tan(M_PI / kSides);
  Surface plate;
  plate.albedo = 0.4F;
  plate.world_from_surface = Rigid3::from_translation({0, 0, -0.05});
  for (int i = 0; i < kSides; ++i) {
    const double azimuth = 2 * M_PI / kSides * i;
    const Eigen::Vector3d outward(std::cos(azimuth), std::sin(azimuth), 0);
    Eigen::Matrix3d r;
    r << Eigen::Vector3d::UnitZ().cross(outward), Eigen::Vector3d::UnitZ(), outward;
    Surface side;
    side.albedo = 0.4F;
    side.world_from_surface = {r, (kApothemMm - 0.05) * outward - 0.5 * kHeightMm * Eigen::Vector3d::UnitZ()};
    side.outline_mm = rectangle_outline(half_width, 0.5 * kHeightMm);
    scene.surfaces.push_back(side);
    const double edge = azimuth + M_PI / kSides;
    plate.outline_mm.emplace_back(kApothemMm / std::cos(M_PI / kSides) *
                                  Eigen::Vector2d(std::cos(edge), std::sin(edge)));
  }
  scene.surfaces.push_back(plate);
  return scene;
}

TEST(GripFeatures, AxisAndEndPlateWithin10MicrometresAndTheLiftedStickerIsNamed) {
  const TemporaryFolder folder;
  const fs::path lab = folder.path() / "lab";
  fs::create_directories(lab / "poses");
  const std::vector<Sticker> stickers = grip_stickers();
  const Scene scene = grip_scene(stickers);
  CalibratedCamera camera;
  camera.model = brown_camera(35, 1400);
  camera.setting.width_px = camera.model.width_px;
  camera.setting.height_px = camera.model.height_px;
  std::ofstream(lab / "camera.yaml") << format_camera_file("", camera);
  const RayLattice lens(camera.model);
  for (int i = 0; i < kSides; ++i) {
    const double azimuth = 2 * M_PI / kSides * (i + 0.3);
    const Rigid3 station = looking_at({600 * std::cos(azimuth), 600 * std::sin(azimuth), 350}, {0, 0, -15},
                                      Eigen::Vector3d::UnitZ(), 0.05 * (i % 3 - 1));
    const auto seed = static_cast<std::uint64_t>(i + 1);
    write_jpeg(lab / "poses" / fmt::format("DSC_{:04d}.jpg", i),
               develop(render(scene, lens, station, {}, seed), {}, seed), {}, {});
  }
  std::ofstream(lab / "campaign.yaml")
      << "camera: camera.yaml\nimages: poses\n"
         "markers: {family: tag36h11, fixed: {ids: [0-17], size_mm: 20}}\n"
         "frames:\n  UG:\n    from: features\n"
         "    z: {cylinder: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11], towards: 12}\n"
         "    x: {line: [15, 12]}\n    origin: {plane: [12, 13, 14, 15, 16, 17]}\n"
         "scale: {from: markers}\nchecks: [{a: 0, b: 6, length_mm: 120}]\n";
  const CommandResult result = run_hexcal({"measure", lab.string()});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr(fmt::format("marker {} lies 0.", kLifted)));
  EXPECT_THAT(result.out, HasSubstr("check 0-6: measured"));

  // The measured frame in the true one, whose x points from marker 15 to 12.
  Eigen::Vector3d x = stickers[12].body_from_marker.translation - stickers[15].body_from_marker.translation;
  x.z() = 0;
  Eigen::Matrix3d axes;
  axes << x.normalized(), Eigen::Vector3d::UnitZ().cross(x.normalized()), Eigen::Vector3d::UnitZ();
  const CsvTable table = CsvTable::read(lab / "results" / "markers.csv");
  const auto rows = static_cast<Eigen::Index>(table.rows());
  ASSERT_EQ(rows, 4 * (kSides + 6));
  Eigen::Matrix3Xd measured(3, rows);
  Eigen::Matrix3Xd truth(3, rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto row = static_cast<std::size_t>(i);
    measured.col(i) << table.number(row, "x_mm"), table.number(row, "y_mm"), table.number(row, "z_mm");
    truth.col(i) =
        axes.transpose() * stickers[static_cast<std::size_t>(table.integer(row, "id"))].corner_in_body(
                               table.integer(row, "corner"));
  }
  const Eigen::Matrix4d true_from_measured = Eigen::umeyama(measured, truth, false);
  const double shift_mm = true_from_measured.topRightCorner<3, 1>().norm();
  const double tilt_deg = std::acos(std::min(1.0, true_from_measured(2, 2))) * kDegPerRad;
  const double turn_deg = std::atan2(true_from_measured(1, 0), true_from_measured(0, 0)) * kDegPerRad;
  RecordProperty("shift_um", fmt::format("{:.2f}", shift_mm * 1e3));
  fmt::print("axis and end plate: origin {:.2f} um, tilt {:.4f} deg, turn {:.4f} deg\n", shift_mm * 1e3,
             tilt_deg, turn_deg);
  EXPECT_LT(shift_mm, 0.010);
  EXPECT_LT(tilt_deg, 0.01);
  EXPECT_LT(std::abs(turn_deg), 0.01);
}

}  // namespace
}  // namespace hexcal
