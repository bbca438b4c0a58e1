#include <cstdint>
#include <opencv2/core.hpp>

#include "photogrammetry/photograph/photograph.h"
#include "tests/fuzz/fuzz_input.h"

// A photograph of any content, as hexcal opens one. The first byte names the file's ending: r for a RAW file,
// anything else for the rest, which are told apart by their content.

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hexcal;
  using namespace hexcal::fuzzing;
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const Photograph photograph =
      read_photograph(memory_folder().put(data[0] == 'r' ? "photograph.dng" : "photograph.tif", bytes));
  if (photograph.status == PhotographStatus::ok) {
    promise(!photograph.grey.empty() && photograph.info.width_px == photograph.grey.cols, "pixels");
    promise(photograph.grey.type() == CV_8UC1 || photograph.grey.type() == CV_16UC1, "a type of pixels");
    (void)cv::sum(photograph.grey);  // every pixel is there to be read
  } else {
    promise(!photograph.reason.empty() && photograph.grey.empty(), "words and no pixels");
  }
  return 0;
}
