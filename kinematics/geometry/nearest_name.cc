#include "kinematics/geometry/nearest_name.h"

#include <algorithm>
#include <cctype>

namespace hexcal {
namespace {

std::string in_lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t up = row[j];
      row[j] = std::min({up + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = up;
    }
  }
  return row[b.size()];
}

std::optional<std::string> nearest_name(const std::string& name, const std::vector<std::string>& names,
                                        std::size_t most) {
  const std::string wanted = in_lower_case(name);
  most = std::min(most, name.size() / 3);
  std::optional<std::string> nearest;
  std::size_t least = most + 1;
  for (const std::string& candidate : names) {
    const std::size_t distance = edit_distance(wanted, in_lower_case(candidate));
    if (distance > most) continue;
    if (distance < least) {
      nearest = candidate;
      least = distance;
    } else if (distance == least) {
      nearest.reset();
    }
  }
  return nearest;
}

}  // namespace hexcal
