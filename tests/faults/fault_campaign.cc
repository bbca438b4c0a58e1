#include "tests/faults/fault_campaign.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>

#include "photogrammetry/photograph/sha256.h"
#include "tools/io/csv_table.h"
#include "tools/synthetic/campaign_folder.h"

namespace hexcal {
namespace fs = std::filesystem;
namespace {

constexpr int kWidthPx = 640;
constexpr std::uint64_t kSeed = 11;

std::map<std::string, PoseRecord> by_id(const fs::path& path) {
  std::map<std::string, PoseRecord> records;
  if (!fs::exists(path)) return records;
  for (const PoseRecord& record : read_pose_table(path)) records[record.id] = record;
  return records;
}

double rms(const std::map<std::string, double>& errors) {
  double sum = 0;
  for (const auto& [pose, error] : errors) sum += error * error;
  return std::sqrt(sum / static_cast<double>(errors.size()));
}

SimulationOptions small_laboratory() {
  SimulationOptions options;
  options.seed = kSeed;
  options.width_px = kWidthPx;
  options.poses = 3;
  options.calibration_photos = 0;
  options.brown_lens = true;
  return options;
}

}  // namespace

std::pair<double, double> pose_distance(const Pose& a, const Pose& b) {
  const Rigid3 difference = inverse(home_from_lg(a)) * home_from_lg(b);
  return {(a.position_mm - b.position_mm).norm(),
          Eigen::AngleAxisd(difference.rotation).angle() * kDegPerRad};
}

const CleanCampaign& CleanCampaign::instance() {
  static const CleanCampaign campaign;
  return campaign;
}

CleanCampaign::CleanCampaign()
    : folder_(home_.path() / "lab"), laboratory_(make_laboratory(small_laboratory())) {
  RoundOptions round;
  round.true_camera = true;
  round.head = "# test\n";
  (void)write_campaign(folder_, laboratory_, round);
  for (const auto& [id, record] : by_id(folder_ / "truth" / "poses.csv")) truth_[id] = record.pose.value();
  hashes_ = photograph_hashes();
  const CommandResult result = run_hexcal({"measure", folder_.string()});
  if (result.exit_code != 0) throw std::runtime_error("the clean campaign fails: " + result.out + result.err);
  poses_csv_ = contents(folder_ / "results" / "poses.csv");
  for (const auto& [id, record] : by_id(folder_ / "results" / "poses.csv")) {
    if (id != "home")
      std::tie(error_mm_[id], error_deg_[id]) = pose_distance(record.pose.value(), truth_.at(id));
  }
}

double CleanCampaign::allowed_mm(const std::string& pose) const {
  return pose == "home" ? 0 : 2 * std::max(error_mm_.at(pose), rms(error_mm_));
}

double CleanCampaign::allowed_deg(const std::string& pose) const {
  return pose == "home" ? 0 : 2 * std::max(error_deg_.at(pose), rms(error_deg_));
}

std::vector<Shot> CleanCampaign::shots(const std::string& pose, std::uint64_t round) const {
  return pose_shots(laboratory_, {{pose, truth_.at(pose)}}, round, round == 0 ? 1 : 900);
}

std::map<std::string, std::string> CleanCampaign::photograph_hashes() const {
  std::map<std::string, std::string> hashes;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_ / "poses")) {
    if (entry.is_regular_file()) hashes[entry.path().string()] = sha256_hex(contents(entry.path()));
  }
  return hashes;
}

bool CleanCampaign::photographs_untouched() const { return photograph_hashes() == hashes_; }

const PoseRecord& Outcome::pose(const std::string& id) const {
  const auto found = poses.find(id);
  if (found == poses.end()) throw std::runtime_error("no pose " + id + " in poses.csv\n" + out + err);
  return found->second;
}

