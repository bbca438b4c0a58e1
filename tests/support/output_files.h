#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <set>
#include <string>

#include "tests/support/run_hexcal.h"

namespace hexcal {

/// No number in the files of a folder that are made for programs (tables, JSON, YAML, point clouds) is NaN or
/// infinite; returns how many files were looked at.
inline int expect_finite_numbers(const std::filesystem::path& folder) {
  static const std::set<std::string> kinds{".csv", ".json", ".yaml", ".txt", ".ply", ".pcd", ".ngc", ".hal"};
  static const std::set<std::string> words{"nan", "inf", "infinity"};
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file() || kinds.count(entry.path().extension().string()) == 0) continue;
    ++files;
    const std::string text = contents(entry.path());
    std::string word;
    for (const char c : text + ' ') {
      if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_') {
        word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        continue;
      }
      EXPECT_EQ(words.count(word), 0u) << entry.path() << " says " << word;
      word.clear();
    }
  }
  return files;
}

}  // namespace hexcal
