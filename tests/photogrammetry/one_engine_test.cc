#include <gmock/gmock.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

// One adjustment for everything: what it knows is written down once.

namespace hexcal {
namespace {

namespace fs = std::filesystem;

bool holds(const std::string& text, const std::string& wanted) {
  for (std::size_t at = text.find(wanted); at != std::string::npos; at = text.find(wanted, at + 1)) {
    const bool inside_a_word = at > 0 && std::isalnum(static_cast<unsigned char>(text[at - 1])) != 0;
    if (!inside_a_word) return true;
  }
  return false;
}

// Sources of the program (no tests) that hold one of the words, relative to the project, sorted.
std::vector<std::string> sources_with(const std::vector<std::string>& words) {
  const fs::path root(HEXCAL_SOURCE);
  std::vector<std::string> found;
  for (const char* module :
       {"kinematics", "photogrammetry", "camera_calib", "pose_extract", "calibration", "tools"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / module)) {
      if (entry.path().extension() != ".cc" && entry.path().extension() != ".h") continue;
      std::ifstream in(entry.path());
      const std::string text((std::istreambuf_iterator<char>(in)), {});
      if (std::any_of(words.begin(), words.end(), [&](const auto& word) { return holds(text, word); }))
        found.push_back(fs::relative(entry.path(), root).generic_string());
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::StartsWith;

TEST(OneEngine, AProjectionOfAPointByMotionsIsDerivedOnceInTheEngine) {
  // By the motions of a chain: the camera's own derivative times that of the perspective. The calibration of
  // a camera still has its own.
  EXPECT_THAT(sources_with({"perspective / x.z();", "perspective / p.z();"}),
              ElementsAre("camera_calib/feature_model.cc", "photogrammetry/adjustment/projection.cc"));
}

TEST(OneEngine, OneQuantileOfChiSquared) {
  EXPECT_THAT(sources_with({"double chi2_quantile(", "double chi2_limit("}),
              ElementsAre("kinematics/geometry/chi_squared.cc", "kinematics/geometry/chi_squared.h"));
  EXPECT_THAT(sources_with({"normal_quantile(", "26.2.23"}), IsEmpty());
}

TEST(OneEngine, BodiesAreNumbered) { EXPECT_THAT(sources_with({"Body::"}), IsEmpty()); }

TEST(OneEngine, ColumnsStayInside) {
  EXPECT_THAT(sources_with({"BundleLayout", "adjustment/bundle_"}),
              Each(StartsWith("photogrammetry/adjustment/")));
}

}  // namespace
}  // namespace hexcal
