#pragma once

#include <string_view>

namespace hexcal {

/// What the build puts into the program for pages: this folder's style sheet and scripts, and three.js of the
/// system with its licence.
enum class Resource { style, script, scene_script, three, three_licence };

[[nodiscard]] std::string_view resource(Resource which);

}  // namespace hexcal
