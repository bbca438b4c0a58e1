#pragma once

#include <opencv2/core/mat.hpp>
#include <string_view>

#include "photogrammetry/photograph/photograph.h"

namespace hexcal {

/// Whether a 16-bit picture holds light or values of an sRGB-like curve, which no pixel format says. A PNG's
/// gamma chunk decides where there is one. Otherwise the noise does: photons' noise has a variance that grows
/// with the light, and a tone curve turns that round, for it is steep in the dark. Taken is linear where the
/// variance of the quietest blocks grows clearly with their brightness, else sRGB; so too where the picture
/// has one brightness only. `bytes`: the file; `grey`: CV_16UC1.
[[nodiscard]] ToneCurve judged_tone(std::string_view bytes, const cv::Mat& grey);

}  // namespace hexcal
