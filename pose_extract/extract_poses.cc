#include "pose_extract/extract_poses.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "kinematics/geometry/covariance.h"
#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/nearest_name.h"
#include "photogrammetry/adjustment/marker_map.h"
#include "pose_extract/marker_slips.h"
#include "pose_extract/photograph_screening.h"
#include "pose_extract/pose_verdict.h"

namespace hexcal {
namespace {

int marker_index(const Network& network, int id) {
  for (std::size_t m = 0; m < network.features.size(); ++m) {
    if (network.features[m].id == id) return static_cast<int>(m);
  }
  return -1;
}

Network make_network(const Campaign& campaign, const CampaignObservations& observations,
                     const std::vector<MeasuredPhotograph>& photographs) {
  Network network;
  for (const CalibratedCamera& camera : observations.cameras) {
    network.cameras.push_back({camera.model, camera.covariance});
  }
  for (const auto& [id, size] : campaign.fixed) (void)network.add_square(id, kReferenceBody, size);
  for (const auto& [id, size] : campaign.moving) (void)network.add_square(id, kMovingBody, size);
  std::map<std::string, int> epoch_of;
  for (const std::string& pose : observations.poses) {
    const int next = static_cast<int>(epoch_of.size());
    epoch_of.emplace(pose, next);
  }
  network.num_epochs = static_cast<int>(epoch_of.size());
  for (std::size_t p = 0; p < photographs.size(); ++p) {
    const CampaignPhotograph& photograph = observations.photographs[p];
    NetworkPhoto photo;
    photo.camera = std::max(0, photograph.camera);
    photo.epoch = epoch_of.at(photograph.pose);
    if (is_used(photographs[p].status)) {
      for (const MarkerObservation& seen : photograph.seen.markers)
        photo.observations.push_back(observation_of(seen));
    }
    network.photos.push_back(std::move(photo));
  }
  for (const KnownLength& bar : campaign.bars) {
    network.lengths.push_back({marker_index(network, bar.a.id), bar.a.corner, marker_index(network, bar.b.id),
                               bar.b.corner, bar.length_mm, bar.sigma_mm});
  }
  return network;
}

bool seen_twice(const Network& network, int marker) {
  int times = 0;
  for (const NetworkPhoto& photo : network.photos) {
    times += static_cast<int>(
        std::count_if(photo.observations.begin(), photo.observations.end(), [&](const auto& seen) {
          return seen.id == network.features[static_cast<std::size_t>(marker)].id && seen.measured;
        }));
  }
  return times >= 2;
}

// Without a single measured bar the scale would be open: the markers' sizes have to do, said aloud.
void choose_scale(const Campaign& campaign, CampaignResult& result, AdjustmentOptions& options) {
  // Beside another source they are compared with it.
  if (campaign.scale != ScaleFrom::bars) result.network.lengths.clear();
  std::erase_if(result.network.lengths, [&](const NetworkLength& length) {
    return !seen_twice(result.network, length.feature_a) || !seen_twice(result.network, length.feature_b);
  });
  options.print_scale_free = campaign.scale == ScaleFrom::bars;
  options.print_scale_sigma = campaign.print_scale_sigma;
  if (options.print_scale_free && result.network.lengths.empty()) {
    options.print_scale_free = false;
    result.findings.emplace_back("no scale bar was measured: the scale is that of the markers' sizes");
  }
}

DatumFrame body_frame(const CampaignResult& result, const std::optional<FrameRule>& rule, int body,
                      bool with_scale) {
  if (!rule) return frame_from_first_marker(result.network, result.adjusted, body);
  if (rule->from == FrameRule::From::features) {
    return frame_from_features(result.network, result.adjusted, body, *rule->features);
  }
  if (rule->from == FrameRule::From::markers)
    return frame_from_markers(result.network, result.adjusted, result.home_epoch, rule->markers_from_frame);
  return frame_from_nominal(result.network, result.adjusted, body, rule->nominal, with_scale);
}

// Home and poses spread evenly over those with photographs that count.
std::vector<int> poses_of_map(const CampaignResult& result, int wanted) {
  std::vector<int> with_photographs;
  for (const NetworkPhoto& photo : result.network.photos) {
    if (!photo.observations.empty()) with_photographs.push_back(photo.epoch);
  }
  std::sort(with_photographs.begin(), with_photographs.end());
  with_photographs.erase(std::unique(with_photographs.begin(), with_photographs.end()),
                         with_photographs.end());
  std::vector<int> chosen;
  if (result.home_epoch >= 0) chosen.push_back(result.home_epoch);
  const std::size_t n = with_photographs.size();
  const std::size_t count = std::min(n, static_cast<std::size_t>(wanted));
  for (std::size_t i = 0; i < count; ++i) chosen.push_back(with_photographs[i * n / count]);
  return chosen;
}

Rigid3 scaled_motion(const Rigid3& motion, double scale) {
  return {motion.rotation, scale * motion.translation};
}

// Error of a motion as multiples of the errors it depends on.
struct MotionInfluence {
  Matrix6Xd by_error;
  Vector6d by_scale = Vector6d::Zero();
  Matrix6d by_epoch = Matrix6d::Zero();  // of the epoch's own noise
};

MotionInfluence epoch_influence(const AdjustmentResult& adjusted, std::size_t epoch, double scale) {
  MotionInfluence influence;
  Vector6d lengths = Vector6d::Ones();
  lengths.head<3>() *= scale;
  influence.by_error = lengths.asDiagonal() * adjusted.reference_from_body(static_cast<int>(epoch)).by_error;
  influence.by_epoch = lengths.asDiagonal();
  influence.by_scale.head<3>() =
      scale * adjusted.geometry.reference_from_body[kMovingBody][epoch].translation;
  return influence;
}

// Pose of one epoch and how errors act on it.
struct EpochPose {
  Pose pose;
  CampaignResult::PoseInfluence influence;
};

class PoseChain {
 public:
  PoseChain(const CampaignResult& result, double gd_mm) : result_(result), gd_mm_(gd_mm) {}

