#include "camera_calib/calibrated_camera.h"

namespace hexcal {

const char* camera_verdict_name(CameraVerdict verdict) {
  switch (verdict) {
    case CameraVerdict::unknown:
      return "unknown";
    case CameraVerdict::good:
      return "good";
    case CameraVerdict::usable:
      return "usable";
    case CameraVerdict::retake:
      return "retake";
  }
  return "";
}

}  // namespace hexcal
