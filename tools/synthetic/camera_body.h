#pragma once

#include <cstdint>

#include "tools/synthetic/camera_effects.h"
#include "tools/synthetic/lens_effects.h"
#include "tools/synthetic/render.h"

namespace hexcal {

/// develop() as a real camera does it: native colours, dust, noise and hot pixels in the raw values,
/// demosaicing, white balance and colour matrix, picture profile, noise reduction, sharpening, clipping. With
/// effects that add nothing, the bytes of develop() but for rounding. `camera_seed` places dust and hot
/// pixels, which stay the same from photograph to photograph; `seed` is the photograph's. CV_8UC3, blue,
/// green, red.
[[nodiscard]] cv::Mat develop(const SensorImage& image, const ChannelShift& shift,
                              const SensorOptions& options, const SensorEffects& sensor,
                              const ProcessingEffects& processing, std::uint64_t seed,
                              std::uint64_t camera_seed);

}  // namespace hexcal
