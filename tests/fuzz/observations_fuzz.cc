#include <cstdint>

#include "tests/fuzz/fuzz_input.h"
#include "tests/support/hexapods.h"
#include "tools/io/calibration_record.h"
#include "tools/io/controller_export.h"
#include "tools/io/measured_network.h"
#include "tools/io/observation_table.h"
#include "tools/io/observations_file.h"
#include "tools/io/pose_table.h"
#include "tools/io/residual_file.h"
#include "tools/io/row_stream.h"

// What one command writes and another, or a controller, reads. The first byte names the reader: o
// observations.txt, p poses, l readings, t poses joined with targets, readings and covariances (in parts), n
// photos.csv and markers.csv, r residuals.csv, j the calibration's record, g a GCS move list, x genhexkins'
// lines, s a table as a stream.

namespace hexcal::fuzzing {
namespace {

void observations(const std::string& text) {
  const DetectionSet set = parse_observations(text, "fuzz.txt");
  for (const PhotographObservations& photograph : set.photographs) {
    for (const MarkerObservation& marker : photograph.markers) {
      for (const auto& corner : marker.corners_px) promise_finite(corner, "a corner");
      promise_finite(marker.covariance_px2, "a corner's covariance");
    }
  }
  const std::string written = observations_text(set);
  promise(observations_text(parse_observations(written, "again.txt")) == written,
          "the same observations again");
}

void poses(const std::string& text) {
  const std::vector<PoseRecord> records = read_pose_table(memory_folder().put("poses.csv", text));
  for (const PoseRecord& record : records) {
    if (record.pose) promise_finite(record.pose->vector(), "a pose");
    if (record.sigma) promise_finite(*record.sigma, "a pose's sigma");
  }
  (void)format_pose_table("", records, PoseColumns::measured);
}

void legs(const std::string& text) {
  for (const LegRecord& record : read_leg_table(memory_folder().put("legs.csv", text))) {
    if (record.readings) promise_finite(*record.readings, "a reading");
  }
}

void joined(const std::string& text) {
  const std::vector<std::string> parts = parts_of(text);
  ObservationFiles files;
  files.poses = memory_folder().put("poses.csv", parts[0]);
  if (parts.size() > 1 && !parts[1].empty()) files.targets = memory_folder().put("targets.csv", parts[1]);
  if (parts.size() > 2 && !parts[2].empty()) files.legs = memory_folder().put("legs.csv", parts[2]);
  if (parts.size() > 3 && !parts[3].empty()) files.covariance = memory_folder().put("cov.csv", parts[3]);
  static const PlatformGeometry nominal = surrogate_hexapod();
  const ObservationTable table = read_observations(nominal, files);
  for (const auto& observation : table.observations.poses) {
    promise_finite(observation.readings, "a reading");
    if (observation.target) promise_finite(observation.target->vector(), "a target");
    promise_finite(observation.covariance, "a covariance");
  }
}

void network(const std::string& text) {
  const std::vector<std::string> parts = parts_of(text);
  memory_folder().put("photos.csv", parts[0]);
  memory_folder().put("markers.csv", parts.size() > 1 ? parts[1] : "");
  for (const auto& [id, corners] : read_measured_network(memory_folder().path()).moving_markers) {
    for (const auto& corner : corners) promise_finite(corner, "a moving corner");
  }
}

void residuals(const std::string& text) { (void)read_residuals(memory_folder().put("residuals.csv", text)); }

void record(const std::string& text) {
  (void)read_calibration_record(memory_folder().put("calibration.json", text), "fuzz");
}

void gcs(const std::string& text) { (void)parse_pi_gcs(text); }

void linuxcnc(const std::string& text) { (void)parse_linuxcnc(text, surrogate_hexapod()); }

void stream(const std::string& text) {
  RowTransform copy;
  copy.columns = {"a", "b"};
  copy.header = "pose,a,b\n";
  copy.row = [](const StreamedRow& row, std::string& out) {
    out += row.id;
    for (const double number : row.numbers) {
      out += ',';
      append_number(out, number, 3);
    }
    out += '\n';
    return true;
  };
  (void)stream_rows(memory_folder().put("in.csv", text), memory_folder().path() / "out.csv", "#", copy, 1);
}

}  // namespace
}  // namespace hexcal::fuzzing

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hexcal::fuzzing;
  static const std::map<char, void (*)(const std::string&)> readers{
      {'o', observations}, {'p', poses},  {'l', legs}, {'t', joined},   {'n', network},
      {'r', residuals},    {'j', record}, {'g', gcs},  {'x', linuxcnc}, {'s', stream}};
  read_by_first_byte(data, size, readers);
  return 0;
}