  [[nodiscard]] EpochPose at(std::size_t epoch) const {
    const AdjustmentResult& adjusted = result_.adjusted;
    const double scale = result_.UG.scale;
    const Rigid3& u = result_.UG.frame_from_body;
    const Rigid3 t = scaled_motion(adjusted.geometry.reference_from_body[kMovingBody][epoch], scale);
    const MotionInfluence ti = epoch_influence(adjusted, epoch, scale);
    const Rigid3 x = u * t;
    const Matrix6d xu = product_jacobian_left(u, t);
    const Matrix6d xt = product_jacobian_right(u, t);

    EpochPose out;
    CampaignResult::PoseInfluence& influence = out.influence;
    // UG_from_moving: by the datum (with its scale), the epoch's own noise and the errors of the adjustment.
    influence.by_ug << xu, xt * ti.by_scale;
    influence.by_own = xt * ti.by_epoch;
    influence.by_error = xt * ti.by_error;
    Rigid3 moving_from_LG;
    Matrix6d zl;
    if (result_.home_epoch >= 0) {
      const auto home = static_cast<std::size_t>(result_.home_epoch);
      const Rigid3 th = scaled_motion(adjusted.geometry.reference_from_body[kMovingBody][home], scale);
      const MotionInfluence hi = epoch_influence(adjusted, home, scale);
      const Rigid3 y = u * th;
      const Rigid3 down = Rigid3::from_translation({0, 0, -gd_mm_});
      moving_from_LG = inverse(y) * down;
      zl = product_jacobian_right(x, moving_from_LG) * product_jacobian_left(inverse(y), down) *
           inverse_jacobian(y);
      const Matrix6d yt = product_jacobian_right(u, th);
      const Matrix6d zx = product_jacobian_left(x, moving_from_LG);
      Eigen::Matrix<double, 6, 7> y_by_ug;
      y_by_ug << product_jacobian_left(u, th), yt * hi.by_scale;
      influence.by_ug = zx * influence.by_ug + zl * y_by_ug;
      influence.by_own = zx * influence.by_own;
      influence.by_home = zl * yt * hi.by_epoch;
      influence.by_error = zx * influence.by_error + zl * (yt * hi.by_error);
    } else {
      const Rigid3& m = result_.LG.frame_from_body;
      moving_from_LG = inverse(m);
      zl = product_jacobian_right(x, moving_from_LG) * inverse_jacobian(m);
      const Matrix6d zx = product_jacobian_left(x, moving_from_LG);
      influence.by_ug = zx * influence.by_ug;
      influence.by_own = zx * influence.by_own;
      influence.by_error = zx * influence.by_error + zl * result_.LG.by_error.topRows<6>();
      influence.by_lg.leftCols<6>() = zl;
    }
    out.pose = pose_from_ug_from_lg(x * moving_from_LG, gd_mm_);
    const Matrix6d parameters = pose_parameters_jacobian(out.pose);
    influence.by_ug = parameters * influence.by_ug;
    influence.by_lg = parameters * influence.by_lg;
    influence.by_own = parameters * influence.by_own;
    influence.by_home = parameters * influence.by_home;
    // The datum's own error also follows the errors of the adjustment.
    influence.by_error = parameters * influence.by_error + influence.by_ug * result_.UG.by_error;
    return out;
  }

