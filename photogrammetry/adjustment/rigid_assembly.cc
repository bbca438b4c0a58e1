#include "photogrammetry/adjustment/rigid_assembly.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "kinematics/geometry/covariance.h"

namespace hexcal {
namespace {

// A sighting supports a pose when its corners lie within a few times this of where the pose puts them. Wide
// enough for poses extrapolated from one marker, narrow against a flipped one.
constexpr double kToleranceOfSide = 0.02;
constexpr double kTolerancePx = 0.5;
constexpr double kSupport = 0.5;  // largest mean misfit (0 to 1) of a frame that is accepted
constexpr int kAssemblyRefinements = 6;
constexpr std::size_t kMaxCandidates = 8;
constexpr std::size_t kNumSeeds = 6;
constexpr int kTrialFrames = 8;  // frames up to which a seed is tried

double squared_tolerance(const Sighting& sighting) {
  const double tolerance = kToleranceOfSide * sighting.side_px + kTolerancePx;
  return tolerance * tolerance;
}

// Misfit of an edge under a pose, between 0 (fits) and 1 per view.
double misfit(const AssemblyEdge& edge, const Rigid3& frame_from_marker) {
  const Rigid3 marker;
  double sum = 0;
  for (const AssemblyView& view : edge.views) {
    const Rigid3 camera_from_marker = view.camera_from_frame * frame_from_marker;
    Vector8d px;
    if (!project_drawn({*view.camera, camera_from_marker, nullptr, marker}, *edge.feature, px, nullptr)) {
      sum += 1;
      continue;
    }
    const double d2 = (px - view.sighting->px).squaredNorm() / view.sighting->points;
    sum += d2 / (d2 + squared_tolerance(*view.sighting));
  }
  return sum / static_cast<double>(edge.views.size());
}

struct Piece {
  const AssemblyEdge* edge;
  Rigid3 other;  // body_from_marker when frames are refined, frame_from_body when markers are
};

// Refines frame_from_body (markers known) or body_from_marker (frames known) on all pieces, robustly.
void refine(const std::vector<Piece>& pieces, bool frame_unknown, Rigid3& pose) {
  for (int i = 0; i < kAssemblyRefinements; ++i) {
    Matrix6d normal = Matrix6d::Zero();
    Vector6d right = Vector6d::Zero();
    for (const Piece& piece : pieces) {
      for (const AssemblyView& view : piece.edge->views) {
        // camera <- frame <- body <- marker: the unknown stands in the middle or at the end of the chain.
        const Rigid3& frame_from_body = frame_unknown ? pose : piece.other;
        const Rigid3& body_from_marker = frame_unknown ? piece.other : pose;
        Vector8d px;
        FeatureJacobian jacobian;
        jacobian.with_shape = false;
        if (!project_drawn({*view.camera, view.camera_from_frame, &frame_from_body, body_from_marker},
                           *piece.edge->feature, px, &jacobian)) {
          continue;
        }
        const Matrix86d& j = frame_unknown ? jacobian.pose : jacobian.feature;
        const Vector8d r = view.sighting->px - px;
        const double t2 = squared_tolerance(*view.sighting);
        const double weight = std::pow(t2 / (t2 + r.squaredNorm() / view.sighting->points), 2);
        normal += weight * j.transpose() * j;
        right += weight * j.transpose() * r;
      }
    }
    const Vector6d step = normal.ldlt().solve(right);
    if (!step.allFinite()) return;
    pose = perturbed(pose, step);
    if (step.norm() < 1e-7) return;
  }
}

class Builder {
 public:
  Builder(const std::vector<AssemblyEdge>& edges, int num_frames, int num_markers)
      : edges_(edges),
        of_frame_(static_cast<std::size_t>(num_frames)),
        of_marker_(static_cast<std::size_t>(num_markers)),
        known_in_frame_(static_cast<std::size_t>(num_frames), 0),
        given_up_(static_cast<std::size_t>(num_frames), 0),
        marker_views_(static_cast<std::size_t>(num_markers), 0) {
    result_.frame_from_body.resize(of_frame_.size());
    result_.has_frame.assign(of_frame_.size(), 0);
    result_.body_from_marker.resize(of_marker_.size());
    result_.has_marker.assign(of_marker_.size(), 0);
    for (const AssemblyEdge& edge : edges_) {
      of_frame_[static_cast<std::size_t>(edge.frame)].push_back(&edge);
      of_marker_[static_cast<std::size_t>(edge.marker)].push_back(&edge);
    }
  }

