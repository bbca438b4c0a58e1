#pragma once

#include <vector>

#include "photogrammetry/adjustment/planar_pose.h"
#include "photogrammetry/adjustment/projection.h"

namespace hexcal {

/// A look at a marker from a known place in an assembly's frame.
struct AssemblyView {
  const Sighting* sighting = nullptr;
  const CameraModel* camera = nullptr;
  Rigid3 camera_from_frame;
};

/// One marker (a feature of several points) seen in one frame; a frame is a photograph, or an epoch whose
/// photographs are oriented.
struct AssemblyEdge {
  int frame = 0;
  int marker = 0;
  const NetworkFeature* feature = nullptr;
  std::vector<AssemblyView> views;
  std::vector<Rigid3> candidates;  ///< frame_from_marker, both planar solutions of each view
};

struct Assembly {
  std::vector<Rigid3> frame_from_body;
  std::vector<Rigid3> body_from_marker;
  std::vector<char> has_frame, has_marker;
};

/// Joins frames and markers of one rigid body that share edges. The body's frame is that of the marker it
/// starts with; of several sets without connection the largest is taken.
[[nodiscard]] Assembly assemble_body(std::vector<AssemblyEdge> edges, int num_frames, int num_markers);

/// Frames of a body whose markers are known already; those without a known marker stay open.
[[nodiscard]] Assembly orient_frames(const std::vector<AssemblyEdge>& edges, int num_frames,
                                     const std::vector<Rigid3>& body_from_marker,
                                     const std::vector<char>& has_marker);

/// Pose of one more frame of a body whose markers are known; false if none of the candidates fits.
bool orient_frame(const std::vector<const AssemblyEdge*>& edges, const std::vector<Rigid3>& body_from_marker,
                  Rigid3& frame_from_body);

}  // namespace hexcal
