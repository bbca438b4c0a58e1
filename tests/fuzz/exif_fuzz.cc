#include <cmath>
#include <cstdint>

#include "photogrammetry/photograph/decoders.h"
#include "tests/fuzz/fuzz_input.h"

// What stands beside the pixels of a file, through Exiv2. Whatever the file is, there is an answer.

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hexcal::fuzzing;
  const hexcal::PhotographInfo info = hexcal::read_exif({reinterpret_cast<const char*>(data), size});
  promise(info.width_px >= 0 && info.height_px >= 0, "a size");
  for (const auto& number : {info.focal_length_mm, info.f_number, info.exposure_s}) {
    promise(!number || std::isfinite(*number), "a finite number");
  }
  return 0;
}
