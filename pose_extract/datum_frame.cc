#include "pose_extract/datum_frame.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "kinematics/geometry/covariance.h"
#include "kinematics/geometry/median.h"
#include "pose_extract/nominal_points.h"
#include "pose_extract/nominal_slips.h"

namespace hexcal {
namespace {

constexpr int kIterations = 30;
constexpr double kOutlierSigmas = 5.0;
constexpr double kNarrowest = 0.01;  // least width over length of the points that set a frame
// Of coordinates that state no sigma: a good coordinate measuring machine's, unless few stickers leave it to
// a hand.
constexpr double kUnstatedSigmaMm = 0.01;
constexpr std::size_t kFewStickers = 10;
// With more of the points wrong than this, the rest is no more trusted.
constexpr double kFewWrong = 1.0 / 3;

// The used points leave the turn about a line open, as good as.
bool on_a_line(const std::vector<NominalSticker>& stickers) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> points;
  for (const NominalSticker& sticker : stickers) {
    for (std::size_t i = 0; i < sticker.points.size(); ++i) {
      if (!sticker.used[i]) continue;
      points.emplace_back(sticker.in_body.col(static_cast<Eigen::Index>(i)));
      mean += points.back();
    }
  }
  mean /= static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& point : points) scatter += (point - mean) * (point - mean).transpose();
  const Eigen::Vector3d spread =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter, Eigen::EigenvaluesOnly).eigenvalues();
  return !(spread[1] > kNarrowest * kNarrowest * spread[2]);
}

double assumed_sigma(const NominalPoint& point, std::size_t stickers) {
  if (point.sigma_mm > 0) return point.sigma_mm;
  return stickers < kFewStickers ? kHandPlacement.shift_mm : kUnstatedSigmaMm;
}

std::size_t count_used(const std::vector<NominalSticker>& stickers) {
  std::size_t used = 0;
  for (const NominalSticker& sticker : stickers)
    used += static_cast<std::size_t>(std::count(sticker.used.begin(), sticker.used.end(), 1));
  return used;
}

// Takes out points that are wrong, judged one by one by what is promised of them or, where nearly all break
// that promise, by the others. The reason why too few are left, or nothing.
std::string choose_used_points(std::vector<NominalSticker>& stickers, NominalFit& fit) {
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::Matrix3d r = fit.scale * fit.frame_from_body.rotation_matrix();
    std::vector<double> normalised;
    for (const NominalSticker& sticker : stickers) {
      for (std::size_t p = 0; p < sticker.points.size(); ++p) {
        const auto at = static_cast<Eigen::Index>(p);
        const double sigma = assumed_sigma(sticker.points[p], stickers.size());
        const Eigen::Matrix3d covariance = sigma * sigma * Eigen::Matrix3d::Identity() +
                                           r * sticker.covariance.block<3, 3>(3 * at, 3 * at) * r.transpose();
        const Eigen::Vector3d off =
            sticker.points[p].xyz_mm - fit.frame_from_body * (fit.scale * sticker.in_body.col(at));
        normalised.push_back(std::sqrt(off.dot(covariance.inverse() * off) / 3));
      }
    }
    const double limit = kOutlierSigmas * std::max(1.0, median(normalised));
    std::size_t next = 0;
    for (NominalSticker& sticker : stickers) {
      for (char& used : sticker.used) used = normalised[next++] <= limit ? 1 : 0;
    }
    if (count_used(stickers) < 3) return "fewer than 3 of its nominal points agree with the measurement";
    if (on_a_line(stickers))
      return "those of its nominal points that agree with the measurement lie on a line";
    if (improve_fit(stickers, fit) < 1e-12) break;
  }
  return "";
}

