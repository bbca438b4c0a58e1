#include "tools/io/pose_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "kinematics/geometry/input_error.h"
#include "tools/io/csv_table.h"

namespace hexcal {
namespace {

constexpr std::array kLegNames{"q1", "q2", "q3", "q4", "q5", "q6"};

std::string read_id(const CsvTable& table, std::size_t row, std::set<std::string>& seen) {
  const std::string& id = table.text(row, "pose");
  if (id.empty()) table.fail(row, "pose", "is empty, wanted a pose id");
  if (!seen.insert(id).second) table.fail(row, "pose", fmt::format("pose '{}' stands twice", id));
  return id;
}

// Six numbers, or none at all where the row's status allows it.
std::optional<Vector6d> read_six(const CsvTable& table, std::size_t row,
                                 const std::array<const char*, 6>& names, bool may_be_empty) {
  Vector6d v;
  for (std::size_t i = 0; i < 6; ++i) {
    if (may_be_empty && table.text(row, names[i]).empty()) return std::nullopt;
    v[static_cast<Eigen::Index>(i)] = table.number(row, names[i]);
  }
  return v;
}

}  // namespace

bool is_suspect(const std::string& status) { return status == "suspect" || status.starts_with("suspect:"); }

std::vector<PoseRecord> read_pose_table(const std::filesystem::path& path, ReadFor purpose) {
  const CsvTable table = CsvTable::read(path, purpose);
  std::vector<std::string> required{"pose"};
  required.insert(required.end(), kPoseColumns.begin(), kPoseColumns.end());
  table.require_columns(required);
  const bool has_sigma = table.has_column("sigma_x_mm");
  std::set<std::string> seen;
  std::vector<PoseRecord> records;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    PoseRecord record;
    record.id = read_id(table, row, seen);
    if (table.has_column("status")) record.status = table.text(row, "status");
    const bool may_be_empty = record.status != "ok" && !is_suspect(record.status);
    if (auto v = read_six(table, row, kPoseColumns, may_be_empty)) {
      record.pose = wrapped(Pose::from_vector(mm_rad(*v)));
    }
    if (has_sigma && record.pose) {
      Vector6d sigma;
      bool complete = true;
      for (std::size_t i = 0; i < 6; ++i) {
        const auto value = table.optional_number(row, fmt::format("sigma_{}", kPoseColumns[i]));
        complete = complete && value.has_value();
        sigma[static_cast<Eigen::Index>(i)] = value.value_or(0.0) * pose_column_unit(i);
      }
      if (complete) record.sigma = sigma;
    }
    if (table.has_column("images")) record.images = table.integer(row, "images");
    if (table.has_column("markers")) record.markers = table.integer(row, "markers");
    if (table.has_column("rms_px")) record.rms_px = table.optional_number(row, "rms_px");
    if (table.has_column("remarks")) record.remarks = table.text(row, "remarks");
    records.push_back(std::move(record));
  }
  return records;
}

std::string format_pose_table(const std::string& head, const std::vector<PoseRecord>& records,
                              PoseColumns columns) {
  const bool with_status = columns != PoseColumns::target;
  const bool measured = columns == PoseColumns::measured;
  std::string out = head + "pose";
  if (with_status) out += ",status";
  for (const char* name : kPoseColumns) out += fmt::format(",{}", name);
  if (measured) {
    for (const char* name : kPoseColumns) out += fmt::format(",sigma_{}", name);
    out += ",images,markers,rms_px,remarks";
  }
  out += '\n';
  for (const PoseRecord& record : records) {
    out += csv_field(record.id);
    if (with_status) out += ',' + csv_field(record.status);
    for (std::size_t i = 0; i < 6; ++i) {
      out += ',';
      if (record.pose) {
        out +=
            fmt::format("{:.{}f}", record.pose->vector()[static_cast<Eigen::Index>(i)] / pose_column_unit(i),
                        i < 3 ? 6 : 7);
      }
    }
    if (measured) {
      for (std::size_t i = 0; i < 6; ++i) {
        out += ',';
        if (record.sigma)
          out += fmt::format("{:.4g}", (*record.sigma)[static_cast<Eigen::Index>(i)] / pose_column_unit(i));
      }
      out += fmt::format(",{},{},", record.images.value_or(0), record.markers.value_or(0));
      if (record.rms_px) out += fmt::format("{:.4f}", *record.rms_px);
      out += ',' + csv_field(record.remarks);
    }
    out += '\n';
  }
  return out;
}

std::vector<LegRecord> read_leg_table(const std::filesystem::path& path) {
  const CsvTable table = CsvTable::read(path);
  std::vector<std::string> required{"pose"};
  required.insert(required.end(), kLegNames.begin(), kLegNames.end());
  table.require_columns(required);
  std::set<std::string> seen;
  std::vector<LegRecord> records;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    LegRecord record;
    record.id = read_id(table, row, seen);
    if (table.has_column("status")) record.status = table.text(row, "status");
    record.readings = read_six(table, row, kLegNames, record.status != "ok");
    records.push_back(std::move(record));
  }
  return records;
}

std::string format_leg_table(const std::string& head, const std::vector<LegRecord>& records,
                             bool with_status) {
  std::string out = head + (with_status ? "pose,status" : "pose");
  for (const char* name : kLegNames) out += fmt::format(",{}", name);
  const bool approaches =
      std::ranges::any_of(records, [](const LegRecord& record) { return !record.approach.isZero(0); });
  for (int k = 1; approaches && k <= 6; ++k) out += fmt::format(",approach{}", k);
  out += '\n';
  for (const LegRecord& record : records) {
    out += csv_field(record.id);
    if (with_status) out += ',' + csv_field(record.status);
    for (Eigen::Index i = 0; i < 6; ++i) {
      out += record.readings ? fmt::format(",{:.9g}", (*record.readings)[i]) : std::string(",");
    }
    for (Eigen::Index i = 0; approaches && i < 6; ++i) out += fmt::format(",{:.0f}", record.approach[i]);
    out += '\n';
  }
  return out;
}

}  // namespace hexcal