  // Starts with one sighting and one of its poses and grows; returns how well it went.
  double grow(const AssemblyEdge& seed, const Rigid3& frame_from_marker, int max_frames) {
    const auto f = static_cast<std::size_t>(seed.frame);
    set_marker(static_cast<std::size_t>(seed.marker), Rigid3());
    result_.frame_from_body[f] = frame_from_marker;
    result_.has_frame[f] = 1;
    refine_seed(seed);
    int frames = 1;
    place_markers(f);
    // Frames that did not fit while few views had placed the markers get a second chance.
    for (int pass = 0; pass < 2 && frames < max_frames; ++pass) {
      if (pass > 0) {
        if (std::find(given_up_.begin(), given_up_.end(), 1) == given_up_.end()) break;
        std::fill(given_up_.begin(), given_up_.end(), 0);
        for (std::size_t m = 0; m < of_marker_.size(); ++m) {
          if (result_.has_marker[m]) place_marker(m);
        }
      }
      frames = join_frames(frames, max_frames);
    }
    double total = 0;
    double count = 0;
    for (const AssemblyEdge& edge : edges_) {
      const auto e = static_cast<std::size_t>(edge.frame);
      const auto m = static_cast<std::size_t>(edge.marker);
      if (!result_.has_frame[e] || !result_.has_marker[m]) continue;
      total += misfit(edge, result_.frame_from_body[e] * result_.body_from_marker[m]);
      count += 1;
    }
    return count - 2 * total;  // sightings that fit count for, those that do not against
  }

  [[nodiscard]] const Assembly& result() const { return result_; }

 private:
  void set_marker(std::size_t m, const Rigid3& body_from_marker) {
    result_.body_from_marker[m] = body_from_marker;
    if (result_.has_marker[m]) return;
    result_.has_marker[m] = 1;
    for (const AssemblyEdge* edge : of_marker_[m]) ++known_in_frame_[static_cast<std::size_t>(edge->frame)];
  }

  // Joins the best connected frames one by one; returns how many are in.
  int join_frames(int frames, int max_frames) {
    while (frames < max_frames) {
      const int next = best_connected();
      if (next < 0) break;
      const auto n = static_cast<std::size_t>(next);
      Rigid3 pose;
      std::vector<const AssemblyEdge*> known;
      for (const AssemblyEdge* edge : of_frame_[n]) {
        if (result_.has_marker[static_cast<std::size_t>(edge->marker)]) known.push_back(edge);
      }
      if (!orient_frame(known, result_.body_from_marker, pose)) {
        given_up_[n] = 1;
        continue;
      }
      result_.frame_from_body[n] = pose;
      result_.has_frame[n] = 1;
      ++frames;
      place_markers(n);
    }
    return frames;
  }

  // The seed's pose from one view, made better by the others of its frame.
  void refine_seed(const AssemblyEdge& seed) {
    if (seed.views.size() > 1) {
      refine({{&seed, Rigid3()}}, true, result_.frame_from_body[static_cast<std::size_t>(seed.frame)]);
    }
  }

  // The frame not yet oriented with the most known markers; -1 if none has any.
  [[nodiscard]] int best_connected() const {
    int best = -1;
    int most = 0;
    for (std::size_t f = 0; f < known_in_frame_.size(); ++f) {
      if (result_.has_frame[f] || given_up_[f] || known_in_frame_[f] <= most) continue;
      most = known_in_frame_[f];
      best = static_cast<int>(f);
    }
    return best;
  }

