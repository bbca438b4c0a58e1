#include <cstdint>

#include "tests/fuzz/fuzz_input.h"
#include "tools/io/camera_export.h"
#include "tools/io/camera_file.h"

// Cameras of other programs; what was taken over must be writable as ours, which our own reader may then
// refuse.

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hexcal;
  using namespace hexcal::fuzzing;
  refused_or([&] {
    const auto file = memory_folder().put("camera.yml", {reinterpret_cast<const char*>(data), size});
    const ForeignCamera foreign = read_foreign_camera(file);
    promise_finite(foreign.camera.model.parameters, "an imported camera's parameters");
    promise(foreign.fit_rms_px >= 0, "the fit's rms");
    const auto again = memory_folder().put("again.yaml", format_camera_file("", foreign.camera));
    (void)read_camera_file(again);
  });
  return 0;
}
