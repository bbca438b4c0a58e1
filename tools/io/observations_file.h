#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "photogrammetry/markers/detect.h"
#include "photogrammetry/photograph/input_file.h"

namespace hexcal {

/// What `hexcal detect` writes and `hexcal measure --observations` takes; with one photograph, also an entry
/// of the cache.
struct DetectionSet {
  std::string family;         ///< name of the marker family
  std::string camera_sha256;  ///< of the camera file whose lens stood in the model; empty without one
  std::vector<PhotographObservations> photographs;
};

/// The set as text: a legend, then one `photograph` record per file, also where nothing was found, each
/// followed by its `marker` records. Numbers are printed so that reading gives back the same bits.
/// `provenance` is the first line(s), comments, may be empty.
[[nodiscard]] std::string observations_text(const DetectionSet& set, std::string_view provenance = {});

/// Reads such a file. Throws InputError naming file, line and what was wanted.
[[nodiscard]] DetectionSet read_observations(const std::filesystem::path& path,
                                             ReadFor purpose = ReadFor::input);
[[nodiscard]] DetectionSet parse_observations(std::string_view text, const std::filesystem::path& path);

}  // namespace hexcal
