#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "camera_calib/sheet.h"
#include "tools/synthetic/camera_effects.h"
#include "tools/synthetic/grips.h"
#include "tools/synthetic/jpeg_file.h"
#include "tools/synthetic/lens_profile.h"
#include "tools/synthetic/machine.h"
#include "tools/synthetic/sheet_scene.h"

namespace hexcal {

/// Everything that determines a simulated campaign: the same options give the same bytes.
struct SimulationOptions {
  std::uint64_t seed = 1;
  int poses = 12;               ///< beside home
  int photos_per_pose = 3;      ///< 0: none
  int calibration_photos = 14;  ///< of the sheet
  int width_px = kSensorWidthPx;
  bool brown_lens = false;  ///< otherwise the public profile of the 18-105
  double focal_mm = 35;
  double distance_mm = 700;  ///< from the camera to the grips at 35 mm; grows with the focal length
  double range_mm = 30;      ///< of the poses, each way
  double range_deg = 12;
  MarkerLayout markers;
  double known_sigma_mm = 0.002;  ///< of the fixed markers' coordinates given in markers_nominal.csv
  MachineErrors machine;
  Sheet sheet;  ///< default: AprilGrid 8 x 6, tags 40 mm, gap 15 mm, ids from 200
  SheetPrint print;
  double blur_min_px = 0.6;  ///< each photograph draws its blur between these
  double blur_max_px = 1.0;
  SensorOptions sensor;
  CameraEffects effects;  ///< what is real about print, platform, lens, sensor and processing
  JpegOptions jpeg;

  SimulationOptions();
  /// Throws InputError naming field and value.
  void validate() const;
};

/// The virtual laboratory: what stays the same from one round of photographs to the next.
struct VirtualLaboratory {
  SimulationOptions options;
  VirtualMachine machine;
  Rig rig;
  CameraModel camera;
};

[[nodiscard]] VirtualLaboratory make_laboratory(const SimulationOptions& options);

/// A marker that is not where it was glued, in one photograph.
struct MovedSticker {
  int id = 0;
  Rigid3 marker_motion;  ///< in the marker's own frame
};

/// One photograph to be taken. Faults are injected by editing shots before they are taken
/// (RoundOptions::edit_shots): another `pose` is a swapped folder, a large `blur_px` a shaken photograph,
/// a shot taken out a missing view.
struct Shot {
  std::string pose;          ///< id and so the folder; empty for a photograph of the sheet
  std::string file;          ///< DSC_0001.jpg
  Rigid3 UG_from_LG;         ///< where the moving grip stands, trembling (PlatformEffects) included
  Rigid3 camera_from_world;  ///< world: UG, or the sheet's frame
  double blur_px = 0.8;
  double exposure = 1;
  PhotographTags tags;
  std::uint64_t seed = 0;
  std::vector<MovedSticker> moved_stickers;
  std::vector<Surface> obstacles;  ///< in front of the rig, in UG
};

/// A pose to be photographed.
struct RoundPose {
  std::string id;
  Pose pose;  ///< true
};

/// Shots of all poses, numbered on from `first_number`. `round` tells repeated visits to a pose apart.
[[nodiscard]] std::vector<Shot> pose_shots(const VirtualLaboratory& laboratory,
                                           const std::vector<RoundPose>& poses, std::uint64_t round,
                                           int first_number);
[[nodiscard]] std::vector<Shot> calibration_shots(const VirtualLaboratory& laboratory, int first_number);

/// Scene of a shot.
[[nodiscard]] Scene shot_scene(const VirtualLaboratory& laboratory, const Shot& shot);

/// The finished photograph, CV_8UC3.
[[nodiscard]] cv::Mat photograph(const VirtualLaboratory& laboratory, const RayLattice& lens,
                                 const Shot& shot);

}  // namespace hexcal
