#include "tools/io/camera_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "kinematics/geometry/input_error.h"
#include "tools/io/atomic_file.h"
#include "tools/io/sheet_file.h"

namespace hexcal {
namespace {

class CameraFileTest : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& text) const {
    const std::filesystem::path path =
        std::filesystem::path(testing::TempDir()) /
        (std::string("hexcal_") + testing::UnitTest::GetInstance()->current_test_info()->name() + ".yaml");
    write_file_atomically(path, text);
    return path;
  }
};

CalibratedCamera example() {
  CalibratedCamera camera;
  camera.model = CameraModel(6016, 4000, 9011.1 / 3, LensModel::radial);
  camera.model.parameters[4] = 1.0 / 3.0;
  camera.model.valid_radius = 1.25;
  const Eigen::Index n = camera.model.parameters.size();
  camera.covariance = Eigen::MatrixXd::Identity(n, n) / 7.0;
  camera.covariance(0, 2) = camera.covariance(2, 0) = 0.01;
  camera.setting = {6016, 4000, "NIKON CORPORATION", "NIKON \"D3200\"", "12\\34", "18-105", 158, 35.0, 74,
                    8.0,  false};
  camera.quality = {CameraVerdict::usable, 0.0312, 1.04, 14, 2345, 0.003, 0.02, 0.011, 96.5};
  return camera;
}

std::string message_of(const std::filesystem::path& path) {
  try {
    (void)read_camera_file(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST_F(CameraFileTest, ReadsBackTheSameDoubles) {
  const CalibratedCamera camera = example();
  const CalibratedCamera again = read_camera_file(write(format_camera_file("# head\n", camera)));
  EXPECT_EQ(again.model.lens, LensModel::radial);
  EXPECT_EQ(again.model.parameters, camera.model.parameters);
  EXPECT_EQ(again.model.valid_radius, camera.model.valid_radius);
  EXPECT_EQ(again.covariance, camera.covariance);
  EXPECT_EQ(again.setting.model, camera.setting.model);
  EXPECT_EQ(again.setting.serial, camera.setting.serial);
  EXPECT_EQ(again.setting.vibration_reduction, false);
  EXPECT_EQ(again.quality.verdict, CameraVerdict::usable);
  EXPECT_EQ(again.quality.points, 2345);
}

TEST_F(CameraFileTest, RefusesWhatDoesNotFitTogether) {
  const std::string good = format_camera_file("", example());
  const auto changed = [&good](const std::string& from, const std::string& to) {
    std::string text = good;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  EXPECT_THAT(message_of(write(changed("  cy_px:", "  cypx:"))), testing::HasSubstr("cy_px"));
  EXPECT_THAT(message_of(write(changed("model: radial", "model: brown"))), testing::HasSubstr("k1"));
  EXPECT_THAT(message_of(write(changed("  cx_px: 3007.5", "  cx_px: 7000"))), testing::HasSubstr("outside"));
  EXPECT_THAT(message_of(write(changed("  a1: 0.33", "  a1: -9.33"))), testing::HasSubstr("no inverse"));
  EXPECT_THAT(message_of(write(changed("0.01,", "0.02,"))), testing::HasSubstr("symmetric"));
}

TEST_F(CameraFileTest, SheetFileReadsBack) {
  std::vector<Sheet> sheets(2);
  sheets[0] = {SheetKind::aprilgrid, "tag36h11", 8, 6, 40, 15.5, 0, 0, 200, {}, false};
  sheets[1] = {SheetKind::charuco, "DICT_5X5_250", 12, 9, 22, 0, 30, 0, 0, {}, false};
  const auto again = read_sheet_file(write(format_sheet_file("# head\n", sheets)));
  ASSERT_EQ(again.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(describe_sheet(again[i]), describe_sheet(sheets[i]));
}

TEST_F(CameraFileTest, SheetFileRefusesMissingSizesAndSharedIds) {
  EXPECT_THROW((void)read_sheet_file(write("kind: chessboard\ncolumns: 10\nrows: 7\n")), InputError);
  EXPECT_THROW(
      (void)read_sheet_file(write("kind: chessboard\ncolumns: 10\nrows: 7\nsquare_mm: 30\nfirst_id: 3\n")),
      InputError);
  const std::string grid =
      "  - {kind: aprilgrid, family: tag36h11, columns: 2, rows: 2, tag_size_mm: 40, tag_spacing_mm: 10, "
      "first_id: 3}\n";
  EXPECT_NO_THROW((void)read_sheet_file(write("sheets:\n" + grid)));
  EXPECT_THROW((void)read_sheet_file(write("sheets:\n" + grid + grid)), InputError);
}

TEST_F(CameraFileTest, MarkerListTakesRanges) {
  const auto sheets = read_sheet_file(write(
      "kind: markers\nfamily: tag36h11\nids: [0-3, 100-101]\ncolumns: 4\nsize_mm: 24\nspacing_mm: 8\n"));
  EXPECT_EQ(sheets[0].ids, (std::vector<int>{0, 1, 2, 3, 100, 101}));
  EXPECT_EQ(sheets[0].rows, 2);
}

}  // namespace
}  // namespace hexcal
