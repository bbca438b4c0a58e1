// Only decodes photographs, with as many threads as the processors it may use: by cv::imread in colour, the
// measure of tools/bench/stages.py, or as hexcal does (luminance, EXIF, SHA-256).
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "photogrammetry/photograph/photograph.h"

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() < 2 || (arguments[0] != "imread" && arguments[0] != "hexcal")) {
    fmt::print(stderr, "usage: read_photographs imread|hexcal PHOTOGRAPH...\n");
    return 2;
  }
  cv::setNumThreads(1);
  std::atomic<int> bad = 0;
  tbb::parallel_for(std::size_t{1}, arguments.size(), [&](std::size_t i) {
    const bool good = arguments[0] == "imread"
                          ? !cv::imread(arguments[i], cv::IMREAD_COLOR).empty()
                          : hexcal::read_photograph(arguments[i]).status == hexcal::PhotographStatus::ok;
    if (!good) ++bad;
  });
  if (bad > 0) fmt::print(stderr, "read_photographs: {} of {} not read\n", bad.load(), arguments.size() - 1);
  return bad > 0 ? 1 : 0;
}
