#include "pose_extract/nominal_slips.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "photogrammetry/adjustment/projection.h"

namespace hexcal {
namespace {

constexpr double kExplains = 3;         // times better than as listed, where that is beyond reason
constexpr double kExplainsWithin = 6;   // where a rough hand would do, too
constexpr double kLeastMisfitMm = 0.2;  // below it nothing wants explaining
constexpr double kShareOfPoints = 0.6;  // that a slip must explain
constexpr int kFewestStickers = 5;      // of other ids: fewer fit by chance
constexpr double kUnitTolerance = 0.06;

using CornerOrder = std::array<int, 4>;  // the corner that is meant by 0, 1, 2, 3

// Measured corners of a body's markers in the body, 3 x 4, by id.
using MeasuredMarkers = std::map<int, Eigen::Matrix3Xd>;

MeasuredMarkers measured_markers(const Network& network, const AdjustmentResult& adjusted, int body) {
  MeasuredMarkers markers;
  for (std::size_t f = 0; f < network.features.size(); ++f) {
    if (network.features[f].body != body || !adjusted.geometry.has_feature[f]) continue;
    markers[network.features[f].id] = feature_points_in_body(network, adjusted.geometry, static_cast<int>(f));
  }
  return markers;
}

Eigen::Vector3d place_of(const Eigen::Matrix3Xd& corners, int corner) {
  if (corner < 0 || corner >= corners.cols()) return corners.rowwise().mean();
  return corners.col(corner);
}

struct Hypothesis {
  std::map<int, int> meant;  // id that is meant by a listed one; empty: as listed
  CornerOrder corners{0, 1, 2, 3};
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // of the coordinates as they should be
  bool with_scale = false;
};

struct HypothesisFit {
  std::optional<RobustMotion> motion;
  std::size_t points = 0;
  std::size_t stickers = 0;
};

HypothesisFit fit_hypothesis(const MeasuredMarkers& measured, const std::vector<NominalPoint>& nominal,
                             const Hypothesis& hypothesis) {
  std::vector<Eigen::Vector3d> from, to;
  std::map<int, int> stickers;
  for (const NominalPoint& point : nominal) {
    int id = point.point.id;
    if (!hypothesis.meant.empty()) {
      const auto meant = hypothesis.meant.find(id);
      if (meant == hypothesis.meant.end()) continue;
      id = meant->second;
    }
    const auto marker = measured.find(id);
    if (marker == measured.end()) continue;
    const int corner = point.point.corner;
    from.push_back(
        place_of(marker->second, corner < 0 ? corner : hypothesis.corners[static_cast<std::size_t>(corner)]));
    to.emplace_back(hypothesis.axes * point.xyz_mm);
    ++stickers[id];
  }
  HypothesisFit fit;
  fit.points = from.size();
  fit.stickers = stickers.size();
  if (from.size() < 3) return fit;
  Eigen::Matrix3Xd a(3, static_cast<Eigen::Index>(from.size()));
  Eigen::Matrix3Xd b = a;
  for (std::size_t i = 0; i < from.size(); ++i) {
    a.col(static_cast<Eigen::Index>(i)) = from[i];
    b.col(static_cast<Eigen::Index>(i)) = to[i];
  }
  fit.motion = robust_motion(a, b, hypothesis.with_scale);
  return fit;
}

// Where the other body's markers lie in this body, from the first pose that was measured.
std::optional<Eigen::Vector3d> middle_of_other(const Network& network, const AdjustmentResult& adjusted,
                                               int body) {
  const auto& has = adjusted.geometry.has_pose;
  if (has.size() <= static_cast<std::size_t>(kMovingBody)) return std::nullopt;
  const auto first = std::find_if(has[kMovingBody].begin(), has[kMovingBody].end(), [](auto h) { return h; });
  if (first == has[kMovingBody].end()) return std::nullopt;
  const Rigid3& fixed_from_moving =
      adjusted.geometry
          .reference_from_body[kMovingBody][static_cast<std::size_t>(first - has[kMovingBody].begin())];
  const bool fixed = body == kReferenceBody;
  const MeasuredMarkers other = measured_markers(network, adjusted, fixed ? kMovingBody : kReferenceBody);
  if (other.empty()) return std::nullopt;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& [id, corners] : other)
    middle += corners.rowwise().mean() / static_cast<double>(other.size());
  return fixed ? fixed_from_moving * middle : inverse(fixed_from_moving) * middle;
}

struct AxesSlip {
  const char* words;
  Eigen::Matrix3d axes;
};

std::vector<AxesSlip> axes_slips() {
  const auto sign = [](int axis) {
    Eigen::Matrix3d m = Eigen::Matrix3d::Identity();
    m(axis, axis) = -1;
    return m;
  };
  const auto exchange = [](int a, int b) {
    Eigen::Matrix3d m = Eigen::Matrix3d::Identity();
    m.col(a).swap(m.col(b));
    return m;
  };
  return {{"x has the other sign", sign(0)},         {"y has the other sign", sign(1)},
          {"z has the other sign", sign(2)},         {"x and y are exchanged", exchange(0, 1)},
          {"y and z are exchanged", exchange(1, 2)}, {"x and z are exchanged", exchange(0, 2)}};
}

// All reflections fit alike: those count that leave the other grip where it belongs, LG below UG.
std::string reflection_words(const Network& network, const AdjustmentResult& adjusted, int body,
                             const Rigid3& frame_from_body, const Eigen::Matrix3d& tried) {
  std::vector<std::string> possible;
  const auto other = middle_of_other(network, adjusted, body);
  for (const AxesSlip& slip : axes_slips()) {
    if (other) {
      const Eigen::Vector3d at = slip.axes * tried.inverse() * (frame_from_body * *other);
      const double up = body == kReferenceBody ? -at.z() : at.z();
      if (!(up > 0.7 * at.norm())) continue;
    }
    possible.emplace_back(slip.words);
  }
  if (possible.empty()) return "mirrored: an axis has the other sign, or two are exchanged";
  return fmt::format("mirrored: {}", fmt::join(possible, ", or "));
}

struct UnitSlip {
  double scale;  // listed over measured
  const char* words;
};

constexpr UnitSlip kUnits[] = {{1 / 25.4, "in inch"},
                               {0.1, "in cm"},
                               {0.001, "in m"},
                               {1000, "in um, or the markers' size_mm in m"},
                               {25.4, "right and the markers' size_mm in inch"},
                               {10, "right and the markers' size_mm in cm"}};

struct CornerSlip {
  const char* words;
  CornerOrder order;
};

constexpr CornerSlip kCorners[] = {{"of markers that are turned by 90 deg", {1, 2, 3, 0}},
                                   {"of markers that are turned by 180 deg", {2, 3, 0, 1}},
                                   {"of markers that are turned by 270 deg", {3, 0, 1, 2}},
                                   {"with corners counted the other way round", {0, 3, 2, 1}},
                                   {"with corners counted the other way round from corner 1", {1, 0, 3, 2}},
                                   {"with corners counted the other way round from corner 2", {2, 1, 0, 3}},
                                   {"with corners counted the other way round from corner 3", {3, 2, 1, 0}}};

// Listed ids to those that are meant, by a shift of all; shifts under which enough of them were measured.
std::vector<std::pair<int, std::map<int, int>>> id_shifts(const MeasuredMarkers& measured,
                                                          const std::vector<NominalPoint>& nominal) {
  std::map<int, int> listed;
  for (const NominalPoint& point : nominal) listed[point.point.id] = 0;
  std::map<int, std::map<int, int>> shifts;
  for (const auto& [id, unused] : listed) {
    for (const auto& [other, corners] : measured) {
      if (other != id) shifts[other - id][id] = other;
    }
  }
  std::vector<std::pair<int, std::map<int, int>>> found;
  for (auto& [shift, meant] : shifts) {
    const auto count = static_cast<double>(meant.size());
    if (meant.size() < kFewestStickers || count < 0.5 * static_cast<double>(listed.size())) continue;
    found.emplace_back(shift, std::move(meant));
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return std::abs(a.first) < std::abs(b.first); });
  return found;
}

