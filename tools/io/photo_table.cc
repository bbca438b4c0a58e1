#include "tools/io/photo_table.h"

#include <fmt/format.h>

#include <cmath>

#include "kinematics/geometry/covariance.h"
#include "tools/io/csv_table.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace {

constexpr const char* kSixColumns = "x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg";
constexpr const char* kSixSigmas =
    "sigma_x_mm,sigma_y_mm,sigma_z_mm,sigma_roll_deg,sigma_pitch_deg,sigma_yaw_deg";

}  // namespace

std::string format_photo_table(const std::string& head, const CampaignObservations& observations,
                               const CampaignResult& result) {
  std::string out =
      head + fmt::format("photo,pose,status,{},{},markers,rejected,rms_px\n", kSixColumns, kSixSigmas);
  for (std::size_t p = 0; p < result.photographs.size(); ++p) {
    const MeasuredPhotograph& photograph = result.photographs[p];
    const std::string status =
        photograph.status == PhotoStatus::ok
            ? std::string("ok")
            : fmt::format("{}: {}", photo_status_name(photograph.status), photograph.words);
    out += fmt::format("{},{},{}", csv_field(observations.photographs[p].seen.name),
                       csv_field(observations.photographs[p].pose), csv_field(status));
    if (photograph.UG_from_camera) {
      const Pose pose = pose_from_home_from_lg(*photograph.UG_from_camera);
      const Matrix6d j = pose_parameters_jacobian(pose);
      const Matrix6d covariance = j * photograph.covariance * j.transpose();
      for (int i = 0; i < 6; ++i)
        out += fmt::format(",{:.{}f}", pose.vector()[i] / pose_column_unit(i), i < 3 ? 6 : 7);
      for (int i = 0; i < 6; ++i)
        out += fmt::format(",{:.4g}", std::sqrt(covariance(i, i)) / pose_column_unit(i));
    } else {
      out += ",,,,,,,,,,,,";
    }
    out += fmt::format(",{},{},{:.4f}\n", photograph.residuals.markers, photograph.residuals.rejected,
                       photograph.residuals.rms_px);
  }
  return out;
}

std::vector<PhotoRecord> read_photo_table(const std::filesystem::path& path) {
  const CsvTable table = CsvTable::read(path);
  std::vector<std::string> required(kPoseColumns.begin(), kPoseColumns.end());
  required.insert(required.end(), {"photo", "pose"});
  table.require_columns(required);
  const auto count = [&table](std::size_t row, const char* column) {
    return table.has_column(column) ? table.integer(row, column) : 0;
  };
  std::vector<PhotoRecord> records;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    PhotoRecord record{table.text(row, "photo"),
                       table.text(row, "pose"),
                       table.has_column("status") ? table.text(row, "status") : std::string(),
                       std::nullopt,
                       count(row, "markers"),
                       count(row, "rejected"),
                       table.has_column("rms_px") ? table.number(row, "rms_px") : 0.0};
    if (table.optional_number(row, kPoseColumns[0])) {
      Vector6d v;
      for (std::size_t i = 0; i < 6; ++i)
        v[static_cast<Eigen::Index>(i)] = table.number(row, kPoseColumns[i]) * pose_column_unit(i);
      record.UG_from_camera = home_from_lg(Pose::from_vector(v));
    }
    records.push_back(std::move(record));
  }
  return records;
}

}  // namespace hexcal
