#include "photogrammetry/markers/printed_pattern.h"

#include <algorithm>
#include <map>
#include <mutex>

namespace hexcal {
namespace {

// By the outermost ring of cells in which any pattern is black.
double share_of(const MarkerFamily& family) {
  const MarkerPattern& first = family.patterns.front();
  const int cells = first.cells;
  int outermost = cells / 2;
  for (const MarkerPattern& pattern : family.patterns) {
    for (int y = 0; y < cells; ++y) {
      for (int x = 0; x < cells; ++x) {
        if (pattern.white[static_cast<std::size_t>(y * cells + x)] != 0) continue;
        outermost = std::min({outermost, x, y, cells - 1 - x, cells - 1 - y});
      }
    }
    if (outermost == 0) break;
  }
  return std::max(1.0, (cells - 2 * outermost) / first.square_cells);
}

}  // namespace

double printed_share(const MarkerFamily& family) {
  static std::mutex mutex;
  static std::map<std::string, double> shares;  // families have up to 60 000 patterns
  const std::lock_guard<std::mutex> lock(mutex);
  const auto known = shares.find(family.name);
  return known != shares.end() ? known->second : shares.emplace(family.name, share_of(family)).first->second;
}

bool same_when_turned(const MarkerPattern& pattern) {
  const int last = pattern.cells - 1;
  bool half = true;
  bool quarter = true;
  for (int y = 0; y <= last; ++y) {
    for (int x = 0; x <= last; ++x) {
      const auto at = [&](int column, int row) {
        return pattern.white[static_cast<std::size_t>(row * pattern.cells + column)];
      };
      half = half && at(x, y) == at(last - x, last - y);
      quarter = quarter && at(x, y) == at(last - y, x);
    }
  }
  return half || quarter;
}

}  // namespace hexcal
