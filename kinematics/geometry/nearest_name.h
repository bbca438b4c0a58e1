#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace hexcal {

/// Insertions, deletions and replacements of a character that make `b` of `a` (Levenshtein 1966).
[[nodiscard]] std::size_t edit_distance(const std::string& a, const std::string& b);

/// The one of `names` that `name` was meant to be: the same but for case, or else at most `most` edits away
/// (no more than a third of its length). Nothing where none or several are as near.
[[nodiscard]] std::optional<std::string> nearest_name(const std::string& name,
                                                      const std::vector<std::string>& names,
                                                      std::size_t most = 2);

}  // namespace hexcal