std::map<int, int> reverse_order(const MeasuredMarkers& measured, const std::vector<NominalPoint>& nominal) {
  std::map<int, int> meant;
  if (measured.empty()) return meant;
  const int sum = measured.begin()->first + measured.rbegin()->first;
  for (const NominalPoint& point : nominal) {
    if (measured.count(sum - point.point.id) != 0) meant[point.point.id] = sum - point.point.id;
  }
  return meant;
}

class SlipSearch {
 public:
  SlipSearch(const MeasuredMarkers& measured, const std::vector<NominalPoint>& nominal, double as_listed_mm,
             double limit_mm)
      : measured_(measured), nominal_(nominal), as_listed_mm_(as_listed_mm), limit_mm_(limit_mm) {}

  // The fit if the hypothesis explains the misfit better than any before.
  std::optional<RobustMotion> better(const Hypothesis& hypothesis) {
    const HypothesisFit fit = fit_hypothesis(measured_, nominal_, hypothesis);
    if (!fit.motion || static_cast<int>(fit.stickers) < (hypothesis.meant.empty() ? 1 : kFewestStickers))
      return std::nullopt;
    if (hypothesis.meant.empty() &&
        static_cast<double>(fit.points) < kShareOfPoints * static_cast<double>(nominal_.size())) {
      return std::nullopt;
    }
    // In the markers' own unit.
    const double left_mm = fit.motion->most_mm / fit.motion->scale;
    const double times = as_listed_mm_ > limit_mm_ ? kExplains : kExplainsWithin;
    if (left_mm > limit_mm_ || times * left_mm > as_listed_mm_) return std::nullopt;
    // Slips that fit alike: the first stays, for the list begins with the likeliest.
    if (found_ && 2 * left_mm > found_->left_mm) return std::nullopt;
    found_ = NominalSlip{"", "", left_mm};
    return fit.motion;
  }
  NominalSlip& found() { return *found_; }
  [[nodiscard]] const std::optional<NominalSlip>& result() const { return found_; }

