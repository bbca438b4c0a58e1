#include "tools/io/observations_file.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <functional>
#include <set>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/printable_text.h"
#include "tools/io/atomic_file.h"
#include "tools/io/csv_table.h"
#include "tools/io/number_range.h"

namespace hexcal {
namespace {

constexpr std::string_view kLegend =
    "# Comma-separated records, one a line; their first field names the record.\n"
    "#   observations: version, marker family, SHA-256 of the camera file whose lens stood in the "
    "photometric model\n"
    "#   photograph:   name, sha256, status, reason, width_px, height_px, make, model, serial, lens, "
    "capture_time,\n"
    "#                 lens_id, focal_length_mm, focus_distance_code, f_number, exposure_s, iso, "
    "vibration_reduction\n"
    "#   marker:       id, status, x0_px, y0_px, x1_px, y1_px, x2_px, y2_px, x3_px, y3_px, chi2_per_dof, "
    "blur_px,\n"
    "#                 contrast, side_px, then the lower triangle of the covariance of x0 y0 ... y3 row by "
    "row (36, "
    "px^2),\n"
    "#                 method (photometric, edges or quad: how it was measured; absent in older files)\n"
    "# A marker belongs to the photograph above it; a photograph without one shows none. Empty: not known.\n"
    "# Pixel (0, 0) is the centre of the top-left pixel; corners 0 top-left, 1 top-right, 2 bottom-right, 3 "
    "bottom-left.\n";
constexpr int kVersion = 1;

// ---- Writing ----

std::string field(const std::string& text) { return csv_field(text); }
std::string field(bool value) { return value ? "1" : "0"; }
std::string field(int value) { return fmt::format("{}", value); }
std::string field(double value) { return fmt::format("{}", value); }
template <typename T>
std::string field(const std::optional<T>& value) {
  return value ? field(*value) : "";
}

template <typename... Fields>
void append_record(std::string& text, const char* kind, const Fields&... fields) {
  text += kind;
  ((text += ',', text += field(fields)), ...);
}

void append_photograph(std::string& text, const PhotographObservations& photograph) {
  const PhotographInfo& info = photograph.info;
  append_record(text, "photograph", photograph.name, photograph.sha256,
                std::string(photograph_status_name(photograph.status)), photograph.reason, info.width_px,
                info.height_px, info.make, info.model, info.serial, info.lens, info.capture_time,
                info.lens_id, info.focal_length_mm, info.focus_distance_code, info.f_number, info.exposure_s,
                info.iso, info.vibration_reduction);
  text += '\n';
}

void append_marker(std::string& text, const MarkerObservation& marker) {
  append_record(text, "marker", marker.id, std::string(marker_status_name(marker.status)));
  for (const auto& corner : marker.corners_px) {
    text += ',' + field(corner.x()) + ',' + field(corner.y());
  }
  for (const double value : {marker.chi2_per_dof, marker.blur_px, marker.contrast, marker.side_px}) {
    text += ',' + field(value);
  }
  for (int row = 0; row < 8; ++row) {
    for (int column = 0; column <= row; ++column) text += ',' + field(marker.covariance_px2(row, column));
  }
  text += fmt::format(",{}\n", marker_method_name(marker.method));
}

// ---- Reading ----

template <typename Status>
std::optional<Status> status_from_name(std::string_view name, const char* (*name_of)(Status)) {
  for (int value = 0;; ++value) {
    const std::string_view known = name_of(static_cast<Status>(value));
    if (known.empty()) return std::nullopt;
    if (known == name) return static_cast<Status>(value);
  }
}

// The fields of one record, taken from left to right.
class Record {
 public:
  Record(const std::filesystem::path& path, int line) : path_(path), line_(line) {}

  void add(std::string text) { fields_.push_back(std::move(text)); }
  [[nodiscard]] const std::string& kind() const { return fields_.front(); }
  [[nodiscard]] std::size_t size() const { return fields_.size(); }

  [[noreturn]] void fail(const std::string& message) const {
    throw InputError(fmt::format("{}:{}: {}", path_.string(), line_, message));
  }

  void expect_size(std::size_t wanted) const {
    if (fields_.size() != wanted) {
      fail(fmt::format("found {} fields in a {} record, wanted {}", fields_.size(), kind(), wanted));
    }
  }

  void take(std::string& value) { value = next(); }
  void take(int& value) { take_number(value, "a whole number"); }
  void take(double& value) {
    take_number(value, "a number");
    if (!std::isfinite(value)) fail("found a number that is not finite");
    std::string fault;
    value = ranged_number("", value, fault);
    if (!fault.empty()) fail(fault);
  }
  void take(bool& value) {
    int number = 0;
    take(number);
    if (number != 0 && number != 1) fail(fmt::format("found {}, wanted 0 or 1", number));
    value = number == 1;
  }
  template <typename T>
  void take(std::optional<T>& value) {
    if (fields_.at(next_).empty()) {
      ++next_;
      return;
    }
    take(value.emplace());
  }
  template <typename Status>
  void take_name(Status& status, const char* what, const char* (*name_of)(Status)) {
    const std::string& name = next();
    const auto found = status_from_name(name, name_of);
    if (!found) fail(fmt::format("found {} '{}', which is none", what, name));
    status = *found;
  }

 private:
  const std::string& next() { return fields_.at(next_++); }

  template <typename T>
  void take_number(T& value, const char* wanted) {
    const std::string& text = next();
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) {
      fail(fmt::format("found '{}', wanted {}", text, wanted));
    }
  }

  std::filesystem::path path_;
  int line_;
  std::vector<std::string> fields_;
  std::size_t next_ = 1;
};

// Splits the text into records; quoted fields may hold commas, quotes (doubled) and line breaks.
class RecordReader {
 public:
  RecordReader(std::string_view text, const std::filesystem::path& path) : text_(text), path_(path) {}

