#include "tools/campaign/survey_photographs.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "photogrammetry/photograph/photograph_file.h"

namespace hexcal {
namespace {

constexpr std::size_t kSampled = 6;  // photographs in which every family is looked for
constexpr double kOffSheet = 0.15;  // of a marker's side: farther from its place on the sheet it is not on it
constexpr double kShareOfSheet = 0.8;     // of a photograph's markers that lie on the sheet
constexpr std::size_t kLeastOnSheet = 4;  // markers
constexpr double kSameScore = 0.98;       // families of one dictionary read nearly the same markers

using Reads = std::map<std::string, std::vector<MarkerObservation>>;  // by family

Eigen::Matrix3d normalising(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : points) mean += p / static_cast<double>(points.size());
  double spread = 0;
  for (const Eigen::Vector2d& p : points) spread += (p - mean).norm() / static_cast<double>(points.size());
  Eigen::Matrix3d t = Eigen::Matrix3d::Identity() / std::max(spread, 1e-9);
  t.topRightCorner<2, 1>() = -mean / std::max(spread, 1e-9);
  t(2, 2) = 1;
  return t;
}

// Direct linear transformation (Hartley and Zisserman 2004, algorithm 4.2).
Eigen::Matrix3d homography(const std::vector<Eigen::Vector2d>& from, const std::vector<Eigen::Vector2d>& to) {
  const Eigen::Matrix3d tf = normalising(from);
  const Eigen::Matrix3d tt = normalising(to);
  Eigen::Matrix<double, Eigen::Dynamic, 9> rows(static_cast<Eigen::Index>(2 * from.size()), 9);
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Eigen::RowVector3d p = (tf * from[i].homogeneous()).transpose();
    const Eigen::Vector3d q = tt * to[i].homogeneous();
    const auto r = static_cast<Eigen::Index>(2 * i);
    rows.row(r) << p, Eigen::RowVector3d::Zero(), -q.x() * p;
    rows.row(r + 1) << Eigen::RowVector3d::Zero(), p, -q.y() * p;
  }
  const Eigen::Matrix<double, 9, 1> h =
      Eigen::JacobiSVD<Eigen::MatrixXd>(rows, Eigen::ComputeThinU | Eigen::ComputeFullV).matrixV().col(8);
  const Eigen::Matrix3d normalised = Eigen::Map<const Eigen::Matrix3d>(h.data()).transpose();
  return tt.inverse() * normalised * tf;
}

class Surveyor {
 public:
  Surveyor(std::vector<Sheet> sheets, SurveyObserver& observer)
      : sheets_(std::move(sheets)), observer_(observer) {}

  PhotographSurvey survey(const std::filesystem::path& folder, const std::string& family) {
    ImageListing listing = list_images(folder, {});
    found_.skipped = std::move(listing.skipped);
    found_.poses = std::move(listing.poses);
    for (CampaignImage& image : listing.images)
      found_.photographs.push_back({std::move(image), {}, "", false, {}});
    reads_.resize(found_.photographs.size());
    std::vector<std::string> families =
        family.empty() ? families_of_sample() : std::vector<std::string>{family};
    for (const Sheet& sheet : sheets_) {
      if (!sheet.family.empty() && std::ranges::find(families, sheet.family) == families.end())
        families.push_back(sheet.family);
    }
    std::vector<std::size_t> all(found_.photographs.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
    read(all, families, "reading");
    for (std::size_t i = 0; i < all.size(); ++i) found_.photographs[i].of_sheet = of_sheet(i);
    found_.family = family.empty() ? chosen_family(families) : family;
    for (std::size_t i = 0; i < all.size(); ++i) found_.photographs[i].markers = reads_[i][found_.family];
    return std::move(found_);
  }

 private:
  // Reads what was not yet read of these families.
  void read(const std::vector<std::size_t>& which, const std::vector<std::string>& families,
            const std::string& words) {
    observer_.begin(words, which.size());
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, which.size(), 1),
        [&](const tbb::blocked_range<std::size_t>& range) {
          for (std::size_t k = range.begin(); k < range.end(); ++k) {
            tbb::this_task_arena::isolate([&] { read_one(which[k], families); });
            observer_.advance();
          }
        },
        tbb::simple_partitioner());
  }

  void read_one(std::size_t i, const std::vector<std::string>& families) {
    SurveyedPhotograph& photograph = found_.photographs[i];
    std::vector<std::string> missing;
    for (const std::string& family : families)
      if (reads_[i].count(family) == 0) missing.push_back(family);
    if (missing.empty() || !photograph.fault.empty()) return;
    const Photograph decoded = read_photograph(photograph.image.path);
    photograph.info = decoded.info;
    if (decoded.status != PhotographStatus::ok) {
      photograph.fault = decoded.reason.empty() ? photograph_status_name(decoded.status) : decoded.reason;
      return;
    }
    photograph.info.width_px = decoded.grey.cols;
    photograph.info.height_px = decoded.grey.rows;
    for (FamilyReading& reading : read_families(decoded.grey, decoded.tone, missing))
      reads_[i][reading.family] = std::move(reading.markers);
  }

  // Families of which some photograph of a sample shows two markers at least.
  std::vector<std::string> families_of_sample() {
    const std::size_t n = found_.photographs.size();
    std::set<std::size_t> sample;
    for (std::size_t k = 0; k < std::min(n, kSampled); ++k) sample.insert(k * n / std::min(n, kSampled));
    read({sample.begin(), sample.end()}, marker_family_names(), "looking for markers");
    std::vector<std::string> families;
    for (const std::string& family : marker_family_names()) {
      const bool shown = std::any_of(sample.begin(), sample.end(), [&](std::size_t i) {
        const auto found = reads_[i].find(family);
        return found != reads_[i].end() && found->second.size() >= 2;
      });
      if (shown) families.push_back(family);
    }
    return families;
  }

  [[nodiscard]] bool of_sheet(std::size_t i) {
    if (!found_.photographs[i].fault.empty()) return false;
    bool shows_markers = false;
    for (const auto& [family, markers] : reads_[i]) shows_markers = shows_markers || markers.size() >= 2;
    return std::any_of(sheets_.begin(), sheets_.end(), [&](const Sheet& sheet) {
      return sheet.family.empty() ? !shows_markers : shows_sheet(reads_[i][sheet.family], sheet);
    });
  }

  // Markers that a photograph shows by chance are seldom shown twice.
  [[nodiscard]] std::string chosen_family(const std::vector<std::string>& families) const {
    std::map<std::string, int> score;
    int best = 0;
    for (const std::string& family : families) {
      std::map<int, int> times;
      int photographs = 0;
      for (std::size_t i = 0; i < reads_.size(); ++i) {
        const auto found = reads_[i].find(family);
        if (found_.photographs[i].of_sheet || found == reads_[i].end()) continue;
        ++photographs;
        for (const MarkerObservation& marker : found->second) ++times[marker.id];
      }
      for (const auto& [id, count] : times)
        if (count >= 2 || photographs == 1) score[family] += count;
      best = std::max(best, score[family]);
    }
    // Of dictionaries that hold the same markers, the sheet's own.
    for (const Sheet& sheet : sheets_) {
      if (best > 0 && score[sheet.family] >= kSameScore * best) return sheet.family;
    }
    for (const std::string& family : families) {
      if (best > 0 && score.at(family) >= kSameScore * best) return family;
    }
    return "";
  }

  std::vector<Sheet> sheets_;
  SurveyObserver& observer_;
  PhotographSurvey found_;
  std::vector<Reads> reads_;
};

}  // namespace

