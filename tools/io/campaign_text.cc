#include "tools/io/campaign_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "kinematics/geometry/pose.h"

namespace hexcal {
namespace {

// `key: value` with the comment in a column of its own.
std::string line(const std::string& entry, const std::string& comment) {
  return comment.empty() ? entry + '\n' : fmt::format("{:<50} # {}\n", entry, comment);
}

std::string quoted_yaml(const std::string& text) {
  const bool plain = !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.' || c == '/';
  });
  const bool word = plain && std::isalpha(static_cast<unsigned char>(text.front())) != 0;
  if (word || text == ".") return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("''") : std::string(1, c);
  return quoted + "'";
}

// {ids: [0-9], size_mm: 24} where all are alike, else {ids: {0-9: 24, 12: 10}}.
std::string body(const MarkerSizes& sizes) {
  std::map<double, std::vector<int>> by_size;
  for (const auto& [id, size] : sizes) by_size[size].push_back(id);
  if (by_size.size() == 1)
    return fmt::format("{{ids: [{}], size_mm: {}}}", id_ranges_text(by_size.begin()->second),
                       by_size.begin()->first);
  std::string ids;
  for (const auto& [id, size] : sizes) ids += fmt::format("{}{}: {}", ids.empty() ? "" : ", ", id, size);
  return fmt::format("{{ids: {{{}}}}}", ids);
}

}  // namespace

std::string id_ranges_text(const std::vector<int>& ids) {
  std::string text;
  for (std::size_t i = 0; i < ids.size();) {
    std::size_t last = i;
    while (last + 1 < ids.size() && ids[last + 1] == ids[last] + 1) ++last;
    text += fmt::format("{}{}", text.empty() ? "" : ", ", ids[i]);
    if (last > i) text += fmt::format("-{}", ids[last]);
    i = last + 1;
  }
  return text;
}

std::string markers_frame_text(const std::optional<Rigid3>& markers_from_UG) {
  if (!markers_from_UG) return "UG: {from: markers}";
  const auto triple = [](const Eigen::Vector3d& v, int decimals) {
    const Eigen::Vector3d clean = v.unaryExpr([](double x) { return std::abs(x) < 5e-5 ? 0.0 : x; });
    return fmt::format("[{:.{}f}, {:.{}f}, {:.{}f}]", clean.x(), decimals, clean.y(), decimals, clean.z(),
                       decimals);
  };
  return fmt::format("UG: {{from: markers, xyz_mm: {}, rpy_deg: {}}}",
                     triple(markers_from_UG->translation, 2),
                     triple(rpy_from_quaternion(markers_from_UG->rotation) * kDegPerRad, 3));
}

std::string campaign_text(const std::string& head, const CampaignDraft& draft) {
  std::string text = head;
  text += "# Lengths in mm, angles in deg. Every key: tools/io/FORMATS.md, or man hexcal-formats.\n";
  text += line("camera: " + quoted_yaml(draft.camera), "from hexcal camera; one per zoom setting");
  text += draft.hexapod
              ? line("hexapod: hexapod.yaml", "the machine's drawing")
              : line("# hexapod: hexapod.yaml", "the machine's drawing; wanted to correct commands");
  text += draft.targets
              ? line("targets: targets.csv", "the commanded poses")
              : line("# targets: targets.csv", "the commanded poses: fill the file in, take the # away");
  text += line(
      "images: " + quoted_yaml(draft.images),
      draft.images_table ? "folder of the photographs" : "one sub-folder per pose; its name is the pose's");
  if (draft.images_table) text += line("images_table: images.csv", "which photograph shows which pose");
  text += "markers:\n";
  text += line("  family: " + draft.family, "");
  text +=
      "  # fixed: on the upper grip, which stands still; moving: on the lower. Size: edge of the black "
      "square.\n";
  if (!draft.division.empty()) text += fmt::format("  # {}\n", draft.division);
  text += line("  fixed: " + body(draft.fixed), "");
  if (!draft.moving.empty()) {
    text += line("  moving: " + body(draft.moving), "");
    text += "frames:\n";
    if (draft.nominal) {
      text += line("  UG: {from: nominal, file: markers_nominal.csv}", "best fit to known coordinates");
    } else {
      text +=
          "  # UG needs no coordinates: z from the moving to the fixed markers at home, y away from who "
          "stands\n"
          "  # before them, origin amid the fixed ones";
      text += draft.markers_from_UG ? "; moved and turned to agree best with targets.csv\n" : "\n";
      text += "  " + markers_frame_text(draft.markers_from_UG) + "\n";
    }
    text +=
        line(fmt::format("  LG: {{from: home, pose: {}, gd_mm: {}}}", quoted_yaml(draft.home), draft.gd_mm),
             "zero at home, where LG stands gd below UG");
  }
  text += line("scale: {from: markers}", "from the stated sizes; or bars: known distances");
  text +=
      "# checks: [{a: 0, b: 5, length_mm: 182.4, sigma_mm: 0.05}]   # measured with a calliper, centre to "
      "centre\n";
  return text;
}

}  // namespace hexcal
