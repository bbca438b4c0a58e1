#include "photogrammetry/photograph/photograph_format.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <string>

namespace hexcal {

PhotographFormat photograph_format(const std::filesystem::path& path) {
  static const std::map<std::string, PhotographFormat> kFormats{
      {".jpg", PhotographFormat::jpeg},  {".jpeg", PhotographFormat::jpeg}, {".tif", PhotographFormat::tiff},
      {".tiff", PhotographFormat::tiff}, {".png", PhotographFormat::png},   {".nef", PhotographFormat::nef},
      {".dng", PhotographFormat::dng}};
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto found = kFormats.find(ending);
  return found == kFormats.end() ? PhotographFormat::none : found->second;
}

}  // namespace hexcal
