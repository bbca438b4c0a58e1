#include "tools/io/campaign_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/pose.h"
#include "tools/io/csv_table.h"
#include "tools/io/scalar_text.h"
#include "tools/io/yaml_map.h"

namespace hexcal {
namespace {

// `9` or `9.2`.
MarkerPoint parse_point(const YamlMap& map, const std::string& key, const std::string& text) {
  const auto dot = text.find('.');
  const auto id = id_from_text(std::string_view(text).substr(0, dot));
  MarkerPoint point{id.value_or(-1), -1};
  bool good = id.has_value();
  if (good && dot != std::string::npos) {
    const auto corner = id_from_text(std::string_view(text).substr(dot + 1));
    good = corner && *corner <= 3;
    point.corner = corner.value_or(-1);
  }
  if (!good)
    map.fail(key, fmt::format("found '{}', wanted a marker id or id.corner with corner 0 to 3", text));
  return point;
}

double positive(const YamlMap& map, const std::string& key) {
  const double value = map.number(key);
  if (!(value > 0)) map.fail(key, fmt::format("found {}, wanted more than 0", value));
  return value;
}

double not_negative(const YamlMap& map, const std::string& key, double fallback) {
  const double value = map.number_or(key, fallback);
  if (value < 0) map.fail(key, fmt::format("found {}, wanted 0 or more", value));
  return value;
}

void add_range(const YamlMap& map, const std::string& key, const std::string& text, double size_mm,
               MarkerSizes& sizes) {
  const auto range = id_range_from_text(text);
  if (!range) map.fail(key, fmt::format("found '{}', wanted an id or a range such as 0-9", text));
  for (int id = range->first; id <= range->last; ++id) {
    if (!sizes.emplace(id, size_mm).second) map.fail(key, fmt::format("marker {} stands twice", id));
  }
}

MarkerSizes read_sizes(const YamlMap& body) {
  MarkerSizes sizes;
  if (body.is_map("ids")) {
    const YamlMap ids = body.map("ids");
    for (const std::string& key : ids.keys()) add_range(ids, key, key, positive(ids, key), sizes);
  } else {
    const double size_mm = positive(body, "size_mm");
    const std::vector<std::string> texts =
        body.is_sequence("ids") ? body.texts("ids") : std::vector<std::string>{body.text("ids")};
    for (const std::string& text : texts) add_range(body, "ids", text, size_mm, sizes);
  }
  body.finish();
  if (sizes.empty()) body.fail("ids", "is empty, wanted at least one marker");
  return sizes;
}

std::vector<KnownLength> read_lengths(const YamlMap& parent, const std::string& key) {
  std::vector<KnownLength> lengths;
  for (const YamlMap& entry : parent.maps(key)) {
    KnownLength length;
    length.a = parse_point(entry, "a", entry.text("a"));
    length.b = parse_point(entry, "b", entry.text("b"));
    length.length_mm = positive(entry, "length_mm");
    length.sigma_mm = not_negative(entry, "sigma_mm", 0.0);
    if (length.a == length.b) entry.fail("b", "is the same point as a");
    entry.finish();
    lengths.push_back(length);
  }
  return lengths;
}

Feature read_feature(const YamlMap& parent, const std::string& key) {
  const YamlMap map = parent.map(key);
  const std::vector<std::pair<std::string, Feature::Kind>> kinds{
      {"point", Feature::Kind::point},       {"line", Feature::Kind::line},
      {"plane", Feature::Kind::plane},       {"circle", Feature::Kind::circle},
      {"cylinder", Feature::Kind::cylinder}, {"sphere", Feature::Kind::sphere}};
  Feature feature;
  int found = 0;
  for (const auto& [name, kind] : kinds) {
    if (!map.has(name)) continue;
    ++found;
    feature.kind = kind;
    const std::vector<std::string> texts =
        map.is_sequence(name) ? map.texts(name) : std::vector<std::string>{map.text(name)};
    for (const std::string& text : texts) feature.points.push_back(parse_point(map, name, text));
    if (feature.points.empty()) map.fail(name, "is empty, wanted markers or corners");
  }
  if (found != 1) {
    parent.fail(
        key,
        fmt::format("found {} features, wanted one of point, line, plane, circle, cylinder, sphere", found));
  }
  if (const auto text = map.optional_text("towards")) feature.towards = parse_point(map, "towards", *text);
  map.finish();
  return feature;
}

FrameRule read_frame(const YamlMap& frames, const std::string& name, const std::filesystem::path& folder) {
  const YamlMap map = frames.map(name);
  FrameRule rule;
  const std::vector<std::string> allowed = name == "LG"
                                               ? std::vector<std::string>{"nominal", "home", "features"}
                                               : std::vector<std::string>{"nominal", "features", "markers"};
  const std::string from = map.choice("from", allowed);
  if (from == "nominal") {
    rule.from = FrameRule::From::nominal;
    rule.nominal_file = folder / map.text("file");
    rule.nominal = read_nominal_points(*rule.nominal_file);
  } else if (from == "home") {
    rule.from = FrameRule::From::home;
    rule.home_pose = map.text("pose");
  } else if (from == "markers") {
    rule.from = FrameRule::From::markers;
    if (map.has("xyz_mm")) rule.markers_from_frame.translation = map.vector3("xyz_mm");
    if (map.has("rpy_deg"))
      rule.markers_from_frame.rotation = quaternion_from_rpy(map.vector3("rpy_deg") * kRadPerDeg);
  } else {
    rule.from = FrameRule::From::features;
    rule.features = FeatureFrame{read_feature(map, "z"), read_feature(map, "x"), read_feature(map, "origin"),
                                 Eigen::Vector3d::Zero(), 0};
    if (map.has("tolerance_mm")) rule.features->tolerance_mm = positive(map, "tolerance_mm");
    if (map.has("offset_mm")) rule.features->offset_mm = map.vector3("offset_mm");
  }
  if (name == "LG") {
    rule.gd_mm = map.number("gd_mm");
    if (rule.gd_mm < 0) map.fail("gd_mm", fmt::format("found {}, wanted 0 or more", rule.gd_mm));
  }
  map.finish();
  return rule;
}

void read_scale(const YamlMap& top, Campaign& campaign) {
  const YamlMap map = top.map("scale");
  const bool bars_given = map.has("bars");
  if (bars_given) campaign.bars = read_lengths(map, "bars");
  const std::string from = map.has("from") || !bars_given ? map.choice("from", {"markers", "bars", "nominal"})
                                                          : std::string("bars");
  campaign.scale = from == "markers" ? ScaleFrom::markers
                   : from == "bars"  ? ScaleFrom::bars
                                     : ScaleFrom::nominal;
  if (campaign.scale == ScaleFrom::bars && campaign.bars.empty())
    map.fail("bars", "missing, wanted at least one");
  if (campaign.scale == ScaleFrom::markers) {
    campaign.print_scale_sigma = not_negative(map, "print_scale_sigma", kPaperScaleSigma);
  } else if (campaign.scale == ScaleFrom::bars) {
    campaign.print_scale_sigma = kPaperScaleSigma;  // should no bar be in a photograph
  }
  for (const KnownLength& bar : campaign.bars) {
    if (!(bar.sigma_mm > 0)) map.fail("bars", "sigma_mm is missing or 0, wanted how well each bar is known");
  }
  const bool nominal_given = (campaign.ug && campaign.ug->from == FrameRule::From::nominal) ||
                             (campaign.lg && campaign.lg->from == FrameRule::From::nominal);
  if (campaign.scale == ScaleFrom::nominal && !nominal_given) {
    map.fail("from", "found 'nominal', but no frame is from nominal coordinates");
  }
  map.finish();
}

// The camera files of a library (`hexcal camera --library`), of which each photograph takes the one that
// fits.
std::vector<CampaignCamera> cameras_in(const YamlMap& top, const std::filesystem::path& library) {
  std::vector<CampaignCamera> cameras;
  for (const auto& entry : std::filesystem::directory_iterator(library)) {
    if (entry.path().extension() == ".yaml") cameras.push_back({entry.path(), "", ""});
  }
  if (cameras.empty()) top.fail("camera", fmt::format("{} holds no camera file (.yaml)", library.string()));
  std::sort(cameras.begin(), cameras.end(), [](const auto& a, const auto& b) { return a.file < b.file; });
  return cameras;
}

std::vector<CampaignCamera> read_cameras(const YamlMap& top, const std::filesystem::path& folder) {
  if (!top.is_sequence("camera")) {
    const std::filesystem::path file = folder / top.text("camera");
    if (std::filesystem::is_directory(file)) return cameras_in(top, file);
    return {{file, "", ""}};
  }
  std::vector<CampaignCamera> cameras;
  for (const YamlMap& entry : top.maps("camera")) {
    CampaignCamera camera;
    camera.file = folder / entry.text("file");
    camera.serial = entry.optional_text("serial").value_or("");
    camera.folder = entry.optional_text("folder").value_or("");
    entry.finish();
    cameras.push_back(camera);
  }
  if (cameras.empty()) top.fail("camera", "is empty, wanted a camera file");
  return cameras;
}

void check_points_known(const YamlMap& top, const std::string& key, const Campaign& campaign,
                        const std::vector<KnownLength>& lengths) {
  for (const KnownLength& length : lengths) {
    const bool fixed = campaign.fixed.count(length.a.id) != 0;
    const bool known = fixed || campaign.moving.count(length.a.id) != 0;
    const bool same =
        fixed ? campaign.fixed.count(length.b.id) != 0 : campaign.moving.count(length.b.id) != 0;
    if (!known || !same) {
      top.fail(key, fmt::format("{} to {}: wanted two markers of one body", length.a.id, length.b.id));
    }
  }
}

std::optional<std::filesystem::path> optional_path(const YamlMap& top, const std::string& key,
                                                   const std::filesystem::path& folder) {
  const auto text = top.optional_text(key);
  if (!text) return std::nullopt;
  return folder / *text;
}

}  // namespace

namespace {

Campaign campaign_from_yaml(const YamlMap& top, const std::filesystem::path& file) {
  Campaign campaign;
  campaign.file = file;
  campaign.folder = file.parent_path();
  const std::filesystem::path& folder = campaign.folder;

  campaign.cameras = read_cameras(top, folder);
  campaign.hexapod = optional_path(top, "hexapod", folder);
  campaign.targets = optional_path(top, "targets", folder);
  campaign.legs = optional_path(top, "legs", folder);
  campaign.images = folder / top.text("images");
  campaign.images_table = optional_path(top, "images_table", folder);

  const YamlMap markers = top.map("markers");
  campaign.family = markers.text("family");
  campaign.fixed = read_sizes(markers.map("fixed"));
  if (markers.has("moving")) campaign.moving = read_sizes(markers.map("moving"));
  markers.finish();
  for (const auto& [id, size] : campaign.moving) {
    if (campaign.fixed.count(id) != 0)
      top.fail("markers", fmt::format("marker {} is both fixed and moving", id));
  }

  if (top.has("frames")) {
    const YamlMap frames = top.map("frames");
    if (frames.has("UG")) campaign.ug = read_frame(frames, "UG", folder);
    if (frames.has("LG")) campaign.lg = read_frame(frames, "LG", folder);
    frames.finish();
  }
  if (!campaign.moving.empty() && !(campaign.ug && campaign.lg)) {
    top.fail("frames", "wanted UG and LG, since there are moving markers");
  }
  if (campaign.ug && campaign.ug->from == FrameRule::From::markers &&
      !(campaign.lg && campaign.lg->from == FrameRule::From::home)) {
    top.fail("frames",
             "UG from markers wants LG from home: z points from the moving to the fixed markers there");
  }
  read_scale(top, campaign);
  if (top.has("checks")) campaign.checks = read_lengths(top, "checks");
  check_points_known(top, "scale", campaign, campaign.bars);
  check_points_known(top, "checks", campaign, campaign.checks);
  top.finish();
  return campaign;
}

}  // namespace

Campaign read_campaign(const std::filesystem::path& folder_or_file) {
  const std::filesystem::path file =
      std::filesystem::is_directory(folder_or_file) ? folder_or_file / "campaign.yaml" : folder_or_file;
  return campaign_from_yaml(YamlMap::read(file), file);
}

Campaign parse_campaign(const std::string& text, const std::filesystem::path& file) {
  return campaign_from_yaml(YamlMap::parse(text, file), file);
}

std::vector<NominalPoint> read_nominal_points(const std::filesystem::path& path) {
  const CsvTable table = CsvTable::read(path);
  table.require_columns({"id", "corner", "x_mm", "y_mm", "z_mm"});
  const bool has_sigma = table.has_column("sigma_mm");
  std::set<MarkerPoint> seen;
  std::vector<NominalPoint> points;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    NominalPoint point;
    point.point.id = table.integer(row, "id");
    point.point.corner = table.text(row, "corner").empty() ? -1 : table.integer(row, "corner");
    if (point.point.corner < -1 || point.point.corner > 3) table.fail(row, "corner", "wanted 0 to 3");
    if (!seen.insert(point.point).second) table.fail(row, "id", "this point stands twice");
    point.xyz_mm = {table.number(row, "x_mm"), table.number(row, "y_mm"), table.number(row, "z_mm")};
    if (const auto sigma = has_sigma ? table.optional_number(row, "sigma_mm") : std::nullopt) {
      if (!(*sigma > 0)) table.fail(row, "sigma_mm", "wanted more than 0");
      point.sigma_mm = *sigma;
    }
    points.push_back(point);
  }
  if (points.size() < 3) {
    throw InputError(fmt::format("{}: {} points, wanted at least 3", path.string(), points.size()));
  }
  return points;
}

std::vector<ImageRow> read_images_table(const std::filesystem::path& path) {
  const CsvTable table = CsvTable::read(path);
  table.require_columns({"file", "pose"});
  std::vector<ImageRow> rows;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    rows.push_back({table.text(row, "file"), table.text(row, "pose")});
    if (rows.back().file.empty()) table.fail(row, "file", "is empty, wanted a file name");
    if (rows.back().pose.empty()) table.fail(row, "pose", "is empty, wanted a pose id");
  }
  return rows;
}

}  // namespace hexcal