// Fewer than three of the points were measured: of another body, perhaps.
void refuse_too_few(const Network& network, const AdjustmentResult& adjusted, int body,
                    const std::vector<NominalPoint>& nominal, std::size_t measured, double limit_mm,
                    DatumFrame& frame) {
  const int other = body == kReferenceBody ? kMovingBody : kReferenceBody;
  const auto of_other = std::count_if(nominal.begin(), nominal.end(), [&](const NominalPoint& point) {
    return measured_marker(network, adjusted, other, point.point.id) >= 0;
  });
  frame.reason = fmt::format("only {} of the {} nominal points were measured, wanted at least 3", measured,
                             nominal.size());
  if (of_other >= 3) {
    frame.reason += fmt::format("; {} are on the other grip", of_other);
    frame.instruction = "give each frame the file of its own grip: two may be exchanged";
  } else if (const auto slip = find_slip(network, adjusted, body, nominal, 2 * limit_mm, limit_mm)) {
    // Ids may be so far off that none is left.
    frame.reason += fmt::format("; they are {}", slip->words);
    frame.instruction = slip->instruction;
  }
}

// Sets the reason if the coordinates are beyond reason, or fit far better under a slip.
bool refused_as_slip(const Network& network, const AdjustmentResult& adjusted, int body,
                     const std::vector<NominalPoint>& nominal, const RobustMotion& as_listed, double limit_mm,
                     DatumFrame& frame) {
  double misfit_mm = as_listed.median_mm;
  const bool other_size = std::abs(std::log(as_listed.scale)) > kBeyondPrinter;
  if (other_size) misfit_mm = std::max(misfit_mm, 2 * limit_mm);
  const auto slip = find_slip(network, adjusted, body, nominal, misfit_mm, limit_mm);
  if (slip) {
    frame.reason = fmt::format("its nominal coordinates are {}", slip->words);
    if (!other_size) {
      frame.reason += fmt::format(" (as listed they miss the markers by {:.3g} mm, so by {:.2g} mm)",
                                  as_listed.median_mm, slip->left_mm);
    }
    frame.instruction = slip->instruction;
    return true;
  }
  if (as_listed.median_mm <= limit_mm) return false;
  frame.reason = fmt::format(
      "its nominal coordinates miss the markers by {:.3g} mm (median), and no placement by hand is beyond "
      "{:.2g} mm",
      as_listed.median_mm, limit_mm);
  frame.instruction = "compare ids, corners, axes and unit of the table with the grip";
  return true;
}

// What should be known of a datum that holds.
void remark_nominal(const std::vector<NominalSticker>& stickers, const NominalFit& fit, DatumFrame& frame) {
  bool stated = true;
  std::size_t points = 0;
  for (const NominalSticker& sticker : stickers) {
    for (const NominalPoint& point : sticker.points) stated = stated && point.sigma_mm > 0;
    points += sticker.points.size();
  }
  const double off_mm = std::hypot(fit.placement.shift_mm, fit.point_mm);
  if (off_mm > 0 && stated) {
    frame.notes.push_back(fmt::format(
        "its markers lie {:.2g} mm (1 sigma) off their nominal coordinates, more than the sigma_mm "
        "stated; the poses' sigmas hold it",
        off_mm));
  }
  const std::vector<std::string> left_out = words_of_left_out(stickers, fit);
  frame.notes.insert(frame.notes.end(), left_out.begin(), left_out.end());
  const std::size_t wrong = points - count_used(stickers);
  if (static_cast<double>(wrong) > kFewWrong * static_cast<double>(points)) {
    frame.contradiction = fmt::format("{} of its {} nominal points contradict the others", wrong, points);
  }
}

}  // namespace

int measured_marker(const Network& network, const AdjustmentResult& adjusted, int body, int id) {
  for (std::size_t m = 0; m < network.features.size(); ++m) {
    if (network.features[m].id == id && network.features[m].body == body &&
        adjusted.geometry.has_feature[m]) {
      return static_cast<int>(m);
    }
  }
  return -1;
}