 private:
  const CampaignResult& result_;
  double gd_mm_;
};

MeasuredLength measure_length(const CampaignResult& result, const KnownLength& known) {
  MeasuredLength length{known, false, 0, 0};
  const int a = marker_index(result.network, known.a.id);
  const int b = marker_index(result.network, known.b.id);
  const auto& has = result.adjusted.geometry.has_feature;
  if (a < 0 || b < 0 || !has[static_cast<std::size_t>(a)] || !has[static_cast<std::size_t>(b)]) return length;
  const EstimatedPoint at_a = result.adjusted.point(a, known.a.corner);
  const EstimatedPoint at_b = result.adjusted.point(b, known.b.corner);
  const Eigen::Vector3d d = at_b.in_body - at_a.in_body;
  length.measured = true;
  length.length_mm = result.UG.scale * d.norm();
  length.sigma_mm = result.UG.scale * (d.normalized().transpose() * (at_b.by_error - at_a.by_error)).norm();
  return length;
}

void measure_points(CampaignResult& result) {
  const AdjustmentResult& adjusted = result.adjusted;
  for (std::size_t m = 0; m < result.network.features.size(); ++m) {
    const NetworkFeature& marker = result.network.features[m];
    const DatumFrame& datum = marker.body == kReferenceBody ? result.UG : result.LG;
    if (!adjusted.geometry.has_feature[m] || !datum.ok) continue;
    const Eigen::Matrix3d rotation = datum.frame_from_body.rotation_matrix();
    for (int c = 0; c < 4; ++c) {
      const EstimatedPoint point = adjusted.point(static_cast<int>(m), c);
      const Eigen::Vector3d turned = rotation * (result.UG.scale * point.in_body);
      Eigen::Matrix<double, 3, 7> by_datum;
      by_datum << Eigen::Matrix3d::Identity(), -skew(turned), turned;
      const Eigen::Matrix3Xd total = result.UG.scale * rotation * point.by_error + by_datum * datum.by_error;
      result.points.push_back({{marker.id, c},
                               marker.body,
                               turned + datum.frame_from_body.translation,
                               total * total.transpose() + by_datum * datum.own * by_datum.transpose()});
    }
  }
}

// Camera stations in UG with their covariance.
void measure_stations(CampaignResult& result) {
  const AdjustmentResult& adjusted = result.adjusted;
  const DatumFrame& ug = result.UG;
  for (std::size_t p = 0; p < result.photographs.size(); ++p) {
    MeasuredPhotograph& photograph = result.photographs[p];
    if (!adjusted.geometry.has_photo[p] || !ug.ok) continue;
    const Rigid3 fixed_from_camera =
        inverse(scaled_motion(adjusted.geometry.camera_from_reference[p], ug.scale));
    photograph.UG_from_camera = ug.frame_from_body * fixed_from_camera;
    const Matrix6d camera = adjusted.camera_from_reference(static_cast<int>(p)).covariance();
    const Matrix6d j = product_jacobian_right(ug.frame_from_body, fixed_from_camera) *
                       inverse_jacobian(scaled_motion(adjusted.geometry.camera_from_reference[p], ug.scale));
    const Matrix6d left = product_jacobian_left(ug.frame_from_body, fixed_from_camera);
    photograph.covariance =
        j * camera * j.transpose() + left * ug.own.topLeftCorner<6, 6>() * left.transpose();
  }
}

}  // namespace

void ExtractOptions::validate() const {
  adjustment.validate();
  if (!(max_sigma_mm > 0)) {
    throw InputError(fmt::format("option max_sigma_mm: found {}, wanted more than 0", max_sigma_mm));
  }
  if (map_poses < 0 || map_poses == 1) {
    throw InputError(fmt::format("option map_poses: found {}, wanted 2 or more, or 0", map_poses));
  }
  if (!(min_intersection_deg >= 0)) {
    throw InputError(
        fmt::format("option min_intersection_deg: found {}, wanted 0 or more", min_intersection_deg));
  }
}

Matrix6d CampaignResult::own_covariance(std::size_t epoch) const {
  const Matrix6d noise = adjusted.reference_from_body(static_cast<int>(epoch)).own;
  return epoch < consistency.epochs.size() ? noise + consistency.epochs[epoch].excess : noise;
}

Matrix6d CampaignResult::pose_covariance(std::size_t a, std::size_t b) const {
  if (!poses[a].pose || !poses[b].pose) return Matrix6d::Zero();
  const PoseInfluence& ia = influences[a];
  const PoseInfluence& ib = influences[b];
  Matrix6d covariance = ia.by_error * ib.by_error.transpose() + ia.by_ug * UG.own * ib.by_ug.transpose() +
                        ia.by_lg * LG.own * ib.by_lg.transpose();
  if (home_epoch >= 0) {
    covariance += ia.by_home * own_covariance(static_cast<std::size_t>(home_epoch)) * ib.by_home.transpose();
  }
  if (a == b) {
    covariance += ia.by_own * own_covariance(a) * ib.by_own.transpose();
  }
  return covariance;
}

std::string find_home(const Campaign& campaign, const std::vector<std::string>& poses) {
  const std::string& wanted = campaign.lg->home_pose;
  if (std::ranges::find(poses, wanted) != poses.end()) return wanted;
  if (const auto meant = nearest_name(wanted, poses, 1)) return *meant;
  throw InputError(
      fmt::format("{}: frames.LG.pose: found '{}', which is none of the poses: {}; photograph the home as "
                  "'{}', or let another "
                  "pose be the home: --home POSE",
                  campaign.file.string(), wanted, fmt::join(poses, ", "), wanted));
}

CampaignResult extract_poses(const Campaign& campaign, const CampaignObservations& observations,
                             const ExtractOptions& options) {
  options.validate();
  CampaignResult result;
  const bool from_home = campaign.lg && campaign.lg->from == FrameRule::From::home;
  if (from_home) {
    const std::string home = find_home(campaign, observations.poses);
    if (home != campaign.lg->home_pose) {
      result.findings.emplace_back(fmt::format("frames.LG.pose: '{}' is none of the poses; '{}' was taken",
                                               campaign.lg->home_pose, home),
                                   fmt::format("write it as {} in campaign.yaml", home));
    }
    result.home_epoch =
        static_cast<int>(std::ranges::find(observations.poses, home) - observations.poses.begin());
  }
  result.has_moving = !campaign.moving.empty();
  if (campaign.lg) result.gd_mm = campaign.lg->gd_mm;
  result.photographs = screen_photographs(campaign, observations);
  result.network = make_network(campaign, observations, result.photographs);
  ExtractOptions chosen = options;
  choose_scale(campaign, result, chosen.adjustment);
  const auto adjust = [&] {
    return options.map_poses > 0 && options.map_poses < result.network.num_epochs
               ? adjust_network_by_map(result.network, poses_of_map(result, options.map_poses),
                                       chosen.adjustment)
               : adjust_network(result.network, chosen.adjustment);
  };
  result.order = photographing_order(observations);
  result.adjusted = adjust();
  result.slips = leave_out_slipped_markers(result.order, adjust, result.network, result.adjusted);
  if (chosen.adjustment.print_scale_free && !result.adjusted.print_scale()) {
    result.findings.emplace_back(
        "no scale bar could be used, for the markers at their ends are not in the network: the scale is that "
        "of the "
        "markers' sizes");
  }
  result.poses.resize(observations.poses.size());
  result.influences.resize(observations.poses.size());
  for (std::size_t e = 0; e < result.poses.size(); ++e) result.poses[e].id = observations.poses[e];
  judge_photographs(observations, result);
  if (result.adjusted.status == AdjustmentStatus::nothing_connected) {
    result.findings.push_back(result.adjusted.reason);
    judge_poses(observations, options, result);
    return result;
  }
  if (result.adjusted.status != AdjustmentStatus::ok) result.findings.push_back(result.adjusted.reason);

  if (result.has_moving) result.consistency = pose_consistency(result.network, result.adjusted);

  const bool nominal_scale = campaign.scale == ScaleFrom::nominal;
  const bool by_ug = nominal_scale && campaign.ug && campaign.ug->from == FrameRule::From::nominal;
  result.UG = body_frame(result, campaign.ug, kReferenceBody, by_ug);
  if (!campaign.moving.empty() && !from_home) {
    result.LG = body_frame(result, campaign.lg, kMovingBody, nominal_scale && !by_ug);
    if (nominal_scale && !by_ug) {
      // The moving body's scale holds for both; its noise is small beside the datum's and stays with LG.
      result.UG.scale = result.LG.scale;
    }
  }
  if (from_home && result.UG.ok) {
    const auto home = static_cast<std::size_t>(result.home_epoch);
    if (result.adjusted.geometry.has_pose[kMovingBody][home]) {
      const Rigid3 y =
          result.UG.frame_from_body *
          scaled_motion(result.adjusted.geometry.reference_from_body[kMovingBody][home], result.UG.scale);
      result.LG.ok = true;
      result.LG.reason.clear();
      result.LG.frame_from_body = Rigid3::from_translation({0, 0, campaign.lg->gd_mm}) * y;
      result.LG.by_error = Eigen::Matrix<double, 7, Eigen::Dynamic>::Zero(7, result.adjusted.num_errors());
    } else {
      result.LG.reason = fmt::format("the home pose '{}' was not measured", observations.poses[home]);
      result.LG.instruction = "photograph it again, or let another pose be the home: --home POSE";
    }
  }
  if (result.UG.ok && result.LG.ok) {
    const PoseChain chain(result, campaign.lg->gd_mm);
    for (std::size_t e = 0; e < result.poses.size(); ++e) {
      if (!result.adjusted.geometry.has_pose[kMovingBody][e]) continue;
      EpochPose found = chain.at(e);
      if (static_cast<int>(e) == result.home_epoch) {
        // Zero by definition and depends on nothing; what is left is rounding.
        found.pose = Pose();
        found.influence = {};
        found.influence.by_error = Matrix6Xd::Zero(6, result.adjusted.num_errors());
      }
      result.poses[e].pose = found.pose;
      result.influences[e] = std::move(found.influence);
    }
    for (std::size_t e = 0; e < result.poses.size(); ++e)
      result.poses[e].covariance = result.pose_covariance(e, e);
  }
  for (const KnownLength& bar : campaign.bars) result.bars.push_back(measure_length(result, bar));
  for (const KnownLength& check : campaign.checks) result.checks.push_back(measure_length(result, check));
  measure_points(result);
  measure_stations(result);
  judge_poses(observations, options, result);
  judge_campaign(campaign, result);
  return result;
}

}  // namespace hexcal
