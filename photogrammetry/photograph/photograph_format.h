#pragma once

#include <filesystem>

namespace hexcal {

/// The formats that are read, by the ending of the file's name in any case.
enum class PhotographFormat { none, jpeg, tiff, png, nef, dng };

[[nodiscard]] PhotographFormat photograph_format(const std::filesystem::path& path);

[[nodiscard]] constexpr bool is_raw(PhotographFormat format) {
  return format == PhotographFormat::nef || format == PhotographFormat::dng;
}

}  // namespace hexcal
