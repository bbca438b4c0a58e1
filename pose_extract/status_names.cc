#include "pose_extract/extract_poses.h"

namespace hexcal {

const char* photo_status_name(PhotoStatus status) {
  switch (status) {
    case PhotoStatus::ok:
      return "ok";
    case PhotoStatus::suspect:
      return "suspect";
    case PhotoStatus::unreadable:
      return "unreadable";
    case PhotoStatus::wrong_camera:
      return "wrong_camera";
    case PhotoStatus::duplicate:
      return "duplicate";
    case PhotoStatus::no_markers:
      return "no_markers";
    case PhotoStatus::disconnected:
      return "disconnected";
    case PhotoStatus::disagrees:
      return "disagrees";
  }
  return "unknown";
}

const char* pose_status_name(PoseStatus status) {
  switch (status) {
    case PoseStatus::ok:
      return "ok";
    case PoseStatus::suspect:
      return "suspect";
    case PoseStatus::no_photographs:
      return "no_photographs";
    case PoseStatus::no_usable_photographs:
      return "no_usable_photographs";
    case PoseStatus::same_photographs:
      return "same_photographs";
    case PoseStatus::no_moving_markers:
      return "no_moving_markers";
    case PoseStatus::disconnected:
      return "disconnected";
    case PoseStatus::ambiguous:
      return "ambiguous";
    case PoseStatus::weak_geometry:
      return "weak_geometry";
    case PoseStatus::contradictory:
      return "contradictory";
    case PoseStatus::no_datum:
      return "no_datum";
  }
  return "unknown";
}

}  // namespace hexcal
