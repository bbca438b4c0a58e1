#include "camera_calib/lens_setting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hexcal {
namespace {

PhotographInfo d3200() {
  PhotographInfo info;
  info.width_px = 6016;
  info.height_px = 4000;
  info.make = "NIKON CORPORATION";
  info.model = "NIKON D3200";
  info.lens_id = 158;
  info.focal_length_mm = 35;
  info.f_number = 8;
  info.focus_distance_code = 74;
  info.vibration_reduction = false;
  return info;
}

TEST(LensSetting, SameSettingHasNoDifference) {
  EXPECT_TRUE(compare_setting(lens_setting(d3200()), d3200()).empty());
}

TEST(LensSetting, AnotherZoomIsFatalAndNamesBothValues) {
  PhotographInfo other = d3200();
  other.focal_length_mm = 50;
  const auto differences = compare_setting(lens_setting(d3200()), other);
  ASSERT_EQ(differences.size(), 1u);
  EXPECT_TRUE(differences[0].fatal);
  EXPECT_EQ(differences[0].words, "focal length: camera 35 mm, photograph 50 mm");
}

TEST(LensSetting, ApertureAndFocusWarnVibrationReductionIsFatal) {
  PhotographInfo other = d3200();
  other.f_number = 11;
  other.focus_distance_code = 80;
  other.vibration_reduction = true;
  const auto differences = compare_setting(lens_setting(d3200()), other);
  ASSERT_EQ(differences.size(), 3u);
  EXPECT_TRUE(differences[0].fatal);
  EXPECT_THAT(differences[0].words, testing::HasSubstr("vibration reduction"));
  EXPECT_FALSE(differences[1].fatal);
  EXPECT_FALSE(differences[2].fatal);
}

TEST(LensSetting, WhatThePhotographDoesNotSayIsNotCompared) {
  PhotographInfo bare;
  bare.width_px = 6016;
  bare.height_px = 4000;
  EXPECT_TRUE(compare_setting(lens_setting(d3200()), bare).empty());
  bare.width_px = 3008;
  EXPECT_EQ(compare_setting(lens_setting(d3200()), bare).size(), 1u);
}

TEST(LensSetting, FileStemTellsTheSetting) {
  EXPECT_EQ(setting_file_stem(lens_setting(d3200())), "NIKON-D3200_lens158_35mm_f8_focus74_6016x4000");
}

}  // namespace
}  // namespace hexcal