  // Places the markers of a frame just oriented. A marker is placed anew, from all its candidates, each time
  // the number of frames that see it has doubled: so its two planar solutions are carried until the views
  // decide.
  void place_markers(std::size_t frame) {
    for (const AssemblyEdge* seen : of_frame_[frame]) {
      const auto m = static_cast<std::size_t>(seen->marker);
      const int views = ++marker_views_[m];
      if ((views & (views - 1)) != 0) continue;
      place_marker(m);
    }
  }

  // From all its candidates in the frames so far, then refined on them.
  void place_marker(std::size_t m) {
    std::vector<Piece> pieces;
    for (const AssemblyEdge* edge : of_marker_[m]) {
      const auto f = static_cast<std::size_t>(edge->frame);
      if (result_.has_frame[f]) pieces.push_back({edge, result_.frame_from_body[f]});
    }
    Rigid3 best = result_.body_from_marker[m];
    double least = std::numeric_limits<double>::infinity();
    const auto try_pose = [&](const Rigid3& body_from_marker) {
      double sum = 0;
      for (const Piece& piece : pieces) sum += misfit(*piece.edge, piece.other * body_from_marker);
      if (sum < least) {
        least = sum;
        best = body_from_marker;
      }
    };
    std::size_t tried = 0;
    for (const Piece& piece : pieces) {
      for (const Rigid3& candidate : piece.edge->candidates) {
        if (tried++ < 2 * kMaxCandidates) try_pose(inverse(piece.other) * candidate);
      }
    }
    if (result_.has_marker[m]) try_pose(Rigid3(result_.body_from_marker[m]));
    if (pieces.size() > 1 || pieces.front().edge->views.size() > 1) refine(pieces, false, best);
    set_marker(m, best);
  }

  const std::vector<AssemblyEdge>& edges_;
  std::vector<std::vector<const AssemblyEdge*>> of_frame_, of_marker_;
  std::vector<int> known_in_frame_;
  std::vector<char> given_up_;
  std::vector<int> marker_views_;
  Assembly result_;
};

// Frames reachable over shared markers, per frame the number of its set's root.
std::vector<int> connected_sets(const std::vector<AssemblyEdge>& edges, int num_frames, int num_markers) {
  std::vector<int> parent(static_cast<std::size_t>(num_frames + num_markers));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int i) {
    while (parent[static_cast<std::size_t>(i)] != i) {
      auto& up = parent[static_cast<std::size_t>(i)];
      up = parent[static_cast<std::size_t>(up)];
      i = up;
    }
    return i;
  };
  for (const AssemblyEdge& edge : edges) {
    parent[static_cast<std::size_t>(root(edge.frame))] = root(num_frames + edge.marker);
  }
  std::vector<int> set(static_cast<std::size_t>(num_frames));
  for (int f = 0; f < num_frames; ++f) set[static_cast<std::size_t>(f)] = root(f);
  return set;
}

}  // namespace

bool orient_frame(const std::vector<const AssemblyEdge*>& edges, const std::vector<Rigid3>& body_from_marker,
                  Rigid3& frame_from_body) {
  std::vector<const AssemblyEdge*> largest = edges;
  std::stable_sort(largest.begin(), largest.end(), [](const AssemblyEdge* a, const AssemblyEdge* b) {
    return a->views.front().sighting->side_px > b->views.front().sighting->side_px;
  });
  std::vector<Piece> pieces;
  for (const AssemblyEdge* edge : edges) {
    pieces.push_back({edge, body_from_marker[static_cast<std::size_t>(edge->marker)]});
  }
  const auto mean_misfit = [&](const Rigid3& pose) {
    double sum = 0;
    for (const Piece& piece : pieces) sum += misfit(*piece.edge, pose * piece.other);
    return sum / static_cast<double>(pieces.size());
  };
  double least = std::numeric_limits<double>::infinity();
  std::size_t tried = 0;
  for (const AssemblyEdge* edge : largest) {
    const Rigid3 marker_from_body = inverse(body_from_marker[static_cast<std::size_t>(edge->marker)]);
    for (const Rigid3& candidate : edge->candidates) {
      if (tried++ >= kMaxCandidates) break;
      Rigid3 pose = candidate * marker_from_body;
      refine(pieces, true, pose);
      const double value = mean_misfit(pose);
      if (value < least) {
        least = value;
        frame_from_body = pose;
      }
    }
  }
  return least < kSupport;
}