 private:
  const MeasuredMarkers& measured_;
  const std::vector<NominalPoint>& nominal_;
  double as_listed_mm_, limit_mm_;
  std::optional<NominalSlip> found_;
};

std::string point_name(const MarkerPoint& point) {
  return point.corner < 0 ? fmt::format("{}", point.id) : fmt::format("{}.{}", point.id, point.corner);
}

// Where a sticker's middle lies in the frame, and where it is listed.
struct StickerPlace {
  int id = -1;
  Eigen::Vector3d measured, listed;
};

StickerPlace place_in_frame(const NominalSticker& sticker, const NominalFit& fit) {
  StickerPlace place{sticker.id, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (std::size_t i = 0; i < sticker.points.size(); ++i) {
    place.measured += fit.frame_from_body * (fit.scale * sticker.in_body.col(static_cast<Eigen::Index>(i)));
    place.listed += sticker.points[i].xyz_mm;
  }
  place.measured /= static_cast<double>(sticker.points.size());
  place.listed /= static_cast<double>(sticker.points.size());
  return place;
}

// The order of corners under which a sticker fits; null if none.
const char* turned_words(const NominalSticker& sticker, const NominalFit& fit, double limit_mm) {
  if (sticker.points.size() < 4) return nullptr;
  for (const CornerSlip& slip : kCorners) {
    double worst = 0;
    for (std::size_t i = 0; i < sticker.points.size(); ++i) {
      const int corner = sticker.points[i].point.corner;
      if (corner < 0) return nullptr;
      const int meant = slip.order[static_cast<std::size_t>(corner)];
      for (std::size_t k = 0; k < sticker.points.size(); ++k) {
        if (sticker.points[k].point.corner != meant) continue;
        worst = std::max(
            worst, (fit.frame_from_body * (fit.scale * sticker.in_body.col(static_cast<Eigen::Index>(k))) -
                    sticker.points[i].xyz_mm)
                       .norm());
      }
    }
    if (worst < limit_mm) return slip.words;
  }
  return nullptr;
}

}  // namespace

