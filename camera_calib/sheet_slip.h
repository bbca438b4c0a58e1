#pragma once

#include <optional>
#include <string>
#include <vector>

#include "camera_calib/sheet.h"
#include "camera_calib/sheet_observation.h"

namespace hexcal {

/// What is wrong with a sheet's description, where the photographs' markers tell it: columns and rows
/// exchanged, off by one or those of quite another sheet, first_id off, the other colour at a ChArUco's top
/// left, markers that stand turned in their places. Markers are counted that lie beside one another as a
/// description says (SheetImage), for the one that was given and for each that is a usual slip away from it;
/// a slip is named where clearly more markers follow it. One sentence with the number that was found and the
/// one to write; none where the given description holds or no slip explains the photographs. `sheets`: all of
/// the template, `index`: the one that is judged.
[[nodiscard]] std::optional<std::string> sheet_slip(const std::vector<Sheet>& sheets, std::size_t index,
                                                    const std::vector<SheetPhotograph>& photographs);

}  // namespace hexcal
