#include <cstdint>

#include "tests/fuzz/fuzz_input.h"
#include "tools/io/camera_file.h"
#include "tools/io/campaign_file.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/model_file.h"
#include "tools/io/sheet_file.h"

// The files that people write, through their own readers. The first byte names the file: c campaign.yaml (a
// second part is its table of nominal coordinates), i images.csv, h hexapod.yaml, k camera.yaml, s
// sheet.yaml, m model.yaml. What was accepted must survive being written and read again.

namespace hexcal::fuzzing {
namespace {

void campaign(const std::string& text) {
  const std::vector<std::string> parts = parts_of(text);
  if (parts.size() > 1) memory_folder().put("markers_nominal.csv", parts[1]);
  const Campaign read = read_campaign(memory_folder().put("campaign.yaml", parts[0]));
  promise(!read.cameras.empty(), "a campaign has a camera");
  for (const auto* sizes : {&read.fixed, &read.moving}) {
    for (const auto& [id, size] : *sizes) promise(id >= 0 && size > 0 && size < 1e300, "a marker's size");
  }
  for (const auto* rule : {&read.ug, &read.lg}) {
    if (!*rule) continue;
    for (const NominalPoint& point : (*rule)->nominal) promise_finite(point.xyz_mm, "a nominal point");
  }
}

void images(const std::string& text) { (void)read_images_table(memory_folder().put("images.csv", text)); }

void hexapod(const std::string& text) {
  const PlatformGeometry geometry = parse_hexapod(text, "fuzz.yaml");
  promise(!geometry_fault(geometry), "a geometry that was accepted has no fault");
  (void)parse_hexapod(hexapod_text("", geometry), "again.yaml");
}

void camera(const std::string& text) {
  const CalibratedCamera read = read_camera_file(memory_folder().put("camera.yaml", text));
  promise_finite(read.model.parameters, "a camera's parameters");
  if (read.covariance.size() > 0) promise_finite(read.covariance, "a camera's covariance");
  (void)read_camera_file(memory_folder().put("camera.yaml", format_camera_file("", read)));
}

void sheet(const std::string& text) {
  const std::vector<Sheet> sheets = read_sheet_file(memory_folder().put("sheet.yaml", text));
  for (const Sheet& read : sheets) {
    const SheetGeometry geometry = sheet_geometry(read);
    promise_finite(geometry.extent_mm, "a sheet's extent");
    for (const SheetPoint& point : sheet_points(geometry))
      promise_finite(point.position_mm, "a sheet's point");
    promise(!describe_sheet(read).empty(), "a sheet has words");
  }
  (void)read_sheet_file(memory_folder().put("sheet.yaml", format_sheet_file("", sheets)));
}

void model(const std::string& text) {
  (void)parse_model(model_text("", parse_model(text, "fuzz.yaml")), "again.yaml");
}

}  // namespace
}  // namespace hexcal::fuzzing

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hexcal::fuzzing;
  static const std::map<char, void (*)(const std::string&)> readers{
      {'c', campaign}, {'i', images}, {'h', hexapod}, {'k', camera}, {'s', sheet}, {'m', model}};
  read_by_first_byte(data, size, readers);
  return 0;
}