DatumFrame frame_from_nominal(const Network& network, const AdjustmentResult& adjusted, int body,
                              const std::vector<NominalPoint>& nominal, bool with_scale) {
  DatumFrame frame;
  std::vector<NominalSticker> stickers = nominal_stickers(network, adjusted, body, nominal);
  std::vector<double> sigmas;
  Eigen::Matrix3Xd from(3, 0);
  Eigen::Matrix3Xd to(3, 0);
  for (const NominalSticker& sticker : stickers) {
    for (std::size_t i = 0; i < sticker.points.size(); ++i) {
      from.conservativeResize(3, from.cols() + 1);
      to.conservativeResize(3, to.cols() + 1);
      from.rightCols<1>() = sticker.in_body.col(static_cast<Eigen::Index>(i));
      to.rightCols<1>() = sticker.points[i].xyz_mm;
      sigmas.push_back(sticker.points[i].sigma_mm);
    }
  }
  const double limit_mm = std::max(kBeyondHandMm, kOutlierSigmas * median(sigmas));
  if (from.cols() < 3) {
    refuse_too_few(network, adjusted, body, nominal, static_cast<std::size_t>(from.cols()), limit_mm, frame);
    return frame;
  }
  const auto start = robust_motion(from, to, with_scale);
  if (!start) {
    frame.reason = "its nominal points lie on a line";
    return frame;
  }
  if (refused_as_slip(network, adjusted, body, nominal, *start, limit_mm, frame)) return frame;
  NominalFit fit;
  fit.frame_from_body = start->motion;
  fit.scale = start->scale;
  fit.with_scale = with_scale;
  frame.reason = choose_used_points(stickers, fit);
  if (!frame.reason.empty()) return frame;
  if (2 * count_used(stickers) < sigmas.size()) {
    frame.reason = fmt::format("only {} of its {} nominal points agree with each other", count_used(stickers),
                               sigmas.size());
    frame.instruction = "compare ids, corners, axes and unit of the table with the grip";
    return frame;
  }
  fit_placement(stickers, fit);
  std::vector<Eigen::MatrixXd> gains;
  for (int i = 0; i < kIterations && improve_fit(stickers, fit, &gains) > 1e-12; ++i) {
  }
  if (std::abs(std::log(fit.scale)) > kBeyondPrinter) {
    frame.reason = fmt::format(
        "its nominal coordinates are {:.4g} times as large as the markers' size_mm say", fit.scale);
    frame.instruction = "compare size_mm and the table with the grip";
    return frame;
  }
  frame.frame_from_body = fit.frame_from_body;
  frame.scale = fit.scale;
  frame.placement = fit.placement;
  frame.by_error = Eigen::Matrix<double, 7, Eigen::Dynamic>::Zero(7, adjusted.num_errors());
  const Eigen::Matrix3d rotation = fit.scale * fit.frame_from_body.rotation_matrix();
  for (std::size_t s = 0; s < stickers.size(); ++s) {
    const NominalSticker& sticker = stickers[s];
    const Eigen::MatrixXd covariance = nominal_covariance(sticker, fit);
    frame.own += gains[s] * covariance * gains[s].transpose();
    for (std::size_t i = 0; i < sticker.points.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      frame.by_error -= gains[s].middleCols<3>(3 * at) * rotation * sticker.by_error.middleRows<3>(3 * at);
      const Eigen::Matrix3d measured = sticker.covariance.block<3, 3>(3 * at, 3 * at);
      const double sigma2 =
          (covariance.block<3, 3>(3 * at, 3 * at).trace() + fit.scale * fit.scale * measured.trace()) / 3;
      frame.residuals.push_back(
          {sticker.points[i].point,
           fit.frame_from_body * (fit.scale * sticker.in_body.col(at)) - sticker.points[i].xyz_mm,
           std::sqrt(sigma2), sticker.used[i] != 0});
    }
  }
  remark_nominal(stickers, fit, frame);
  frame.ok = true;
  frame.reason.clear();
  return frame;
}

DatumFrame frame_from_first_marker(const Network& network, const AdjustmentResult& adjusted, int body) {
  DatumFrame frame;
  frame.by_error = Eigen::Matrix<double, 7, Eigen::Dynamic>::Zero(7, adjusted.num_errors());
  for (std::size_t m = 0; m < network.features.size(); ++m) {
    if (network.features[m].body != body || !adjusted.geometry.has_feature[m]) continue;
    const Rigid3& body_from_marker = adjusted.geometry.body_from_feature[m];
    frame.frame_from_body = inverse(body_from_marker);
    frame.by_error.topRows<6>() =
        inverse_jacobian(body_from_marker) * adjusted.body_from_feature(static_cast<int>(m)).by_error;
    frame.ok = true;
    frame.reason.clear();
    return frame;
  }
  frame.reason = "none of its markers was measured";
  return frame;
}

}  // namespace hexcal
