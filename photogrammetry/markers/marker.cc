#include "photogrammetry/markers/marker.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagCircle49h12.h>
#include <apriltag/tagCustom48h12.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <map>
#include <mutex>
#include <opencv2/core/version.hpp>
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
#include <opencv2/objdetect/aruco_dictionary.hpp>
#else
#include <opencv2/aruco.hpp>
#endif

#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

struct AprilTagFamily {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

constexpr AprilTagFamily kAprilTagFamilies[] = {
    {"tag36h11", tag36h11_create, tag36h11_destroy},
    {"tag25h9", tag25h9_create, tag25h9_destroy},
    {"tag16h5", tag16h5_create, tag16h5_destroy},
    {"tagCircle21h7", tagCircle21h7_create, tagCircle21h7_destroy},
    {"tagCircle49h12", tagCircle49h12_create, tagCircle49h12_destroy},
    {"tagStandard41h12", tagStandard41h12_create, tagStandard41h12_destroy},
    {"tagStandard52h13", tagStandard52h13_create, tagStandard52h13_destroy},
    {"tagCustom48h12", tagCustom48h12_create, tagCustom48h12_destroy},
};

constexpr const char* kDoubleBorder = "tag36h11_border2";

struct ArucoDictionary {
  const char* name;
  decltype(cv::aruco::DICT_4X4_50) id;  // the enumeration's name differs between versions
};

#define HEXCAL_DICTIONARY(name) \
  { #name, cv::aruco::name }
constexpr ArucoDictionary kArucoDictionaries[] = {
    HEXCAL_DICTIONARY(DICT_4X4_50),         HEXCAL_DICTIONARY(DICT_4X4_100),
    HEXCAL_DICTIONARY(DICT_4X4_250),        HEXCAL_DICTIONARY(DICT_4X4_1000),
    HEXCAL_DICTIONARY(DICT_5X5_50),         HEXCAL_DICTIONARY(DICT_5X5_100),
    HEXCAL_DICTIONARY(DICT_5X5_250),        HEXCAL_DICTIONARY(DICT_5X5_1000),
    HEXCAL_DICTIONARY(DICT_6X6_50),         HEXCAL_DICTIONARY(DICT_6X6_100),
    HEXCAL_DICTIONARY(DICT_6X6_250),        HEXCAL_DICTIONARY(DICT_6X6_1000),
    HEXCAL_DICTIONARY(DICT_7X7_50),         HEXCAL_DICTIONARY(DICT_7X7_100),
    HEXCAL_DICTIONARY(DICT_7X7_250),        HEXCAL_DICTIONARY(DICT_7X7_1000),
    HEXCAL_DICTIONARY(DICT_ARUCO_ORIGINAL), HEXCAL_DICTIONARY(DICT_APRILTAG_16h5),
    HEXCAL_DICTIONARY(DICT_APRILTAG_25h9),  HEXCAL_DICTIONARY(DICT_APRILTAG_36h10),
    HEXCAL_DICTIONARY(DICT_APRILTAG_36h11)};
#undef HEXCAL_DICTIONARY

// The library's own drawing (white outside, border, bits) read off as cells.
MarkerPattern april_tag_pattern(apriltag_family_t* family, std::uint32_t id) {
  MarkerPattern pattern;
  image_u8_t* image = apriltag_to_image(family, id);
  pattern.cells = image->width;
  pattern.square_cells = family->width_at_border;
  for (int y = 0; y < image->height; ++y) {
    for (int x = 0; x < image->width; ++x) {
      pattern.white.push_back(image->buf[y * image->stride + x] > 127 ? 1 : 0);
    }
  }
  // The library's own image_u8_destroy is not among the symbols it exports; this is what it does.
  std::free(image->buf);
  std::free(image);
  return pattern;
}

MarkerFamily april_tag_family(const AprilTagFamily& source) {
  MarkerFamily family{source.name, {}};
  apriltag_family_t* tags = source.create();
  family.distance = static_cast<int>(tags->h);
  for (std::uint32_t id = 0; id < tags->ncodes; ++id) family.patterns.push_back(april_tag_pattern(tags, id));
  source.destroy(tags);
  return family;
}

// Kalibr's AprilGrid: the same data within one more ring of black.
MarkerFamily double_border_family() {
  const MarkerFamily& source = marker_family("tag36h11");
  MarkerFamily family{kDoubleBorder, {}};
  family.distance = source.distance;
  for (const MarkerPattern& thin : source.patterns) {
    const int cells = thin.cells + 2;
    MarkerPattern pattern{cells, thin.square_cells + 2, {}};
    for (int y = 0; y < cells; ++y) {
      for (int x = 0; x < cells; ++x) {
        const int ring = std::min({x, y, cells - 1 - x, cells - 1 - y});
        const bool data = ring > 2;
        const auto at = static_cast<std::size_t>((y - 1) * thin.cells + x - 1);
        pattern.white.push_back(ring == 0 || (data && thin.white[at] != 0) ? 1 : 0);
      }
    }
    family.patterns.push_back(std::move(pattern));
  }
  return family;
}

cv::aruco::Dictionary library_dictionary(const ArucoDictionary& source) {
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
  return cv::aruco::getPredefinedDictionary(source.id);
#else
  return *cv::aruco::getPredefinedDictionary(source.id);
#endif
}

MarkerFamily aruco_family(const ArucoDictionary& source) {
  MarkerFamily family{source.name, {}};
  const cv::aruco::Dictionary dictionary = library_dictionary(source);
  const int cells = dictionary.markerSize + 2;  // with the black border
  for (int id = 0; id < dictionary.bytesList.rows; ++id) {
    const cv::Mat bits = cv::aruco::Dictionary::getBitsFromByteList(dictionary.bytesList.row(id), cells - 2);
    MarkerPattern pattern{cells, static_cast<double>(cells), {}};
    for (int y = 0; y < cells; ++y) {
      for (int x = 0; x < cells; ++x) {
        const bool border = x == 0 || y == 0 || x == cells - 1 || y == cells - 1;
        pattern.white.push_back(!border && bits.at<std::uint8_t>(y - 1, x - 1) != 0 ? 1 : 0);
      }
    }
    family.patterns.push_back(std::move(pattern));
  }
  return family;
}

}  // namespace

const std::vector<std::string>& marker_family_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& family : kAprilTagFamilies) all.emplace_back(family.name);
    all.emplace_back(kDoubleBorder);
    for (const auto& dictionary : kArucoDictionaries) all.emplace_back(dictionary.name);
    return all;
  }();
  return names;
}