bool shows_sheet(const std::vector<MarkerObservation>& markers, const Sheet& sheet) {
  const SheetGeometry geometry = sheet_geometry(sheet);
  std::vector<Eigen::Vector2d> printed;
  std::vector<Eigen::Vector2d> seen;
  for (const MarkerObservation& marker : markers) {
    const auto on_sheet = std::ranges::find(geometry.markers, marker.id, &SheetMarker::id);
    if (on_sheet == geometry.markers.end()) continue;
    for (int c = 0; c < 4; ++c) {
      printed.push_back(on_sheet->corner_mm(c));
      seen.push_back(marker.corners_px[static_cast<std::size_t>(c)]);
    }
  }
  if (printed.size() < 4 * kLeastOnSheet ||
      static_cast<double>(printed.size()) < 4 * kShareOfSheet * static_cast<double>(markers.size()))
    return false;
  // A misread marker pulls the fit: what lies farthest off leaves it, round by round.
  std::vector<std::size_t> used(printed.size());
  for (std::size_t i = 0; i < used.size(); ++i) used[i] = i;
  std::size_t on = 0;
  for (int round = 0; round < 5 && used.size() >= 4 * kLeastOnSheet; ++round) {
    std::vector<Eigen::Vector2d> from;
    std::vector<Eigen::Vector2d> to;
    for (const std::size_t i : used) {
      from.push_back(printed[i]);
      to.push_back(seen[i]);
    }
    const Eigen::Matrix3d px_from_sheet = homography(from, to);
    std::vector<std::pair<double, std::size_t>> off;  // in sides of the marker
    for (std::size_t i = 0; i < printed.size(); ++i) {
      const std::size_t first = i / 4 * 4;
      const double side_px = (seen[first + 2] - seen[first]).norm() / std::sqrt(2.0);
      const Eigen::Vector3d at = px_from_sheet * printed[i].homogeneous();
      off.emplace_back((at.hnormalized() - seen[i]).norm() / side_px, i);
    }
    std::sort(off.begin(), off.end());
    const auto inside = std::partition_point(off.begin(), off.end(),
                                             [](const auto& corner) { return corner.first < kOffSheet; });
    on = std::max(on, static_cast<std::size_t>(inside - off.begin()));
    const std::size_t kept = std::max(off.size() * 7 / 10, static_cast<std::size_t>(inside - off.begin()));
    used.clear();
    for (std::size_t k = 0; k < kept; ++k) used.push_back(off[k].second);
  }
  return static_cast<double>(on) > kShareOfSheet * static_cast<double>(printed.size());
}

PhotographSurvey survey_photographs(const std::filesystem::path& folder, const std::vector<Sheet>& sheets,
                                    const std::string& family, SurveyObserver& observer) {
  return Surveyor(sheets, observer).survey(folder, family);
}

}  // namespace hexcal
