#include "tools/io/camera_export.h"

#include <gmock/gmock.h>

#include <opencv2/core/persistence.hpp>
#include <sstream>

#include "camera_calib/projection_difference.h"
#include "kinematics/geometry/input_error.h"
#include "tests/support/temporary_folder.h"
#include "tools/io/atomic_file.h"

namespace hexcal {
namespace {

CalibratedCamera brown() {
  CalibratedCamera camera;
  camera.model = CameraModel(6016, 4000, 9000, LensModel::brown);
  camera.model.parameters.tail<5>() << -0.1, 0.05, 1e-4, 2e-4, 0.01;
  camera.model.parameters[1] = 2e-4;
  return camera;
}

CalibratedCamera radial() {
  CalibratedCamera camera;
  camera.model = CameraModel(6016, 4000, 9011, LensModel::radial);
  camera.model.parameters.segment<3>(4) << 0.0159, -0.0714, 0.6459;
  return camera;
}

TEST(CameraExport, OpenCvReadsItsOwnFormat) {
  const CameraExport out = export_camera(brown(), "opencv");
  EXPECT_EQ(out.rms_px, 0);
  cv::FileStorage storage(out.text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
  cv::Mat matrix;
  cv::Mat terms;
  storage["camera_matrix"] >> matrix;
  storage["distortion_coefficients"] >> terms;
  EXPECT_DOUBLE_EQ(matrix.at<double>(0, 0), brown().model.fx_px());
  EXPECT_DOUBLE_EQ(matrix.at<double>(1, 2), brown().model.cy_px());
  EXPECT_DOUBLE_EQ(terms.at<double>(4), 0.01);
}

TEST(CameraExport, WhatIsWrittenIsReadBack) {
  const TemporaryFolder folder;
  for (const char* format : {"opencv", "ros"}) {
    write_file_atomically(folder.path() / "camera.yaml", export_camera(brown(), format).text);
    const ForeignCamera again = read_foreign_camera(folder.path() / "camera.yaml");
    EXPECT_EQ(again.format, format);
    EXPECT_LT(projection_difference(brown().model, again.camera.model).max_px, 1e-9);
  }
}

TEST(CameraExport, ARicherLensIsFittedAndTheErrorTold) {
  const CameraExport opencv = export_camera(radial(), "opencv");
  EXPECT_GT(opencv.rms_px, 0);
  EXPECT_LT(opencv.rms_px, 0.015);
  const CameraExport kalibr = export_camera(radial(), "kalibr");
  EXPECT_GT(kalibr.rms_px, 2 * opencv.rms_px);
  EXPECT_LT(kalibr.rms_px, 0.5);
}

TEST(CameraExport, ColmapCountsFromThePixelsCorner) {
  std::istringstream line(export_camera(brown(), "colmap").text);
  std::string comment;
  std::getline(line, comment);
  std::string id;
  std::string model;
  double width = 0;
  double height = 0;
  double fx = 0;
  double fy = 0;
  double cx = 0;
  line >> id >> model >> width >> height >> fx >> fy >> cx;
  EXPECT_EQ(model, "FULL_OPENCV");
  EXPECT_DOUBLE_EQ(cx, brown().model.cx_px() + 0.5);
}

TEST(CameraExport, MrcalTakesTheCameraOfItsOwnKindUnchanged) {
  const CameraExport out = export_camera(brown(), "mrcal");
  EXPECT_EQ(out.model, "LENSMODEL_OPENCV5");
  EXPECT_EQ(out.rms_px, 0);
  EXPECT_THAT(
      out.text,
      ::testing::HasSubstr("{\n    'lensmodel':  'LENSMODEL_OPENCV5',\n    'extrinsics': [ 0, 0, 0, 0, 0, 0 "
                           "],\n    'intrinsics': [9001.8, 9000, 3007.5, 1999.5, -0.1, 0.05, 0.0001, 0.0002, "
                           "0.01],\n    'imagersize': [ 6016, 4000 ]\n}\n"));
}

TEST(CameraExport, PhotoModelerValuesBecomeACamera) {
  const TemporaryFolder folder;
  write_file_atomically(
      folder.path() / "pm.yaml",
      "photomodeler: {focal_mm: 7.4653, principal_point_mm: [3.6173, 2.6128], format_mm: [7.25319, "
      "5.43764], k: [0.00498, -0.0001, 0], p: [-0.00006, -0.00004]}\nimage_size_px: [2272, 1704]\n");
  const ForeignCamera camera = read_foreign_camera(folder.path() / "pm.yaml");
  EXPECT_NEAR(camera.camera.model.fx_px(), 7.4653 * 2272 / 7.25319, 2);
  EXPECT_NEAR(camera.camera.model.cx_px(), 3.6173 * 2272 / 7.25319 - 0.5, 1);
  EXPECT_LT(camera.fit_rms_px, 0.1);
}

TEST(CameraExport, UnknownFormatIsRefused) {
  EXPECT_THROW((void)export_camera(brown(), "agisoft"), InputError);
}

}  // namespace
}  // namespace hexcal
