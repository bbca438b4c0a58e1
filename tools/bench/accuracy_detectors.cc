#include "tools/bench/accuracy_detectors.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include <opencv2/core/version.hpp>
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
#include <opencv2/objdetect/aruco_detector.hpp>
#else
#include <opencv2/aruco.hpp>
#endif

namespace hexcal {
namespace {

MarkerObservation observation(int id, const std::array<Eigen::Vector2d, 4>& corners) {
  MarkerObservation marker;
  marker.id = id;
  marker.status = MarkerStatus::ok;
  marker.corners_px = corners;
  return marker;
}

std::vector<MarkerObservation> april_tags(const cv::Mat& grey, float decimate) {
  apriltag_family_t* family = tag36h11_create();
  apriltag_detector_t* detector = apriltag_detector_create();
  apriltag_detector_add_family(detector, family);
  detector->quad_decimate = decimate;
  detector->refine_edges = true;
  image_u8_t image{grey.cols, grey.rows, static_cast<std::int32_t>(grey.step), grey.data};
  zarray_t* found = apriltag_detector_detect(detector, &image);
  std::vector<MarkerObservation> markers;
  for (int i = 0; i < zarray_size(found); ++i) {
    apriltag_detection_t* tag = nullptr;
    zarray_get(found, i, &tag);
    // The library's corners run counter-clockwise from the bottom left, and its first pixel's centre is (0.5,
    // 0.5).
    std::array<Eigen::Vector2d, 4> corners;
    for (std::size_t k = 0; k < 4; ++k)
      corners[3 - k] = Eigen::Vector2d(tag->p[k][0] - 0.5, tag->p[k][1] - 0.5);
    markers.push_back(observation(tag->id, corners));
  }
  apriltag_detections_destroy(found);
  apriltag_detector_destroy(detector);
  tag36h11_destroy(family);
  return markers;
}

std::vector<MarkerObservation> aruco_markers(const cv::Mat& grey, cv::aruco::CornerRefineMethod method,
                                             double shift) {
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
  cv::aruco::DetectorParameters parameters;
#else
  const auto created = cv::aruco::DetectorParameters::create();
  cv::aruco::DetectorParameters& parameters = *created;
#endif
  parameters.cornerRefinementMethod = method;
  // Its defaults are for photographs of a megapixel: wider thresholding windows, and the patterns as they
  // are.
  parameters.adaptiveThreshWinSizeMax = 103;
  parameters.adaptiveThreshWinSizeStep = 40;
  parameters.minMarkerPerimeterRate = 0.01;
  std::vector<std::vector<cv::Point2f>> found;
  std::vector<int> ids;
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
  cv::aruco::ArucoDetector(dictionary, parameters).detectMarkers(grey, found, ids);
#else
  cv::aruco::detectMarkers(grey, dictionary, found, ids, created);
#endif
  std::vector<MarkerObservation> markers;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    // Its AprilTag patterns are those of the library turned by half a turn.
    std::array<Eigen::Vector2d, 4> corners;
    for (std::size_t k = 0; k < 4; ++k)
      corners[(k + 2) % 4] = Eigen::Vector2d(found[i][k].x - shift, found[i][k].y - shift);
    markers.push_back(observation(ids[i], corners));
  }
  return markers;
}

}  // namespace

const std::vector<Detector>& detectors() {
  using Family = MarkerFamily;
  static const std::vector<Detector> all{
      {"hexcal", true, false,
       [](const cv::Mat& g, const Family& family, const CameraModel*) {
         return detect_markers(g, ToneCurve::srgb, family);
       }},
      {"hexcal, lens", true, true,
       [](const cv::Mat& g, const Family& family, const CameraModel* camera) {
         return detect_markers(g, ToneCurve::srgb, family, {}, camera);
       }},
      {"apriltag 1", false, false,
       [](const cv::Mat& g, const Family&, const CameraModel*) { return april_tags(g, 1); }},
      {"apriltag 2", false, false,
       [](const cv::Mat& g, const Family&, const CameraModel*) { return april_tags(g, 2); }},
      {"aruco none", false, false,
       [](const cv::Mat& g, const Family&, const CameraModel*) {
         return aruco_markers(g, cv::aruco::CORNER_REFINE_NONE, 0);
       }},
      {"aruco subpix", false, false,
       [](const cv::Mat& g, const Family&, const CameraModel*) {
         return aruco_markers(g, cv::aruco::CORNER_REFINE_SUBPIX, 0);
       }},
      {"aruco contour", false, false,
       [](const cv::Mat& g, const Family&, const CameraModel*) {
         return aruco_markers(g, cv::aruco::CORNER_REFINE_CONTOUR, 0);
       }},
      // Its corners lie half a pixel towards the bottom right in OpenCV 4.6.
      {"aruco apriltag", false, false, [](const cv::Mat& g, const Family&, const CameraModel*) {
         return aruco_markers(g, cv::aruco::CORNER_REFINE_APRILTAG, 0.5);
       }}};
  return all;
}

}  // namespace hexcal
