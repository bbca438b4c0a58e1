#include "camera_calib/sheet_slip.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>

#include "camera_calib/sheet_image.h"
#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

constexpr double kHolds = 0.95;  // share of the markers at which a description is not doubted
constexpr double kNamed = 0.85;  // that a slip has to explain
constexpr double kClearlyMore = 0.05;
constexpr std::size_t kLeastMarkers = 8;
constexpr int kMostColumns = 40;
constexpr int kFarthestShift = 3;  // of first_id, columns and rows

// A description and how its markers stand in their places: turned by so many quarter turns.
struct Candidate {
  Sheet sheet;
  int quarter_turns = 0;
  std::string words;  // "columns: 6, rows: 8"
};

using Reads = std::vector<std::vector<MarkerRead>>;  // per photograph, of the sheet's family

std::size_t count(const Reads& reads) {
  std::size_t sum = 0;
  for (const auto& photograph : reads) sum += photograph.size();
  return sum;
}

// Without the markers of the template's other sheets.
Reads reads_of(const std::vector<Sheet>& sheets, std::size_t index,
               const std::vector<SheetPhotograph>& photographs) {
  std::set<int> elsewhere;
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    if (s == index || sheets[s].family != sheets[index].family) continue;
    for (const SheetMarker& marker : sheet_geometry(sheets[s]).markers) elsewhere.insert(marker.id);
  }
  Reads out;
  for (const SheetPhotograph& photograph : photographs) {
    std::vector<MarkerRead> reads;
    for (const MarkerRead& read : photograph.markers) {
      if (read.family == sheets[index].family && elsewhere.count(read.id) == 0) reads.push_back(read);
    }
    out.push_back(std::move(reads));
  }
  return out;
}

std::size_t agreeing(const Candidate& candidate, const Reads& reads) {
  const SheetGeometry geometry = sheet_geometry(candidate.sheet);
  std::map<int, int> places;
  for (std::size_t m = 0; m < geometry.markers.size(); ++m) {
    places.emplace(geometry.markers[m].id, static_cast<int>(m));
  }
  std::size_t sum = 0;
  for (const std::vector<MarkerRead>& photograph : reads) {
    std::vector<FeatureObservation> features;
    for (const MarkerRead& read : photograph) {
      const auto place = places.find(read.id);
      if (place == places.end()) continue;
      FeatureObservation feature;
      feature.first_point = 4 * place->second;
      feature.px.resize(8);
      for (int i = 0; i < 4; ++i) {
        feature.px.segment<2>(2 * i) =
            read.corners_px[static_cast<std::size_t>((i + candidate.quarter_turns) % 4)];
      }
      features.push_back(feature);
    }
    if (features.size() < 2) continue;
    const SheetImage image(geometry, features);
    if (!image.known()) continue;
    sum += static_cast<std::size_t>(std::count(image.agrees().begin(), image.agrees().end(), 1));
  }
  return sum;
}

bool possible(const Sheet& sheet) {
  try {
    sheet.validate();
  } catch (const InputError&) {
    return false;
  }
  return true;
}

// The least and the greatest id that were read in at least two photographs: a false read seldom comes twice.
std::optional<std::pair<int, int>> ids_of(const Reads& reads) {
  std::map<int, int> photographs;
  for (const auto& photograph : reads) {
    std::set<int> ids;
    for (const MarkerRead& read : photograph) ids.insert(read.id);
    for (const int id : ids) ++photographs[id];
  }
  std::optional<std::pair<int, int>> range;
  for (const auto& [id, n] : photographs) {
    if (n >= 2) range = std::pair(range ? range->first : id, id);
  }
  return range;
}

// The fewest rows with which a sheet has a marker of this id.
int rows_for(Sheet sheet, int id) {
  for (sheet.rows = 1; sheet.rows < kMostColumns; ++sheet.rows) {
    if (!possible(sheet)) continue;
    const std::vector<SheetMarker> markers = sheet_geometry(sheet).markers;
    if (std::ranges::any_of(markers, [id](const SheetMarker& marker) { return marker.id >= id; })) break;
  }
  return sheet.rows;
}

