#include "photogrammetry/photograph/photograph_format.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

namespace hexcal {
namespace {

struct Ending {
  const char* text;
  PhotographFormat format;
};

constexpr std::array kEndings{
    Ending{"jpg", PhotographFormat::jpeg},      Ending{"jpeg", PhotographFormat::jpeg},
    Ending{"png", PhotographFormat::png},       Ending{"tif", PhotographFormat::tiff},
    Ending{"tiff", PhotographFormat::tiff},     Ending{"bmp", PhotographFormat::bmp},
    Ending{"heic", PhotographFormat::heif},     Ending{"heif", PhotographFormat::heif},
    Ending{"nef", PhotographFormat::nef},       Ending{"dng", PhotographFormat::dng},
    Ending{"cr2", PhotographFormat::other_raw}, Ending{"arw", PhotographFormat::other_raw},
    Ending{"raf", PhotographFormat::other_raw}};

// Pictures as cameras and people save them that no decoder here is for.
constexpr std::array kUnreadEndings{"cr3", "crw", "orf",  "rw2",  "pef", "srw", "nrw", "x3f", "3fr",
                                    "iiq", "gif", "webp", "avif", "jp2", "jxl", "psd", "xcf"};

std::string lower_ending(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  if (!ending.empty()) ending.erase(0, 1);
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

}  // namespace

PhotographFormat photograph_format(const std::filesystem::path& path) {
  const std::string ending = lower_ending(path);
  const auto found = std::find_if(kEndings.begin(), kEndings.end(),
                                  [&](const Ending& known) { return ending == known.text; });
  return found == kEndings.end() ? PhotographFormat::none : found->format;
}

const std::string& photograph_endings() {
  static const std::string endings = [] {
    std::string all;
    for (const Ending& ending : kEndings) all += (all.empty() ? "" : ", ") + std::string(ending.text);
    return all;
  }();
  return endings;
}

std::string unread_format_advice(const std::filesystem::path& path) {
  std::string ending = lower_ending(path);
  if (std::find(kUnreadEndings.begin(), kUnreadEndings.end(), ending) == kUnreadEndings.end()) return {};
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return ending + " is not read: save it as JPEG or 16-bit TIFF";
}

}  // namespace hexcal