const MarkerFamily& marker_family(std::string_view name) {
  static std::recursive_mutex mutex;  // one family is made from another
  static std::map<std::string, MarkerFamily, std::less<>> families;
  const std::lock_guard<std::recursive_mutex> lock(mutex);
  const auto known = families.find(name);
  if (known != families.end()) return known->second;
  const auto add = [&](MarkerFamily family) -> const MarkerFamily& {
    return families.emplace(std::string(name), std::move(family)).first->second;
  };
  if (name == kDoubleBorder) return add(double_border_family());
  for (const auto& family : kAprilTagFamilies) {
    if (name == family.name) return add(april_tag_family(family));
  }
  for (const auto& dictionary : kArucoDictionaries) {
    if (name == dictionary.name) return add(aruco_family(dictionary));
  }
  throw InputError(fmt::format("marker family '{}' is not known; wanted one of {}", name,
                               fmt::join(marker_family_names(), ", ")));
}

const char* marker_status_name(MarkerStatus status) {
  switch (status) {
    case MarkerStatus::ok:
      return "ok";
    case MarkerStatus::cut_by_frame:
      return "cut_by_frame";
    case MarkerStatus::mirrored:
      return "mirrored";
    case MarkerStatus::saturated:
      return "saturated";
    case MarkerStatus::too_small:
      return "too_small";
    case MarkerStatus::too_steep:
      return "too_steep";
    case MarkerStatus::low_contrast:
      return "low_contrast";
    case MarkerStatus::occluded:
      return "occluded";
    case MarkerStatus::misfit:
      return "misfit";
    case MarkerStatus::inverted:
      return "inverted";
    case MarkerStatus::duplicate:
      return "duplicate";
    case MarkerStatus::not_refined:
      return "not_refined";
  }
  return "";
}

const char* marker_method_name(MarkerMethod method) {
  switch (method) {
    case MarkerMethod::photometric:
      return "photometric";
    case MarkerMethod::edges:
      return "edges";
    case MarkerMethod::quad:
      return "quad";
  }
  return "";
}

}  // namespace hexcal