  std::optional<Record> next() {
    skip_comments();
    if (at_ >= text_.size()) return std::nullopt;
    Record record(path_, line_);
    for (;;) {
      record.add(field(record));
      if (at_ >= text_.size() || text_[at_] == '\n') break;
      ++at_;  // the comma
    }
    end_line();
    return record;
  }

 private:
  void end_line() {
    if (at_ < text_.size()) ++at_;
    ++line_;
  }

  void skip_comments() {
    while (at_ < text_.size() && (text_[at_] == '#' || text_[at_] == '\n' || text_[at_] == '\r')) {
      at_ = std::min(text_.find('\n', at_), text_.size());
      end_line();
    }
  }

  std::string field(const Record& record) {
    if (at_ < text_.size() && text_[at_] == '"') return quoted_field(record);
    const std::size_t end = std::min(text_.find_first_of(",\n", at_), text_.size());
    std::string value(text_.substr(at_, end - at_));
    at_ = end;
    if (!value.empty() && value.back() == '\r') value.pop_back();
    return value;
  }

  std::string quoted_field(const Record& record) {
    std::string value;
    for (++at_; at_ < text_.size(); ++at_) {
      if (text_[at_] == '\n') ++line_;
      if (text_[at_] != '"') {
        value += text_[at_];
      } else if (at_ + 1 < text_.size() && text_[at_ + 1] == '"') {
        value += text_[++at_];
      } else {
        ++at_;
        if (at_ < text_.size() && text_[at_] == '\r') ++at_;
        if (at_ < text_.size() && text_[at_] != ',' && text_[at_] != '\n') record.fail("text after a quote");
        return value;
      }
    }
    record.fail("a quote is not closed");
  }

  std::string_view text_;
  std::filesystem::path path_;
  std::size_t at_ = 0;
  int line_ = 1;
};

PhotographObservations photograph_from(Record& record) {
  record.expect_size(19);
  PhotographObservations photograph;
  PhotographInfo& info = photograph.info;
  record.take(photograph.name);
  record.take(photograph.sha256);
  record.take_name(photograph.status, "status", photograph_status_name);
  record.take(photograph.reason);
  record.take(info.width_px);
  record.take(info.height_px);
  record.take(info.make);
  record.take(info.model);
  record.take(info.serial);
  record.take(info.lens);
  record.take(info.capture_time);
  record.take(info.lens_id);
  record.take(info.focal_length_mm);
  record.take(info.focus_distance_code);
  record.take(info.f_number);
  record.take(info.exposure_s);
  record.take(info.iso);
  record.take(info.vibration_reduction);
  return photograph;
}

MarkerObservation marker_from(Record& record) {
  constexpr std::size_t kWithoutMethod = 51;
  const bool has_method = record.size() != kWithoutMethod;
  record.expect_size(has_method ? kWithoutMethod + 1 : kWithoutMethod);
  MarkerObservation marker;
  record.take(marker.id);
  if (marker.id < 0) record.fail(fmt::format("found id {}, wanted none below 0", marker.id));
  record.take_name(marker.status, "status", marker_status_name);
  for (auto& corner : marker.corners_px) {
    record.take(corner.x());
    record.take(corner.y());
  }
  record.take(marker.chi2_per_dof);
  record.take(marker.blur_px);
  record.take(marker.contrast);
  record.take(marker.side_px);
  for (int row = 0; row < 8; ++row) {
    for (int column = 0; column <= row; ++column) {
      record.take(marker.covariance_px2(row, column));
      marker.covariance_px2(column, row) = marker.covariance_px2(row, column);
    }
  }
  marker.method = MarkerMethod::photometric;
  if (has_method) record.take_name(marker.method, "method", marker_method_name);
  return marker;
}

}  // namespace

std::string observations_text(const DetectionSet& set, std::string_view provenance) {
  std::string text(provenance);
  text += kLegend;
  append_record(text, "observations", kVersion, set.family, set.camera_sha256);
  text += '\n';
  for (const auto& photograph : set.photographs) {
    append_photograph(text, photograph);
    for (const auto& marker : photograph.markers) append_marker(text, marker);
  }
  return text;
}

DetectionSet parse_observations(std::string_view text, const std::filesystem::path& path) {
  RecordReader reader(text, path);
  std::optional<Record> record = reader.next();
  if (!record || record->kind() != "observations") {
    throw InputError(fmt::format(
        "{}: not a file of marker observations: wanted a record 'observations' first", path.string()));
  }
  record->expect_size(4);
  int version = 0;
  record->take(version);
  if (version != kVersion) record->fail(fmt::format("found version {}, wanted {}", version, kVersion));
  DetectionSet set;
  record->take(set.family);
  record->take(set.camera_sha256);
  std::set<std::string> names;
  while ((record = reader.next())) {
    if (record->kind() == "photograph") {
      set.photographs.push_back(photograph_from(*record));
      const std::string& name = set.photographs.back().name;
      if (!names.insert(name).second)
        record->fail(fmt::format("photograph '{}' stands twice", printable_text(name)));
    } else if (record->kind() == "marker") {
      if (set.photographs.empty()) record->fail("a marker before the first photograph");
      set.photographs.back().markers.push_back(marker_from(*record));
    } else {
      record->fail(fmt::format("found a record '{}', wanted photograph or marker", record->kind()));
    }
  }
  return set;
}

DetectionSet read_observations(const std::filesystem::path& path, ReadFor purpose) {
  return parse_observations(read_file(path, purpose), path);
}

}  // namespace hexcal