Assembly orient_frames(const std::vector<AssemblyEdge>& edges, int num_frames,
                       const std::vector<Rigid3>& body_from_marker, const std::vector<char>& has_marker) {
  const auto frames = static_cast<std::size_t>(num_frames);
  Assembly body{std::vector<Rigid3>(frames), body_from_marker, std::vector<char>(frames, 0), has_marker};
  std::vector<std::vector<const AssemblyEdge*>> of_frame(frames);
  for (const AssemblyEdge& edge : edges) {
    if (edge.candidates.empty() || !has_marker[static_cast<std::size_t>(edge.marker)]) continue;
    of_frame[static_cast<std::size_t>(edge.frame)].push_back(&edge);
  }
  for (std::size_t f = 0; f < frames; ++f) {
    if (of_frame[f].empty()) continue;
    body.has_frame[f] = orient_frame(of_frame[f], body_from_marker, body.frame_from_body[f]);
  }
  return body;
}

Assembly assemble_body(std::vector<AssemblyEdge> edges, int num_frames, int num_markers) {
  Assembly best;
  best.frame_from_body.resize(static_cast<std::size_t>(num_frames));
  best.has_frame.assign(static_cast<std::size_t>(num_frames), 0);
  best.body_from_marker.resize(static_cast<std::size_t>(num_markers));
  best.has_marker.assign(static_cast<std::size_t>(num_markers), 0);
  std::erase_if(edges, [](const AssemblyEdge& edge) { return edge.candidates.empty(); });
  if (edges.empty()) return best;

  const std::vector<int> set = connected_sets(edges, num_frames, num_markers);
  std::vector<int> size(static_cast<std::size_t>(num_frames + num_markers), 0);
  for (const AssemblyEdge& edge : edges)
    ++size[static_cast<std::size_t>(set[static_cast<std::size_t>(edge.frame)])];
  const auto largest = static_cast<int>(std::max_element(size.begin(), size.end()) - size.begin());

  // Start where one marker looks largest, and where its two solutions differ most.
  std::vector<const AssemblyEdge*> seeds;
  for (const AssemblyEdge& edge : edges) {
    if (set[static_cast<std::size_t>(edge.frame)] == largest) seeds.push_back(&edge);
  }
  std::stable_sort(seeds.begin(), seeds.end(), [](const AssemblyEdge* a, const AssemblyEdge* b) {
    if (a->views.size() != b->views.size()) return a->views.size() > b->views.size();
    return a->views.front().sighting->side_px > b->views.front().sighting->side_px;
  });
  // One seed per marker, so that a disturbed marker does not decide alone.
  std::vector<char> taken(static_cast<std::size_t>(num_markers), 0);
  std::erase_if(seeds, [&](const AssemblyEdge* edge) {
    const bool again = taken[static_cast<std::size_t>(edge->marker)] != 0;
    taken[static_cast<std::size_t>(edge->marker)] = 1;
    return again;
  });
  if (seeds.size() > kNumSeeds) seeds.resize(kNumSeeds);

  double best_score = -std::numeric_limits<double>::infinity();
  const AssemblyEdge* best_seed = nullptr;
  Rigid3 best_pose;
  for (const AssemblyEdge* seed : seeds) {
    for (const Rigid3& candidate : seed->candidates) {
      Builder trial(edges, num_frames, num_markers);
      const double score = trial.grow(*seed, candidate, kTrialFrames);
      if (score > best_score) {
        best_score = score;
        best_seed = seed;
        best_pose = candidate;
      }
    }
  }
  Builder builder(edges, num_frames, num_markers);
  (void)builder.grow(*best_seed, best_pose, num_frames);
  return builder.result();
}

}  // namespace hexcal
