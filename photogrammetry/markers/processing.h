#pragma once

#include "photogrammetry/photograph/tone_response.h"

namespace hexcal {

/// An unsharp mask in encoded values, as cameras sharpen: value + amount (value - its Gaussian blur).
struct Sharpening {
  double amount = 0;        ///< 0: none
  double variance_px2 = 0;  ///< of the mask's Gaussian
};

/// What a camera did to the light on its way into the file.
struct Processing {
  // Implicit: a tone curve alone is a picture that was not sharpened.
  Processing(const ToneResponse& tone_response) : tone(tone_response) {}
  Processing(const ToneResponse& tone_response, const Sharpening& mask)
      : tone(tone_response), sharpening(mask) {}

  ToneResponse tone;
  Sharpening sharpening;
};

}  // namespace hexcal