std::vector<Candidate> slips_of(const Sheet& given, std::optional<std::pair<int, int>> ids) {
  std::vector<Candidate> out;
  const auto add = [&out](const Sheet& sheet, std::string words, int quarter_turns = 0) {
    if (possible(sheet)) out.push_back({sheet, quarter_turns, std::move(words)});
  };
  const auto sized = [&](int columns, int rows) {
    Sheet sheet = given;
    sheet.columns = columns;
    sheet.rows = rows;
    add(sheet, fmt::format("columns: {}, rows: {}", columns, rows));
  };
  if (given.kind == SheetKind::charuco) {
    Sheet sheet = given;
    sheet.top_left_white = !given.top_left_white;
    add(sheet, fmt::format("top_left_white: {}", sheet.top_left_white));
  }
  if (given.columns != given.rows) sized(given.rows, given.columns);
  for (int by = 1; by <= kFarthestShift; ++by) {
    for (const int shift : {by, -by}) {
      sized(given.columns + shift, given.rows);
      sized(given.columns, given.rows + shift);
      sized(given.rows + shift, given.columns);
      sized(given.rows, given.columns + shift);
      if (given.kind == SheetKind::markers) continue;
      Sheet sheet = given;
      sheet.first_id += shift;
      add(sheet, fmt::format("first_id: {}", sheet.first_id));
    }
  }
  if (ids && given.kind != SheetKind::markers && ids->first != given.first_id) {
    Sheet sheet = given;
    sheet.first_id = ids->first;
    add(sheet, fmt::format("first_id: {}", ids->first));
  }
  // Quite another sheet of this kind.
  for (int columns = 2; ids && columns < kMostColumns && given.kind != SheetKind::markers; ++columns) {
    Sheet sheet = given;
    sheet.columns = columns;
    sized(columns, rows_for(sheet, ids->second));
  }
  for (const int turns : {2, 1, 3}) {
    add(given,
        fmt::format("markers that stand turned by {} degrees in their places (OpenCV prints those of "
                    "the AprilTag families so): their family's name is then DICT_APRILTAG_...",
                    90 * turns),
        turns);
  }
  return out;
}

std::string given_words(const Sheet& given, const Candidate& found) {
  if (found.quarter_turns != 0) return "upright markers";
  if (found.sheet.top_left_white != given.top_left_white)
    return fmt::format("top_left_white: {}", given.top_left_white);
  if (found.sheet.first_id != given.first_id) return fmt::format("first_id: {}", given.first_id);
  return fmt::format("columns: {}, rows: {}", given.columns, given.rows);
}

}  // namespace

std::optional<std::string> sheet_slip(const std::vector<Sheet>& sheets, std::size_t index,
                                      const std::vector<SheetPhotograph>& photographs) {
  const Sheet& given = sheets[index];
  if (given.family.empty()) return std::nullopt;
  const Reads reads = reads_of(sheets, index, photographs);
  const std::size_t all = count(reads);
  if (all < kLeastMarkers) return std::nullopt;
  const auto share = [all](std::size_t n) { return static_cast<double>(n) / static_cast<double>(all); };
  const std::size_t as_given = agreeing({given, 0, {}}, reads);
  if (share(as_given) >= kHolds) return std::nullopt;
  std::optional<Candidate> best;
  std::size_t most = as_given;
  const auto ids = ids_of(reads);
  int fewest_beyond = 0;
  for (const Candidate& candidate : slips_of(given, ids)) {
    const std::size_t n = agreeing(candidate, reads);
    // Rows beyond the last marker that was seen explain nothing.
    const int beyond = ids ? std::abs(sheet_geometry(candidate.sheet).markers.back().id - ids->second) : 0;
    if (n < most || n == as_given || (n == most && beyond >= fewest_beyond)) continue;
    most = n;
    best = candidate;
    fewest_beyond = beyond;
  }
  if (!best || share(most) < kNamed || share(most) < share(as_given) + kClearlyMore) return std::nullopt;
  return fmt::format(
      "the sheet's description says {}, the photographs show {} ({} of {} markers lie so, {} as described)",
      given_words(given, *best), best->words, most, all, as_given);
}

}  // namespace hexcal
