#include "tools/io/point_cloud_file.h"

#include <fmt/format.h>

namespace hexcal {
namespace {

struct CloudPoint {
  Eigen::Vector3d xyz_mm;
  int red, green, blue;
  int id;
};

std::vector<CloudPoint> corners_at_home(const CampaignResult& result) {
  const Rigid3 UG_from_LG = ug_from_lg(Pose(), result.gd_mm);
  std::vector<CloudPoint> cloud;
  for (const MeasuredPoint& point : result.points) {
    if (point.body == kReferenceBody) {
      cloud.push_back({point.xyz_mm, 60, 100, 200, point.point.id});
    } else {
      cloud.push_back({UG_from_LG * point.xyz_mm, 210, 110, 40, point.point.id});
    }
  }
  return cloud;
}

// "# text\n" as a comment of another format.
std::string comment(const std::string& head, const char* keyword) {
  std::string out;
  for (std::size_t begin = 0; begin < head.size();) {
    const std::size_t end = std::min(head.find('\n', begin), head.size());
    std::string line = head.substr(begin, end - begin);
    if (line.rfind("# ", 0) == 0) line = line.substr(2);
    if (!line.empty()) out += fmt::format("{} {}\n", keyword, line);
    begin = end + 1;
  }
  return out;
}

}  // namespace

std::string format_markers_ply(const std::string& head, const CampaignResult& result) {
  const std::vector<CloudPoint> corners = corners_at_home(result);
  std::vector<CloudPoint> all = corners;
  for (const MeasuredPhotograph& photograph : result.photographs) {
    if (photograph.UG_from_camera) all.push_back({photograph.UG_from_camera->translation, 90, 170, 90, -1});
  }
  std::string out = "ply\nformat ascii 1.0\n" + comment(head, "comment");
  out += fmt::format(
      "element vertex {}\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nproperty int id\nelement face {}\n"
      "property list uchar int vertex_indices\nend_header\n",
      all.size(), corners.size() / 4);
  for (const CloudPoint& point : all) {
    out += fmt::format("{:.6f} {:.6f} {:.6f} {} {} {} {}\n", point.xyz_mm.x(), point.xyz_mm.y(),
                       point.xyz_mm.z(), point.red, point.green, point.blue, point.id);
  }
  // Corners run clockwise as seen; faces turn the other way so that their normals point to the viewer.
  for (std::size_t i = 0; i + 3 < corners.size(); i += 4)
    out += fmt::format("4 {} {} {} {}\n", i + 3, i + 2, i + 1, i);
  return out;
}

std::string format_markers_pcd(const std::string& head, const CampaignResult& result) {
  const std::vector<CloudPoint> corners = corners_at_home(result);
  std::string out = comment(head, "#");
  out += fmt::format(
      "VERSION 0.7\nFIELDS x y z label\nSIZE 8 8 8 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH {0}\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA ascii\n",
      corners.size());
  for (const CloudPoint& point : corners) {
    out += fmt::format("{:.6f} {:.6f} {:.6f} {}\n", point.xyz_mm.x(), point.xyz_mm.y(), point.xyz_mm.z(),
                       point.id);
  }
  return out;
}

}  // namespace hexcal