FaultCampaign::FaultCampaign() : folder_(home_.path() / "lab") {
  const fs::path& clean = CleanCampaign::instance().folder();
  fs::create_directories(folder_);
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(clean)) {
    const fs::path relative = entry.path().lexically_relative(clean);
    const bool is_result = *relative.begin() == "results";
    const bool is_cache = is_result && relative.string().find("cache") != std::string::npos;
    if (is_result && !is_cache) continue;
    if (entry.is_directory()) {
      fs::create_directories(folder_ / relative);
    } else if (is_cache || *relative.begin() == "poses") {
      fs::create_hard_link(entry.path(), folder_ / relative);
    } else {
      fs::copy_file(entry.path(), folder_ / relative);
    }
  }
}

std::vector<fs::path> FaultCampaign::photographs(const std::string& pose) const {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(poses() / pose))
    files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

void FaultCampaign::put(const fs::path& path, const std::string& bytes) const {
  fs::create_directories(path.parent_path());
  fs::remove(path);
  std::ofstream(path, std::ios::binary) << bytes;
}

void FaultCampaign::put(const fs::path& path, const Shot& shot) const {
  const VirtualLaboratory& laboratory = CleanCampaign::instance().laboratory();
  static const RayLattice lens(laboratory.camera);
  fs::create_directories(path.parent_path());
  write_jpeg(path, photograph(laboratory, lens, shot), laboratory.options.jpeg, shot.tags);
}

void FaultCampaign::replace(const std::string& file, const std::string& old_text,
                            const std::string& new_text) const {
  std::string text = contents(folder_ / file);
  const std::size_t at = text.find(old_text);
  if (at == std::string::npos) throw std::runtime_error(old_text + " is not in " + file);
  text.replace(at, old_text.size(), new_text);
  put(folder_ / file, text);
}

void FaultCampaign::use_nominal_lg() const {
  const CsvTable truth = CsvTable::read(folder_ / "truth" / "markers.csv");
  std::string table = "id,corner,x_mm,y_mm,z_mm,sigma_mm\n";
  for (std::size_t row = 0; row < truth.rows(); ++row) {
    if (truth.text(row, "body") != "LG") continue;
    table += fmt::format("{},{},{},{},{},0.002\n", truth.text(row, "id"), truth.text(row, "corner"),
                         truth.text(row, "x_mm"), truth.text(row, "y_mm"), truth.text(row, "z_mm"));
  }
  put(folder_ / "lg_nominal.csv", table);
  replace("campaign.yaml", "{from: home, pose: home, gd_mm: 50}",
          "{from: nominal, file: lg_nominal.csv, gd_mm: 50}");
}

Outcome FaultCampaign::measure(const std::vector<std::string>& flags) const {
  std::vector<std::string> arguments{"measure", folder_.string()};
  arguments.insert(arguments.end(), flags.begin(), flags.end());
  const CommandResult result = run_hexcal(arguments);
  return {result.exit_code, result.out, result.err, by_id(folder_ / "results" / "poses.csv")};
}

void FaultCampaign::expect_healthy(const Outcome& outcome, const std::vector<std::string>& poses) {
  const CleanCampaign& clean = CleanCampaign::instance();
  for (const std::string& id : poses) {
    const PoseRecord& record = outcome.pose(id);
    EXPECT_EQ(record.status, "ok") << id << '\n' << outcome.out << outcome.err;
    if (!record.pose) continue;
    const auto [mm, deg] = pose_distance(*record.pose, clean.truth(id));
    EXPECT_LE(mm, clean.allowed_mm(id)) << id << '\n' << outcome.out;
    EXPECT_LE(deg, clean.allowed_deg(id)) << id << '\n' << outcome.out;
  }
}

void FaultCampaign::expect_refused(const Outcome& outcome, const std::string& pose, const std::string& status,
                                   const std::string& words) {
  const PoseRecord& record = outcome.pose(pose);
  EXPECT_FALSE(record.pose.has_value()) << pose;
  EXPECT_THAT(record.status, ::testing::StartsWith(status));
  EXPECT_THAT(record.status, ::testing::HasSubstr(words));
  EXPECT_EQ(outcome.exit_code, 1);
}

}  // namespace hexcal