std::optional<NominalSlip> find_slip(const Network& network, const AdjustmentResult& adjusted, int body,
                                     const std::vector<NominalPoint>& nominal, double as_listed_mm,
                                     double limit_mm) {
  if (as_listed_mm < kLeastMisfitMm) return std::nullopt;
  const MeasuredMarkers measured = measured_markers(network, adjusted, body);
  SlipSearch search(measured, nominal, as_listed_mm, limit_mm);
  bool with_corners = false;
  for (const NominalPoint& point : nominal) with_corners = with_corners || point.point.corner >= 0;
  if (with_corners) {
    for (const CornerSlip& slip : kCorners) {
      Hypothesis hypothesis;
      hypothesis.corners = slip.order;
      if (!search.better(hypothesis)) continue;
      search.found().words = slip.words;
      search.found().instruction =
          "count corners 0 top-left, 1 top-right, 2 bottom-right, 3 bottom-left of the marker as its family "
          "draws it upright, and see whether the prints are turned";
    }
  }
  for (const auto& [shift, meant] : id_shifts(measured, nominal)) {
    Hypothesis hypothesis;
    hypothesis.meant = meant;
    if (!search.better(hypothesis)) continue;
    search.found().words = fmt::format(
        "those of other ids: what is listed for id {} fits marker {}, and so on (shifted by {:+})",
        meant.begin()->first, meant.begin()->second, shift);
    search.found().instruction = fmt::format("add {} to the ids, or move the rows", shift);
  }
  Hypothesis reversed;
  reversed.meant = reverse_order(measured, nominal);
  if (search.better(reversed)) {
    search.found().words = "those of the ids in reverse order";
    search.found().instruction = "list the ids the other way round";
  }
  Hypothesis mirrored;
  mirrored.axes = axes_slips().front().axes;
  if (const auto motion = search.better(mirrored)) {
    search.found().words = reflection_words(network, adjusted, body, motion->motion, mirrored.axes);
    search.found().instruction = "make the axes right-handed, with z up from LG to UG";
  }
  Hypothesis scaled;
  scaled.with_scale = true;
  const HypothesisFit free = fit_hypothesis(measured, nominal, scaled);
  // What a printer does to the scale is for judge_scale() to say.
  const bool printed = free.motion && std::abs(std::log(free.motion->scale)) < kBeyondPrinter;
  if (printed && as_listed_mm <= limit_mm) return search.result();
  if (const auto motion = search.better(scaled)) {
    search.found().words = fmt::format("{:.4g} times as large as the markers' size_mm say", motion->scale);
    search.found().instruction =
        "measure a marker's edge and one distance between markers, and correct the "
        "wrong one of size_mm and coordinates";
    for (const UnitSlip& unit : kUnits) {
      if (std::abs(std::log(motion->scale / unit.scale)) > kUnitTolerance) continue;
      search.found().words = unit.words;
      search.found().instruction = "write both in mm";
    }
  }
  return search.result();
}

std::vector<std::string> words_of_left_out(const std::vector<NominalSticker>& stickers,
                                           const NominalFit& fit) {
  std::vector<std::string> words;
  std::vector<StickerPlace> out;
  // A left-out sticker that fits elsewhere does so as the others fit.
  const double limit_mm =
      std::max(0.5, 5 * std::hypot(fit.placement.shift_mm, 17 * fit.placement.turn_rad, fit.point_mm));
  for (const NominalSticker& sticker : stickers) {
    if (!sticker.any_used()) out.push_back(place_in_frame(sticker, fit));
  }
  for (const NominalSticker& sticker : stickers) {
    const StickerPlace place = place_in_frame(sticker, fit);
    const Eigen::Vector3d off = place.measured - place.listed;
    if (sticker.any_used()) {
      for (std::size_t i = 0; i < sticker.points.size(); ++i) {
        if (sticker.used[i]) continue;
        const Eigen::Vector3d at =
            fit.frame_from_body * (fit.scale * sticker.in_body.col(static_cast<Eigen::Index>(i)));
        words.push_back(
            fmt::format("nominal point {} is {:.3f} mm off and was left out: check its coordinates",
                        point_name(sticker.points[i].point), (at - sticker.points[i].xyz_mm).norm()));
      }
      continue;
    }
    const auto exchanged = std::find_if(out.begin(), out.end(), [&](const StickerPlace& other) {
      return other.id != place.id && (other.measured - place.listed).norm() < limit_mm &&
             (place.measured - other.listed).norm() < limit_mm;
    });
    if (exchanged != out.end()) {
      if (exchanged->id > place.id)
        words.push_back(
            fmt::format("markers {} and {} were left out, for each lies where the other is listed: exchange "
                        "the two in the "
                        "table, or the stickers",
                        place.id, exchanged->id));
      continue;
    }
    if (const char* turned = turned_words(sticker, fit, limit_mm)) {
      words.push_back(fmt::format("marker {} was left out, its coordinates are {}: correct its corners",
                                  place.id, turned));
      continue;
    }
    Eigen::Index axis = 0;
    (void)off.cwiseAbs().maxCoeff(&axis);
    Eigen::Vector3d rest = off;
    rest[axis] = 0;
    const bool one_axis = rest.norm() < std::min(limit_mm, 0.2 * off.norm());
    words.push_back(
        one_axis ? fmt::format("marker {} is {:.3f} mm off and was left out: its {}_mm is listed as {:.3f}, "
                               "measured {:.3f}: check the table",
                               place.id, off.norm(), "xyz"[axis], place.listed[axis], place.measured[axis])
                 : fmt::format("marker {} is {:.3f} mm off its nominal place and was left out: check its "
                               "coordinates, or whether it still sticks where it did",
                               place.id, off.norm()));
  }
  return words;
}

}  // namespace hexcal
